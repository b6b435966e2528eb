"""Headers of columns: names, units, and the texts that mean that a value is missing."""

from __future__ import annotations

from collections.abc import Iterable

from seatruth.errors import BadInput
from seatruth.units import is_unit

MISSING = ("", "-", "--", "---", "NaN", "nan", "NAN", "NA", "N/A", "n/a", "null", "NULL", "None", "#N/A", "*")
"""Texts that mean that a value is missing."""


def name_and_unit(header: str) -> tuple[str, str | None]:
    """("u", "m/s") from "u [m/s]" or "u (m/s)"; no unit where the bracket holds none."""
    text = header.strip()
    for opening, closing in ("[]", "()"):
        if text.endswith(closing) and opening in text:
            head, _, inside = text[:-1].rpartition(opening)
            if head.strip() and (is_unit(inside) or opening == "["):
                return head.strip(), inside.strip()
    return text, None


def named(headers: Iterable[str], source: str) -> tuple[list[str], dict[str, str]]:
    """Column names without their units, and the units; names must differ."""
    names: dict[str, None] = {}
    units: dict[str, str] = {}
    for position, header in enumerate(headers, 1):
        name, unit = name_and_unit(header)
        name = name or f"column{position}"
        if name in names:
            raise BadInput(f"two columns are called {name!r}", where=source, do="Give each column its own name.")
        names[name] = None
        if unit:
            units[name] = unit
    return list(names), units
