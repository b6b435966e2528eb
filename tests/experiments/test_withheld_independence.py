"""Reality, and what puts errors into real records, share no code with the library that diagnoses what they made."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

WITHHELD = Path(__file__).resolve().parents[2] / "experiments" / "withheld"
REALITY = WITHHELD / "reality"
INJECTED = WITHHELD / "records" / "injected.py"
ALLOWED = {"__future__", "collections", "dataclasses", "functools", "math", "numpy", "scipy", "typing"}


def _imports(file: Path) -> set[str]:
    found: set[str] = set()
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{file.name}: a relative import hides where it comes from"
            found.add(node.module or "")
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            assert node.func.id not in ("__import__", "exec", "eval"), file.name
    return found


@pytest.mark.parametrize("file", [*sorted(REALITY.glob("*.py")), INJECTED], ids=lambda file: file.name)
def test_reality_imports_only_itself_and_numerics(file: Path) -> None:
    for name in _imports(file):
        assert name.startswith("withheld.reality") or name.split(".")[0] in ALLOWED, f"{file.name} imports {name}"


def test_the_check_would_see_the_library(tmp_path: Path) -> None:
    bad = tmp_path / "bad.py"
    bad.write_text("from seatruth.models.mmg import motion\nimport seatruth.effects\n")
    assert {name.split(".")[0] for name in _imports(bad)} - ALLOWED == {"seatruth"}
