"""The examples in docstrings (lines that begin with >>>) give what they show."""

from __future__ import annotations

import doctest
import importlib
import pkgutil

import pytest

import seatruth

MODULES = sorted(
    module.name
    for module in pkgutil.walk_packages(seatruth.__path__, "seatruth.")
    if not module.name.endswith("__main__")
)


@pytest.mark.parametrize("name", MODULES)
def test_examples_give_what_they_show(name: str) -> None:
    result = doctest.testmod(importlib.import_module(name), optionflags=doctest.NORMALIZE_WHITESPACE)
    assert result.failed == 0
