"""Every public name says its arguments, what it returns and raises, and shows an example.

tests/test_docstring_examples.py runs the examples.
"""

from __future__ import annotations

import inspect
import re
from typing import Any

import pytest

import seatruth

NAMES = [name for name in seatruth.__all__ if name != "__version__"]


def sections(name: str) -> set[str]:
    text = inspect.getdoc(getattr(seatruth, name)) or ""
    return set(re.findall(r"^(Args|Attributes|Returns|Raises|Example):$", text, re.MULTILINE))


def arguments(name: str) -> list[str]:
    """Arguments of a public function or class that its docstring must describe."""
    kind: Any = getattr(seatruth, name)
    if inspect.isclass(kind) and (issubclass(kind, BaseException) or "__init__" not in vars(kind)):
        return []
    return [
        parameter for parameter in inspect.signature(kind).parameters if parameter not in ("self", "args", "kwargs")
    ]


@pytest.mark.parametrize("name", NAMES)
def test_a_public_name_is_documented(name: str) -> None:
    kind: Any = getattr(seatruth, name)
    assert vars(kind).get("__doc__") if inspect.isclass(kind) else kind.__doc__, f"{name} has no docstring"
    found = sections(name)
    assert "Example" in found, f"{name} has no example"
    assert ">>> " in (inspect.getdoc(kind) or ""), f"the example of {name} cannot be run"
    if inspect.isfunction(kind):
        assert {"Args", "Raises"} <= found, f"{name} lacks a section; it has {sorted(found)}"
        if inspect.signature(kind).return_annotation not in (None, "None"):
            assert "Returns" in found, f"{name} does not say what it returns"
    text = inspect.getdoc(kind) or ""
    missing = [argument for argument in arguments(name) if not re.search(rf"\b{argument}\b", text)]
    assert not missing, f"the docstring of {name} does not mention {missing}"
