"""What is wrong with a study file, in plain words: all of it in one message, each with its line."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from seatruth.errors import BadInput, SeatruthError, nearest
from seatruth.study.schema import StudyFile
from seatruth.study.schema_base import OpenTable
from seatruth.study.toml_positions import Lines, Path

_MOST = 12
"""Problems shown in one message; a file with more of them is told so."""


@dataclass(frozen=True)
class _Problem:
    """One thing wrong; `line` is 0 where it has none."""

    line: int
    place: str
    what: str
    do: str
    kind: type[SeatruthError]

    def __str__(self) -> str:
        what = self.what if self.what.endswith((".", "!", "?")) else self.what + "."
        return f"{self.place}: {what} {self.do}".strip() if self.place else f"{what} {self.do}".strip()


class Problems:
    """Collects everything wrong with one study file and raises it as one BadInput."""

    def __init__(self, source: str, lines: Lines | None = None) -> None:
        self.source = source
        self.lines = lines
        self._entries: dict[_Problem, None] = {}
        """In the order in which they were found, each once."""

    def __bool__(self) -> bool:
        return bool(self._entries)

    def add(self, path: Sequence[str | int], what: str, do: str = "", kind: type[SeatruthError] = BadInput) -> None:
        """Notes one problem at a key ("trials", 2, "file")."""
        line = self.lines.of(path) if self.lines else None
        place = ", ".join(part for part in (f"line {line}" if line else "", named(path)) if part)
        entry = _Problem(line or 0, place, what, do, kind)
        self._entries[entry] = None

    @contextmanager
    def at(self, *path: str | int) -> Iterator[None]:
        """Notes what is raised inside as a problem at that key and goes on."""
        try:
            yield
        except SeatruthError as problem:
            what = f"{problem.where}: {problem.what}" if problem.where else problem.what
            self.add(path, what, problem.do, type(problem))

    def stop(self) -> None:
        """Raises the message if there is any problem; a plug-in's failure keeps its own kind."""
        if not self._entries:
            return
        kinds = [problem.kind for problem in self._entries]
        kind = BadInput if any(issubclass(k, BadInput) for k in kinds) else kinds[0]
        if len(self._entries) == 1:
            (only,) = self._entries
            where = f"{self.source}, {only.place}" if only.place else self.source
            raise kind(only.what, where=where, do=only.do)
        ordered = sorted(self._entries, key=lambda problem: problem.line)
        hidden = len(ordered) - _MOST
        listing = "\n".join(f"  {problem}" for problem in ordered[:_MOST])
        listing += f"\n  and {hidden} more." if hidden > 0 else ""
        raise kind(f"{len(ordered)} problems\n{listing}", where=self.source)


def named(path: Sequence[str | int]) -> str:
    """A path as a reader of the file would call it: "[trials] 2, file"."""
    if not path:
        return ""
    head, rest = str(path[0]), list(path[1:])
    text = f"[{head}]"
    if rest and isinstance(rest[0], int):
        text += f" {rest[0] + 1}"
        rest = rest[1:]
    keys = ".".join(str(key + 1) if isinstance(key, int) else key for key in rest)
    return f"{text} {keys}" if keys else text


def add_schema_errors(
    problems: Problems, error: ValidationError, *, table: type[BaseModel] = StudyFile, at: Path = ()
) -> None:
    """Adds what pydantic reports about the table at the key `at`, in plain words."""
    for detail in error.errors(include_url=False, include_context=True):
        path: Path = tuple(part for part in detail["loc"] if _is_key(part))
        what, do = _plain(detail, path, at, table)
        # A union reports once for each of its branches; the collector keeps one of equal messages.
        problems.add((*at, *path), what, do)


def _is_key(part: str | int) -> bool:
    """Whether a part of pydantic's location is a key of the file, not the name of a branch of a union."""
    return isinstance(part, int) or part not in ("str", "float", "bool", "int")


def _plain(detail: ErrorDetails, path: Path, at: Path, table: type[BaseModel]) -> tuple[str, str]:
    kind, value, context = detail["type"], detail["input"], detail.get("ctx", {})
    key = path[-1] if path else "the table"
    named_key = f"item {key + 1}" if isinstance(key, int) else repr(key)
    if kind == "extra_forbidden":
        return f"unknown key {key!r}", nearest(str(key), _known_keys(path[:-1], table))
    if kind == "missing":
        return f"{named_key} is missing", ""
    if kind == "literal_error":
        allowed = str(context.get("expected", ""))
        words = allowed.replace("'", "").replace(" or ", ", ").split(", ")
        hint = nearest(value, words).split("Known:")[0].strip() if isinstance(value, str) else ""
        return f"{named_key} is {_shown(value)}, not {allowed}", hint
    if kind == "value_error":
        return f"{named_key}: {context.get('error', detail['msg'])}", ""
    if kind == "list_type" and isinstance(value, dict) and len(path) == 1:
        return f"[{key}] stands for several tables", f"Write [[{key}]], in double brackets."
    expected = _expected(kind, context)
    if table is StudyFile and (*at, *path)[:1] == ("noise",):
        expected = 'a number, a text with a unit or "estimate"'
    return f"{named_key} is {_shown(value)}, but must be {expected or detail['msg'].lower()}", ""


def _expected(kind: str, context: dict[str, Any]) -> str:
    words = {
        "string_type": "text in quotes",
        "float_type": "a number",
        "float_parsing": "a number",
        "int_type": "a whole number",
        "int_from_float": "a whole number",
        "bool_type": "true or false",
        "list_type": "a list in square brackets",
        "dict_type": "a table",
        "model_type": "a table",
        "model_attributes_type": "a table",
        "finite_number": "a finite number",
        "greater_than": f"greater than {context.get('gt')}",
        "less_than": f"less than {context.get('lt')}",
        "greater_than_equal": f"{context.get('ge')} or more",
        "too_short": f"a list of {context.get('min_length')}",
        "too_long": f"a list of {context.get('max_length')}",
    }
    return words.get(kind, "")


def _shown(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f'the text "{value}"' if len(value) <= 60 else "a long text"
    if isinstance(value, dict):
        return "a table"
    if isinstance(value, list):
        return f"a list of {len(value)}"
    return f"{value}"


def _known_keys(path: Path, top: type[BaseModel]) -> list[str]:
    """Keys that the table at `path` below `top` knows."""
    table: Any = top
    for part in path:
        if isinstance(part, int):
            continue
        field = table.model_fields.get(part) if _is_table(table) else None
        if field is not None:
            table = _inner(field.annotation)
        elif not _is_table(table):
            return []
        # otherwise `part` is a free name (a channel, a parameter) and `table` is already its entry's type
    return list(table.model_fields) if _is_table(table) and not issubclass(table, OpenTable) else []


def _inner(annotation: Any) -> Any:
    """The table type inside a field's annotation: `dict[str, T]`, `list[T]`, `T | None`, `Annotated[T, ...]`."""
    if _is_table(annotation):
        return annotation
    for argument in get_args(annotation):
        inner = _inner(argument)
        if inner is not None:
            return inner
    return None


def _is_table(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, BaseModel)
