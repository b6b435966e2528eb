"""Which files a pattern of a study takes: `*` and `?` within a folder, `**` for folders of any depth.

A study may come from somebody else, so a pattern must not search the whole disk: `**` stays in the study's folder and
follows no links, and elsewhere only a few parts of a path may be patterns.
"""

from __future__ import annotations

import glob
import os
from collections.abc import Iterator, Sequence
from fnmatch import fnmatchcase
from pathlib import Path

from seatruth.errors import BadInput

_MARKS = "*?["
_MOST_ENTRIES = 200_000
"""Files and folders that one pattern may look at; listing them takes about a second. Chosen here [S]."""
MOST_FILES = 10_000
"""Files that one pattern may take. A study of so many trials is a slip of the pattern. Chosen here [S]."""
_MOST_PARTS_ELSEWHERE = 2
"""Parts of a path outside of the study's folder that may be patterns, as "../*/run_*.csv". Chosen here [S]."""


def is_pattern(name: str) -> bool:
    """Whether a name of files is a pattern.

    Example:
        >>> is_pattern("zigzag_*.csv"), is_pattern("zigzag.csv")
        (True, False)
    """
    return any(mark in name for mark in _MARKS)


def matching_files(pattern: str, folder: Path, holding: str = "") -> list[Path]:
    """The plain files that a pattern takes, sorted; names that begin with a dot only where the pattern says so.

    Args:
        pattern: With forward slashes; relative to `folder`, or absolute.
        folder: Folder of the study. Its own name may hold `*`, `?` and brackets, which mean nothing there.
        holding: Folders with a file of this name count as files, as ROS 2 bags are; "" for none.

    Raises:
        BadInput: The pattern would search too much.
        OSError: A folder cannot be read.
    """
    parts = Path(pattern).parts
    elsewhere = Path(pattern).is_absolute() or ".." in parts
    if "**" in parts:
        if elsewhere or parts.count("**") > 1:
            raise BadInput(
                f"the pattern {pattern!r} searches too much",
                do="** may stand once, and stays in the folder of the study.",
            )
        hits = _found_below(folder, parts, holding)
    else:
        if elsewhere and sum(is_pattern(part) for part in parts) > _MOST_PARTS_ELSEWHERE:
            raise BadInput(
                f"the pattern {pattern!r} searches too much",
                do="Outside the folder of the study, name the folders in full.",
            )
        hits = (folder / hit for hit in glob.iglob(pattern, root_dir=folder))
    files: list[Path] = []
    for hit in hits:
        if hit.is_file() or (holding and (hit / holding).is_file()):
            files.append(hit)
        if len(files) > MOST_FILES:
            raise BadInput(f"the pattern {pattern!r} takes more than {MOST_FILES} files", do="Make it narrower.")
    return sorted(files)


def _found_below(folder: Path, pattern: Sequence[str], holding: str) -> Iterator[Path]:
    """The files below a folder whose path fits the parts of a pattern, and its folders where they may be taken."""
    seen = 0
    for base, folders, files in os.walk(folder):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        seen += len(folders) + len(files)
        if seen > _MOST_ENTRIES:
            raise BadInput(
                f"there are more than {_MOST_ENTRIES} files below {str(folder)!r}", do="Make the pattern narrower."
            )
        above = Path(base).relative_to(folder).parts
        for name in [*files, *(folders if holding else ())]:
            if _fits((*above, name), pattern) and (not name.startswith(".") or pattern[-1].startswith(".")):
                yield Path(base, name)


def _fits(parts: Sequence[str], pattern: Sequence[str]) -> bool:
    if not pattern:
        return not parts
    if pattern[0] == "**":
        return any(_fits(parts[k:], pattern[1:]) for k in range(len(parts) + 1))
    return bool(parts) and fnmatchcase(parts[0], pattern[0]) and _fits(parts[1:], pattern[1:])
