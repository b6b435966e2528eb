"""What a section is made of: text, notes, tables, figures. The template draws them; nothing here is HTML."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar

from markupsafe import Markup

_PHONE = 36
"""Characters of a row that fit on a phone of 390 pixels, with two for the gap of each column (measured)."""


@dataclass(frozen=True)
class Text:
    """A paragraph."""

    kind: ClassVar[str] = "text"
    text: str


@dataclass(frozen=True)
class Heading:
    """A heading inside a section."""

    kind: ClassVar[str] = "heading"
    text: str
    note: str = ""


@dataclass(frozen=True)
class Notes:
    """A list of sentences; `link` of each names a section, or is ""."""

    kind: ClassVar[str] = "notes"
    items: Sequence[tuple[str, str, bool]]
    """(text, section, grave)"""


@dataclass(frozen=True)
class Column:
    """`kind` of its cells: "text", "number" (aligned to the right), "verdict" (marked by colour and sign), "long" (a
    text that may wrap)."""

    title: str
    kind: str = "text"
    tip: str = ""


@dataclass(frozen=True)
class Table:
    """The first cell of each row is its header. `folded`: shown closed, under its caption."""

    kind: ClassVar[str] = "table"
    caption: str
    columns: Sequence[Column]
    rows: Sequence[Sequence[str]]
    folded: bool = False

    @property
    def cards(self) -> bool:
        """Whether each row becomes a card on a phone, so that nothing leaves the screen."""
        return self.compact or any(column.kind in ("long", "verdict") for column in self.columns)

    @property
    def compact(self) -> bool:
        """Whether the numbers of a card stand beside each other: of a table of numbers alone, too wide for a phone."""
        plain = not any(column.kind in ("long", "verdict") for column in self.columns)
        return plain and sum(_width(self, k) for k in range(len(self.columns))) > _PHONE


@dataclass(frozen=True)
class Picture:
    """One figure: SVG with its own alternative text, and a caption."""

    svg: Markup
    caption: str = ""
    wide: bool = False
    """Too wide for a phone, which then scrolls it."""


@dataclass(frozen=True)
class Pictures:
    """Figures beside each other where there is room. `legend`: (kind of line, text), said once for all. `wide`: each
    takes the whole width of a printed page."""

    kind: ClassVar[str] = "pictures"
    items: Sequence[Picture]
    legend: Sequence[tuple[str, str]] = ()
    wide: bool = False


@dataclass(frozen=True)
class Statement:
    """The one thing to read. `tone`: "sure", "unsure" or "wrong"."""

    kind: ClassVar[str] = "statement"
    title: str
    text: str
    tone: str = "sure"


@dataclass(frozen=True)
class Answer:
    """An answer to a question, and the sections that hold its evidence: (section, text)."""

    question: str
    text: str
    links: Sequence[tuple[str, str]] = ()


@dataclass(frozen=True)
class Answers:
    """Questions and their answers beside each other where there is room."""

    kind: ClassVar[str] = "answers"
    items: Sequence[Answer]


def _width(table: Table, k: int) -> int:
    """Characters that a column takes with its gap; heads may wrap between words."""
    head = max((len(word) for word in table.columns[k].title.split()), default=0)
    return 2 + max([head, *(len(row[k]) for row in table.rows)])


Block = Text | Heading | Notes | Table | Pictures | Statement | Answers


@dataclass(frozen=True)
class Section:
    """One section of the page."""

    id: str
    title: str
    blocks: list[Block] = field(default_factory=list)


def table(caption: str, columns: Sequence[Column], rows: Sequence[Sequence[str]], *, folded: bool = False) -> Table:
    """A table without those columns (but the first) that are empty in every row."""
    kept = [k for k in range(len(columns)) if k == 0 or any(row[k] for row in rows)]
    return Table(caption, [columns[k] for k in kept], [[row[k] for k in kept] for row in rows], folded)
