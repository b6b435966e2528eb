"""The same results to the last digit: identifications and a comparison against values stored earlier.

The stored values come from the commit before the modules were rearranged. They change only where a method is changed on
purpose; `pinned_results.py` says how to store new ones.
"""

from __future__ import annotations

import json
import platform
import sys
from typing import Any

import pytest
from pinned_results import PINNED, computed, versions

STORED: dict[str, Any] = json.loads(PINNED.read_text())


@pytest.fixture(scope="module")
def results() -> dict[str, Any]:
    if platform.machine().lower() not in ("x86_64", "amd64") or sys.platform != "linux":
        pytest.skip("the stored values are those of an x86-64 processor under Linux")
    if versions() != STORED["versions"]:
        pytest.skip(f"the stored values are those of {STORED['versions']}; here is {versions()}")
    return computed()


@pytest.mark.parametrize("name", STORED["identifications"])
def test_an_identification_gives_the_same_digits(results: dict[str, Any], name: str) -> None:
    assert results["identifications"][name] == STORED["identifications"][name]


def test_a_comparison_gives_the_same_digits(results: dict[str, Any]) -> None:
    assert results["comparison"] == STORED["comparison"]
