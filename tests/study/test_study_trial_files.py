"""Files that [[trials]] names: each that is none says why, with its place in the study file."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from seatruth.errors import BadInput
from seatruth.study import load_study, trial_files

LOG = "t,u\n" + "".join(f"{0.1 * k},{0.01 * k}\n" for k in range(40))
STUDY = """
[model]
use = "twin_thruster"
[channels]
u = { unit = "m/s" }
{extra}
[[trials]]
file = "{file}"
{entry}
"""


def said(folder: Path, file: str, entry: str = "", extra: str = "") -> str:
    """All that is wrong with a study whose trials are one entry."""
    text = STUDY.replace("{file}", file).replace("{entry}", entry).replace("{extra}", extra)
    (folder / "study.toml").write_text(text)
    with pytest.raises(BadInput) as caught:
        load_study(folder / "study.toml")
    return " ".join(str(caught.value).split())


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("run1.csv", "run2.csv", "turn.csv"):
        (tmp_path / name).write_text(LOG)
    (tmp_path / "logs").mkdir()
    os.symlink(tmp_path / "gone.csv", tmp_path / "link.csv")
    return tmp_path


@pytest.mark.parametrize(
    ("file", "says"),
    [
        ("turm.csv", "there is no file 'turm.csv'. Did you mean 'turn.csv'?"),
        (" ", "the file's name is empty or holds a null character. Name the file."),
        ("run\\u0000.csv", "the file's name is empty or holds a null character. Name the file."),
        ("logs", "'logs' is a folder. Name its files, as \"logs/*.csv\"."),
        ("link.csv", "'link.csv' is no plain file. It is a device, a pipe, or a link that leads nowhere."),
        ("leg*.csv", "no file fits 'leg*.csv'. Paths are relative to"),
        ("**/**/*.csv", "searches too much"),
        ("a" * 300, "cannot be looked for (File name too long). Check the path."),
    ],
)
def test_each_file_that_is_none_says_why(folder: Path, file: str, says: str) -> None:
    text = said(folder, file)
    assert says in text
    assert "study.toml" in text
    assert "line 8" in text  # of `file`


def test_names_of_trials(folder: Path) -> None:
    assert "'run*.csv' takes 2 files, which cannot all be called 'leg'" in said(folder, "run*.csv", 'name = "leg"')
    assert "from the same file" in said(folder, "run1.csv", '[[trials]]\nfile = "run1.csv"')


def test_too_many_trials_are_refused_before_they_are_read(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(trial_files, "MOST_FILES", 1)
    assert "it has 2 trials, more than 1. Split the study." in said(folder, "run1.csv", '[[trials]]\nfile = "run2.csv"')


def test_channels_that_nobody_knows(folder: Path) -> None:
    found = said(folder, "run1.csv", 'without = ["rr"]\nchannels.uu = { unit = "m/s" }', 'uuu = { unit = "m/s" }')
    for name in ("uuu", "uu"):
        assert f"unknown channel '{name}'. Did you mean 'u'?" in found
    assert "unknown channel 'rr'. Did you mean 'r'?" in found
    assert "time is not a channel. Describe it in [time]." in said(folder, "run1.csv", "", 't = { unit = "s" }')
