"""Patterns of files take what a shell would take, and never search the disk."""

from __future__ import annotations

from pathlib import Path

import pytest

from seatruth.errors import BadInput
from seatruth.study import file_patterns
from seatruth.study.file_patterns import matching_files


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder whose own name looks like a pattern."""
    place = tmp_path / "run [1]*"
    for name in ("a.csv", "b.csv", ".c.csv", "x/a.csv", "x/y/b.csv", ".git/d.csv"):
        (place / name).parent.mkdir(parents=True, exist_ok=True)
        (place / name).write_text("")
    (tmp_path / "e.csv").write_text("")
    return place


@pytest.mark.parametrize(
    ("pattern", "taken"),
    [
        ("*.csv", ["a.csv", "b.csv"]),
        ("?.csv", ["a.csv", "b.csv"]),
        (".*.csv", [".c.csv"]),
        ("*/*.csv", ["x/a.csv"]),
        ("**/*.csv", ["a.csv", "b.csv", "x/a.csv", "x/y/b.csv"]),
        ("x/**", ["x/a.csv", "x/y/b.csv"]),
        ("**/y/*.csv", ["x/y/b.csv"]),
        ("[b]*.csv", ["b.csv"]),
        ("../*.csv", ["../e.csv"]),
        ("z*", []),
    ],
)
def test_as_in_a_shell(folder: Path, pattern: str, taken: list[str]) -> None:
    assert matching_files(pattern, folder) == [folder / name for name in taken]


@pytest.mark.parametrize("pattern", ["/**/*", "../**/*.csv", "**/**/**/*", "/*/*/*/*", "../../*/*/*"])
def test_patterns_that_search_the_disk_are_refused(folder: Path, pattern: str) -> None:
    with pytest.raises(BadInput, match="searches too much"):
        matching_files(pattern, folder)


def test_links_are_not_followed_and_many_files_are_refused(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (folder / "all").symlink_to("/")
    assert len(matching_files("**/*.csv", folder)) == 4
    monkeypatch.setattr(file_patterns, "_MOST_ENTRIES", 5)
    with pytest.raises(BadInput, match="more than 5 files below"):
        matching_files("**/*.csv", folder)
    monkeypatch.setattr(file_patterns, "MOST_FILES", 1)
    with pytest.raises(BadInput, match="takes more than 1 files"):
        matching_files("*.csv", folder)
