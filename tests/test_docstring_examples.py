"""The examples in docstrings (lines that begin with >>>) give what they show."""

from __future__ import annotations

import doctest
import importlib
import pkgutil
from pathlib import Path

import pytest

import seatruth

LONG = ("seatruth.diagnosis.pipeline", "seatruth.diagnosis.results", "seatruth.report.page")
"""Modules whose examples take seconds."""
MODULES = sorted(
    module.name
    for module in pkgutil.walk_packages(seatruth.__path__, "seatruth.")
    if not module.name.endswith("__main__")
)


@pytest.mark.parametrize("name", [pytest.param(name, marks=[pytest.mark.slow] * (name in LONG)) for name in MODULES])
def test_examples_give_what_they_show(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)  # some examples write files
    result = doctest.testmod(importlib.import_module(name), optionflags=doctest.NORMALIZE_WHITESPACE)
    assert result.failed == 0
