"""What is wrong with a channel of all trials is said once, at its line."""

from __future__ import annotations

from pathlib import Path

import pytest

from seatruth.errors import BadInput
from seatruth.study import load_study

LOG = "t,u,yaw\n" + "".join(f"{0.1 * k},{0.01 * k},0\n" for k in range(40))
STUDY = """[model]
use = "twin_thruster"
vary = ["X_u"]
[time]
column = "{time}"
[channels]
u = {{ column = "{u}", unit = "{unit}" }}
n_port = {{ value = 5.0 }}
n_starboard = {{ value = 5.0 }}
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("a", "b", "c", "d", "e"):
        (tmp_path / f"{name}.csv").write_text(LOG)
    return tmp_path


def said(
    folder: Path, *, u: str = "u", unit: str = "m/s", time: str = "t", entries: str = "", files: str = "abc"
) -> str:
    without = 'without = ["x", "y", "psi", "v", "r"]\n'
    text = STUDY.format(u=u, unit=unit, time=time)
    text += "".join(f'[[trials]]\nfile = "{name}.csv"\n{without}' for name in files)
    (folder / "study.toml").write_text(text + entries)
    with pytest.raises(BadInput) as caught:
        load_study(folder / "study.toml")
    return str(caught.value).replace(str(folder), "")


def test_a_column_that_no_log_has_is_said_once_at_its_channel(folder: Path) -> None:
    text = said(folder, u="speed")
    assert "/study.toml, line 7, [channels] u.column: no column 'speed' in any trial. Known: " in text
    assert "problems" not in text


def test_trials_that_lack_it_are_named(folder: Path) -> None:
    (folder / "e.csv").write_text(LOG.replace("u", "speed"))
    assert "no column 'speed' in 'a', 'b', 'c' and 1 more." in said(folder, u="speed", files="abcde")


def test_one_log_that_lacks_it_is_at_fault_itself(folder: Path) -> None:
    (folder / "b.csv").write_text(LOG.replace("u", "speed"))
    assert "/study.toml, line 13, [trials] 2: /b.csv: no column 'u'." in said(folder)


def test_a_column_that_a_trial_names_itself_is_its_own(folder: Path) -> None:
    text = said(folder, entries='channels.u.column = "speed"\n')
    assert "[trials] 3: /c.csv: no column 'speed'." in text


def test_a_single_trial_has_it_at_the_channel_too(folder: Path) -> None:
    assert "line 7, [channels] u.column: no column 'speed' in 'a'." in said(folder, u="speed", files="a")


def test_so_has_the_time(folder: Path) -> None:
    assert "line 5, [time] column: no column 'clock' in any trial." in said(folder, time="clock")


@pytest.mark.parametrize(
    ("unit", "problem"),
    [("knods", "unknown unit 'knods'"), ("deg", "unit 'deg' is a pure number or an angle")],
)
def test_a_unit_that_does_not_fit_is_said_once(folder: Path, unit: str, problem: str) -> None:
    assert f"line 7, [channels] u.unit: {problem}" in said(folder, unit=unit)
