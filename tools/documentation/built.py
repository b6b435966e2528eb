"""What is looked at once the site is made: the tutorials were run, and they show what a reader should see."""

from __future__ import annotations

import re
from pathlib import Path

PICTURED = ("your_log", "formula", "diagnosis", "own_simulator")
"""Tutorials that show a figure."""
_UNSHOWN = {
    "<Figure size": "a figure that is not shown",
    "&lt;Figure size": "a figure that is not shown",
    "\x1b": "control characters of a terminal",
    "?25l": "control characters of a terminal",
}
_IMAGE = re.compile(r'<img [^>]*src="\.\./_images/')


def lacking(site: Path) -> list[str]:
    """What the tutorials of a built site lack, one line each."""
    pages = {page.stem: page.read_text(encoding="utf-8") for page in sorted((site / "tutorials").glob("*.html"))}
    found = [f"{name}: {what}" for name, text in pages.items() for what in {_UNSHOWN[k] for k in _UNSHOWN if k in text}]
    found += [f"{name}: no picture" for name in PICTURED if not _IMAGE.search(pages.get(name, ""))]
    return found
