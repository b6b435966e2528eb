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
    found = said(folder, "run1.csv", '[noise]\nn_port = "0.1 rpm"')
    assert "unknown channel 'n_port'. It is an input, which is taken as recorded: [noise] is that of outputs." in found
    assert "time is not a channel. Describe it in [time]." in said(folder, "run1.csv", "", 't = { unit = "s" }')


CONSTANT = """
[model]
use = "twin_thruster"
[parameters]
X_u = { vary = true }
[channels]
u = { column = "u", unit = "m/s" }
n_port = { value = 600.0, unit = "rpm" }
n_starboard = { value = 9.0 }
[[trials]]
file = "run1.csv"
without = ["x", "y", "psi", "v", "r"]
"""


def test_an_input_that_was_not_recorded_can_be_stated(folder: Path) -> None:
    (folder / "study.toml").write_text(CONSTANT)
    (trial,) = load_study(folder / "study.toml").trials
    assert trial.inputs["n_port"].tolist() == pytest.approx([10.0] * 40)
    assert trial.inputs["n_starboard"].tolist() == [9.0] * 40
    assert "600 throughout, as stated" in str(trial.steps)


@pytest.mark.parametrize(
    ("entry", "says"),
    [
        ("r = { value = 0.1 }", "'r' is no input, and only inputs can be stated"),
        ('n_port = { value = 9.0, column = "u" }', "'n_port' has a value and a column"),
        ('n_port = { mean = ["u", "r"], column = "u" }', "'n_port' has a mean and a column or a value"),
        ('n_port = { column = ["u", "r"] }', "a channel has one column; for the mean of several write mean = [...]"),
    ],
)
def test_a_stated_value_stands_for_the_column_of_an_input(folder: Path, entry: str, says: str) -> None:
    assert says in said(folder, "run1.csv", extra=entry)


def test_an_input_that_nothing_names_is_told_once_for_all_files(folder: Path) -> None:
    (folder / "study.toml").write_text(CONSTANT.replace("n_starboard = { value = 9.0 }\n", "").replace("run1", "run*"))
    with pytest.raises(BadInput) as caught:
        load_study(folder / "study.toml")
    text = str(caught.value)
    assert text.count("the input 'n_starboard' is not in [channels], and the file has no column of that name") == 1
    assert "Name its column, or give it a `value`." in text


def test_the_column_of_a_trial_stands_in_place_of_a_mean(folder: Path) -> None:
    shared = 'n_starboard = { mean = ["u", "u"], unit = "rpm" }'
    own = 'channels = { n_starboard = { column = "u" } }\nwithout'
    text = CONSTANT.replace("n_starboard = { value = 9.0 }", shared)
    for study in (text, text.replace("without", own)):
        (folder / "study.toml").write_text(study)
        (trial,) = load_study(folder / "study.toml").trials
        assert ("mean of 2 columns" in str(trial.steps)) == (study is text)
