"""Puts the source of the site together: pages that people write, and pages that are written from the code."""

from __future__ import annotations

import os
import re
import shutil
from pathlib import Path

import codes_pages
import effects_pages
import optimizers_page
import reference_pages
import withheld_picture

_TOP = {
    "README.md": "project/readme.md",
    "CONTRIBUTING.md": "project/contributing.md",
    "CHANGELOG.md": "project/changelog.md",
    "CODE_OF_CONDUCT.md": "project/code_of_conduct.md",
    "SECURITY.md": "project/security.md",
    "experiments/README.md": "gallery/experiments.md",
    "experiments/real_ships/README.md": "gallery/real_ships.md",
    "experiments/withheld/blind_sets.md": "gallery/blind_sets.md",
    "experiments/withheld/real_records.md": "gallery/real_records.md",
}
"""Pages outside docs/ and their places in the site."""

_LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\]]*\])*)\]\((?!https?:|mailto:|#)([^)\s#]+)(#[^)\s]*)?\)")


def assemble(root: Path, site: Path) -> None:
    """Writes the source of the site into a folder that is made anew."""
    shutil.rmtree(site, ignore_errors=True)
    shutil.copytree(root / "docs", site)
    places = {(root / "docs" / page.relative_to(site)).resolve(): page for page in site.rglob("*.md")}
    places |= {(root / name).resolve(): site / place for name, place in _TOP.items()}
    for source, page in places.items():
        page.parent.mkdir(parents=True, exist_ok=True)
        page.write_text(relinked(source, page, places), encoding="utf-8")
    codes_pages.write(site / "codes")
    reference_pages.write(site / "reference")
    effects_pages.write(site / "gallery" / "effects")
    effects_pages.write_pair(site / "explanations" / "look_alikes.md")
    optimizers_page.write(site / "gallery")
    withheld_picture.insert(site / "gallery" / "experiments.md")


def relinked(source: Path, page: Path, places: dict[Path, Path]) -> str:
    """A page's text with links that hold in the site. Pictures are copied; a file that is no page keeps its name.

    A link to nothing is a ValueError: as a name it would look like a file.
    """

    def link(found: re.Match[str]) -> str:
        picture, text, target, anchor = found[1], found[2], found[3], found[4] or ""
        path = (source.parent / target).resolve()
        if not path.exists():
            raise ValueError(f"{source}: the link to {target} leads nowhere")
        if path in places:
            return f"[{text}]({os.path.relpath(places[path], page.parent).replace(os.sep, '/')}{anchor})"
        if picture and path.is_file():
            copied = page.parent / "figures" / path.name
            copied.parent.mkdir(exist_ok=True)
            if path != copied.resolve():
                shutil.copyfile(path, copied)
            return f"![{text}](figures/{path.name})"
        return text if text.startswith("`") else f"`{text}`"

    return _LINK.sub(link, source.read_text(encoding="utf-8"))
