"""`seatruth predict` as a user calls it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import seatruth.sample
from seatruth import cli


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("predict")
    seatruth.sample.copy_to(place)
    study = place / "study.toml"
    assert cli.run(["identify", str(study), "--evaluations", "300", "--quiet", "--out", str(place / "result")]) == 0
    return place


def call(folder: Path, *arguments: str) -> int:
    options = ["--result", str(folder / "result"), "--out", str(folder / "out"), "--draws", "60", "--quiet"]
    return cli.run(["predict", str(folder / "study.toml"), *options, *arguments])


def test_figures_are_printed_written_and_given_as_json(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    answer = folder / "answer.json"
    plans = ["--turn", "35", "--turn", "-35", "--zigzag", "-20/20", "--stop", "-8"]
    assert call(folder, *plans, "--scale", "45.7", "--json", str(answer)) == 0
    shown = capsys.readouterr().out
    for words in ("SYNTHETIC", "1 : 45.7", "turning circle -35", "zigzag 20/20 port first", "crash stop -8 rev/s"):
        assert words in shown, words
    assert "Measured in the trials" in shown
    result = json.loads(answer.read_text())["result"]
    assert {row["kind"] for row in result["figures"]} == {"turn", "zigzag", "stop"}
    assert {row["trial"] for row in result["measured"]} >= {"turning_circle_35", "zigzag_20_10"}
    assert result["conditions"]["without"] == ["current_east", "current_north"]
    names = {path.name for path in (folder / "out").iterdir()}
    assert names >= {"report.html", "figures.csv", "measured.csv", "tracks.csv"}


def test_only_the_manoeuvres_of_the_trials(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert call(folder, "--trials-only") == 0
    shown = capsys.readouterr().out
    assert "turning_circle_35" in shown
    assert "turning circle 35\n" not in shown


def test_nothing_is_written_where_the_trials_hold_no_manoeuvre(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """An empty report said that no manoeuvre was asked for."""
    monkeypatch.setattr("seatruth.prediction.measured.recognise", lambda trial, model: [])
    assert call(folder, "--trials-only", "--out", str(folder / "none")) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert "the trials hold no turning circle, zigzag or stop that is recognised." in said
    assert "--turn 35" in said
    assert not (folder / "none").exists()


def test_manoeuvres_by_thrust_are_given_in_per_cent() -> None:
    from seatruth.commands.predict import _plans

    plans = _plans(["-20%", "35"], ["-10%/20"], [], ["20%/10%/60"])
    assert [plan.label for plan in plans] == [
        "turning circle -20 %",
        "turning circle 35",
        "zigzag 10 %/20 port first",
        "spiral 20 %/10 %/0 %/-10 %/-20 %/-10 %/0 %/10 %/20 %",
    ]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--turn", "x"], "--turn: 'x' is not of the form 35"),
        (["--turn", "120"], "no such angle"),
        (["--zigzag", "20"], "20/20"),
        (["--spiral", "5/10/60"], "do not reach"),
        (["--turn", "20%"], "A rudder steers it"),
        (["--turn", "120%"], "no such share"),
        (["--zigzag", "20%/20%"], "--zigzag 20%/20"),
        (["--spiral", "20%/5/60"], "--spiral 20%/5%/60"),
        (["--spiral", "5%/10%/60"], "steps of 10 % do not reach 5 %"),
        (["--input", "n"], "NAME=VALUE"),
        (["--input", "nn=3"], "Did you mean 'n'"),
        (["--level", "2"], "level"),
        (["--draws", "2"], "2 draws"),
        (["--result", "nowhere"], "seatruth identify"),
    ],
)
def test_wrong_options_say_what_to_do(
    folder: Path, arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert call(folder, *arguments) == 2
    shown = " ".join(capsys.readouterr().err.split())
    assert words in shown
    assert "Traceback" not in shown
