"""The table of diagnosis.json in docs/diagnosis.md, made from the docstrings of the result classes.

`python tests/diagnosis/results_table.py` writes it into the page; a test checks that it stands there.
"""

from __future__ import annotations

import ast
import dataclasses
import inspect
import types
import typing
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from seatruth.diagnosis import results
from seatruth.trials.finding import Finding

PAGE = Path(__file__).parents[2] / "docs" / "diagnosis.md"
START, END = "<!-- table of the results: begin -->\n", "<!-- table of the results: end -->\n"
_NOT_IN_THE_FILE = ("traces",)


def table() -> str:
    """The table as Markdown, one row per field of the file."""
    lines = ["| field | is |", "|---|---|", f"| `format` | Version of this layout, {results.FORMAT} |"]
    lines += [
        "| `checksum` | Checksum of all else in this file |",
        "| `traces_checksum` | Checksum of the file of traces |",
    ]
    lines += [f"| `{path}` | {text} |" for path, text in _rows(results.Diagnosis, "")]
    return "\n".join(lines) + "\n"


def page_with(content: str) -> str:
    """The page with this table between its marks."""
    text = PAGE.read_text(encoding="utf-8")
    before, _, rest = text.partition(START)
    _, _, after = rest.partition(END)
    return f"{before}{START}{content}{END}{after}"


def _rows(cls: type, path: str) -> Iterator[tuple[str, str]]:
    docs, hints = _docstrings(cls), typing.get_type_hints(cls)
    for field in dataclasses.fields(cls):
        if cls is results.Diagnosis and field.name in _NOT_IN_THE_FILE:
            continue
        name, inner = f"{path}{field.name}", _inside(hints[field.name])
        suffix = _suffix(hints[field.name])
        if docs[field.name]:
            yield f"{name}{suffix}", docs[field.name]
        elif inner is None:
            raise SystemExit(f"{cls.__name__}.{field.name} has no docstring")
        if inner is not None and inner is not Finding:
            yield from _rows(inner, f"{name}{suffix}.")


def _docstrings(cls: type) -> dict[str, str]:
    """The string below each annotated field, on one line."""
    (tree,) = ast.parse(inspect.getsource(cls)).body
    assert isinstance(tree, ast.ClassDef)
    found = {field.name: "" for field in dataclasses.fields(cls)}
    for entry, below in zip(tree.body, tree.body[1:]):
        if isinstance(entry, ast.AnnAssign) and isinstance(entry.target, ast.Name) and isinstance(below, ast.Expr):
            text = " ".join(str(ast.literal_eval(below.value)).split()).rstrip(".")
            found[entry.target.id] = text.replace("|", r"\|")
    return found


def _suffix(kind: Any) -> str:
    """[] for a list or tuple, .* for a mapping, both where they are nested."""
    kind = _without_none(kind)
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if origin in (tuple, list) and arguments:
        return "[]" + _suffix(arguments[0])
    if origin is not None and isinstance(origin, type) and issubclass(origin, Mapping) and origin is not dict:
        return ".*" + _suffix(arguments[1])
    return ""


def _inside(kind: Any) -> type | None:
    """The dataclass in a field, in its lists or mappings; None where there is none."""
    kind = _without_none(kind)
    if isinstance(kind, type) and dataclasses.is_dataclass(kind):
        return kind
    return next((inner for part in typing.get_args(kind) if (inner := _inside(part)) is not None), None)


def _without_none(kind: Any) -> Any:
    if typing.get_origin(kind) in (types.UnionType, typing.Union):
        (kind,) = [part for part in typing.get_args(kind) if part is not type(None)]
    return kind


if __name__ == "__main__":
    PAGE.write_text(page_with(table()), encoding="utf-8")
