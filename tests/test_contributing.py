"""CONTRIBUTING.md leads a newcomer to files and names that exist, docs/architecture.md shows the contract's layers."""

from __future__ import annotations

import ast
import re
import tomllib
from pathlib import Path

import pytest

from seatruth.text import ORIGINS

ROOT = Path(__file__).parents[1]
ROW = re.compile(
    r"^\| (?P<wish>[^|]+) \| `(?P<file>[^`|]+\.py)` \| `(?P<name>\w+)` \| `(?P<tests>tests[^`|]*)` \|$", re.MULTILINE
)
TEXT = (ROOT / "CONTRIBUTING.md").read_text()
WISHES = [match.groupdict() for match in ROW.finditer(TEXT)]


def source(file: str) -> Path:
    """The file that a table names: below the repository's root, or below the package."""
    return ROOT / file if (ROOT / file).exists() else ROOT / "src" / "seatruth" / file


def defined_names(file: Path) -> set[str]:
    """Functions, classes and variables that a module defines at its top level."""
    names: set[str] = set()
    for node in ast.parse(file.read_text()).body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            names.add(node.name)
        elif isinstance(node, ast.Assign):
            names.update(target.id for target in node.targets if isinstance(target, ast.Name))
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            names.add(node.target.id)
    return names


def test_every_row_of_the_table_is_read() -> None:
    rows = [line for line in TEXT.splitlines() if re.search(r"\| `tests[^`]*` \|$", line)]
    assert len(WISHES) == len(rows) >= 10


@pytest.mark.parametrize("row", WISHES, ids=[row["wish"] for row in WISHES])
def test_a_wish_leads_to_its_file(row: dict[str, str]) -> None:
    file = source(row["file"])
    assert file.is_file(), "the file does not exist"
    assert row["name"] in defined_names(file), "the file does not define the name"
    tests = ROOT / row["tests"]
    assert tests.is_file() or list(tests.glob("test_*.py")), "no such tests"


def test_every_conformance_suite_that_it_names_exists() -> None:
    suites = re.findall(r"`(\w+)` in `(testing/\w+\.py)`", TEXT)
    assert len(suites) == 4
    for name, file in suites:
        assert name in defined_names(source(file)), name


def test_the_architecture_shows_the_layers_of_the_contract() -> None:
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    layers = next(contract["layers"] for contract in contracts if contract["id"] == "layers")
    blocks = re.findall(r"```text\n(.*?)```", (ROOT / "docs" / "architecture.md").read_text(), re.DOTALL)
    assert layers in [[line.strip() for line in block.splitlines()] for block in blocks]


def test_the_glossary_explains_every_tag_of_origin_as_the_program_does() -> None:
    glossary = (ROOT / "docs" / "glossary.md").read_text()
    for tag, meaning in ORIGINS.items():
        assert re.search(rf"^\| \[{tag}\] \| {re.escape(meaning)}\b", glossary, re.MULTILINE), tag


def test_the_names_in_the_glossary_are_in_the_sources() -> None:
    rows = re.findall(r"^\|([^|]+)\|[^|]+\|([^|]+)\|$", (ROOT / "docs" / "glossary.md").read_text(), re.MULTILINE)
    names = [(term.strip(), name) for term, cell in rows for name in re.findall(r"`\[*(\w+)", cell)]
    assert len(names) > 50
    sources = "\n".join(path.read_text() for path in (ROOT / "src" / "seatruth").rglob("*.py"))
    missing = [(term, name) for term, name in names if not re.search(rf"\b{name}\b", sources)]
    assert not missing


def test_the_hooks_and_the_workflow_are_the_steps_of_the_checks() -> None:
    def targets(pattern: str, file: str) -> list[str]:
        return re.findall(pattern, (ROOT / file).read_text(encoding="utf-8"), re.MULTILINE)

    steps = targets(r'^step ".+" (\S+)$', ".ci/run")
    assert len(steps) == 7
    assert targets(r"^ +entry: make (\S+)$", ".pre-commit-config.yaml") == steps
    called = [name for names in targets(r"run: make (.+)$", ".github/workflows/checks.yml") for name in names.split()]
    assert set(steps) | set(called) <= set(targets(r"^([\w-]+):", "Makefile"))
