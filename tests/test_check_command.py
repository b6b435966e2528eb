"""`seatruth check`: what it says of the standard errors that the trials allow."""

from __future__ import annotations

from importlib.resources import as_file, files
from pathlib import Path

import pytest
from nomoto_ship import SHIP, begun, call, write_ship

from seatruth.commands import check
from seatruth.costs.growth import Growth
from seatruth.trials.finding import Finding


@pytest.mark.parametrize(
    ("noise", "said"),
    [
        ({}, "at the start values and the noise that their misfit shows:"),
        ({"r": "0.1 deg/s"}, "and the stated noise, else the noise that their misfit shows:"),
        ({"r": "0.1 deg/s", "psi": "0.5 deg"}, "at the start values and the stated noise:"),
    ],
)
def test_the_preview_says_at_which_noise_its_errors_hold(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    noise: dict[str, str],
    said: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    study = begun(tmp_path)
    lines = "".join(f'{name} = "{value}"\n' for name, value in noise.items())
    study.write_text(study.read_text().replace("[noise]\n", f"[noise]\n{lines}"))
    assert call("check", "zigzag.toml") in (0, 1)
    shown = " ".join(capsys.readouterr().out.split())
    assert said in shown
    assert "A best std. error is a bound" in shown
    assert " effects; --effects lists them." in shown
    assert "Effects that it cannot try, and why: - " in shown
    assert "the model's rhs takes no environment e" in shown


def test_a_fault_in_ones_own_model_is_told_as_such_beside_what_the_data_show(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    write_ship(tmp_path)
    assert call("init", "zigzag.csv", "--model", "ship.py:Nomoto") == 0
    wrong = SHIP.replace("(p.K * i.delta - s.r)", "(p.K * math.sin(i.delta) - s.r)")
    line = 1 + wrong.splitlines().index("        return (p.K * math.sin(i.delta) - s.r) / p.T, s.r")
    (tmp_path / "ship.py").write_text(wrong)
    capsys.readouterr()
    for options in ((), ("--no-preview",)):
        assert call("check", "zigzag.toml", *options) == 1
        shown = capsys.readouterr()
        said = " ".join(shown.out.split())
        assert f"error: model 'nomoto', ship.py, line {line}: rhs raises NameError" in said
        assert 'Write "import math" at the top of the file.' in said
        assert "[input-jumps]" in said
        assert "fault in seatruth" not in said + shown.err
    assert call("init", "zigzag.csv", "--model", "ship.py:Nomoto", "-o", "other.toml") == 1
    assert f"ship.py, line {line}" in " ".join(capsys.readouterr().err.split())


def test_one_drop_out_of_a_receiver_is_said_once_for_all_that_it_gives(capsys: pytest.CaptureFixture[str]) -> None:
    """Channels together, and trials; what is said of another stretch stands for itself."""

    def gap(channel: str, trial: str, until: float) -> Finding:
        said = f"No valid sample from t = 2 to {until:g} s."
        where = f"{trial}.csv, lines 3-9, channel {channel!r}"
        return Finding("note", "output-gap", said, where, "Check that.", trial, channel)

    findings = [gap(channel, "turn", 5.0) for channel in ("x", "y", "sog")]
    findings += [gap(channel, "run", 7.0) for channel in ("x", "y", "sog")] + [gap("r", "turn", 9.0)]
    check._show(findings, "nothing found")
    shown = " ".join(capsys.readouterr().out.split())
    assert shown.count("[output-gap]") == 2
    assert "turn.csv, lines 3-9, channels 'x', 'y' and 'sog': No valid sample from t = 2 to 5 s." in shown
    assert "[output-gap] Also in 'run'." in shown
    assert "channel 'r': No valid sample from t = 2 to 9 s." in shown


def test_what_is_found_twice_in_each_trial_is_said_twice_for_all(capsys: pytest.CaptureFixture[str]) -> None:
    """Of an ROV whose rate was in another unit each of five trials had the second line by itself."""
    findings = [
        Finding("error", "unit", said, f"{trial}.csv, channel 'r'", "State it.", trial, "r")
        for trial in ("turn", "run", "stop")
        for said in ("It reaches 77 rad/s.", "psi changes by 0.017 times its integral.")
    ]
    check._show(findings, "nothing found")
    shown = " ".join(capsys.readouterr().out.split())
    assert shown.count("Also in 'run' and 'stop'.") == shown.count("[unit]") == 2


def test_what_was_not_checked_is_not_said_to_be_free_of_faults(capsys: pytest.CaptureFixture[str]) -> None:
    """Of a drive recorded with its sign turned `check --no-preview` said that signs were right."""
    with as_file(files("seatruth") / "sample") as folder:
        assert call("check", str(folder / "diagnose.toml"), "--no-preview") == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert "No fault of times, units or columns is found" in shown
    assert "Signs of the drives are checked without --no-preview alone" in shown


def test_the_effects_of_a_diagnosis_are_listed_where_they_are_asked_for(capsys: pytest.CaptureFixture[str]) -> None:
    with as_file(files("seatruth") / "sample") as folder:
        assert call("check", str(folder / "diagnose.toml"), "--effects") == 0
        shown = capsys.readouterr().out
        assert " effects:" in shown
        assert "heading_bias" in shown
        assert "rudder zero offset" in shown


def test_nothing_is_called_identified_where_runs_lose_the_record(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of an ROV that missed its heading by three turns a pull of 235 N was "identified" to 0.03 N."""
    monkeypatch.chdir(tmp_path)
    study = begun(tmp_path)
    study.write_text(study.read_text().replace("[parameters]\n", "[parameters]\nK = { value = 0.9 }\n"))
    capsys.readouterr()
    assert call("check", "zigzag.toml") in (0, 1)
    shown = " ".join(capsys.readouterr().out.split())
    assert "psi is missed by" in shown
    assert "Check again with values that follow the trials." in shown
    assert "A best std. error is a bound" not in shown
    # Where a pilot holds what would turn by itself, no values follow.
    monkeypatch.setattr(Growth, "is_too_far", True)
    monkeypatch.setattr(Growth, "sections", 4)
    assert call("check", "zigzag.toml") in (0, 1)
    shown = " ".join(capsys.readouterr().out.split())
    assert "No values may follow whole trials: a small error grows" in shown
    assert "set `segments = " in shown
