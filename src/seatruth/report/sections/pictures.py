"""Figures for the page: each with its alternative text and a key that no other figure of the page has."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import count

from markupsafe import Markup
from matplotlib.figure import Figure

from seatruth.report.blocks import Picture
from seatruth.report.figures.svg import svg

_WIDE = 6.0
"""Inches from which a figure cannot be read at the width of a phone."""


class Album:
    """Numbers the figures of one page, so that ids inside their SVG do not clash."""

    def __init__(self) -> None:
        self._numbers: Iterator[int] = count(1)

    def picture(self, figure: Figure, alt: str, caption: str = "") -> Picture:
        """The figure as it stands in the page."""
        wide = bool(figure.get_figwidth() > _WIDE)
        return Picture(Markup(svg(figure, alt, f"f{next(self._numbers)}")), caption, wide)
