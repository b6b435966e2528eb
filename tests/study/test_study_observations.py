"""Channels of a study file that measure something else than the model's outputs."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from seatruth import diagnose, identify
from seatruth.errors import BadInput
from seatruth.models import load_model
from seatruth.readers import Log, Table
from seatruth.sample import FOLDER
from seatruth.study import Study, load_study
from seatruth.study.template import template
from seatruth.trials import check_trials

SPEED, TOWARDS = 0.08, math.radians(70.0)
"""The current of the embedded sample (truth.json)."""
AXES = 'u = { unit = "m/s" }\nv = { unit = "m/s" }'
NOISE = 'u = "0.01 m/s"\nv = "0.01 m/s"'


def sample(name: str) -> pd.DataFrame:
    frame = pd.read_csv(FOLDER / name, comment="#")
    return frame.rename(columns=lambda title: title.partition(" ")[0])


def through_water(d: pd.DataFrame) -> pd.DataFrame:
    """The sample's trial as a log of speeds through the water would have recorded it."""
    psi, north, east = np.radians(d["psi"]), SPEED * math.cos(TOWARDS), SPEED * math.sin(TOWARDS)
    along, across = north * np.cos(psi) + east * np.sin(psi), east * np.cos(psi) - north * np.sin(psi)
    return d.assign(STW=d["u"] - along, across=d["v"] - across).drop(columns=["u", "v"])


def over_ground(d: pd.DataFrame) -> pd.DataFrame:
    """The sample's trial with course and speed over ground in place of speeds in body axes."""
    course = np.degrees(np.radians(d["psi"]) + np.arctan2(d["v"], d["u"])) % 360.0
    return d.assign(SOG=np.hypot(d["u"], d["v"]), COG=course).drop(columns=["u", "v"])


WATER = (through_water, 'u_w = "STW"\nv_w = "across"', 'u_w = "0.01 m/s"\nv_w = "0.01 m/s"')
# The noise of u and v seen across the track, at the sample's slowest speed of 0.5 m/s.
GROUND = (over_ground, 'sog = "SOG"\ncog = { column = "COG", unit = "deg" }', 'sog = "0.01 m/s"\ncog = "1 deg"')


def study_file(folder: Path, case: Any, *, file: str = "diagnose.toml", trials: str = "*", **changes: str) -> Path:
    turned, channels, noise = case
    for path in FOLDER.glob(f"{trials}.csv"):
        turned(sample(path.name)).to_csv(folder / path.name, index=False)
    text = (FOLDER / file).read_text().replace(AXES, channels).replace(NOISE, noise)
    for old, new in changes.items():
        text = text.replace(old, new)
    target = folder / file
    target.write_text(text)
    return target


def short(folder: Path, channels: str, *, more: str = "", log: str = "", effects: str = "[]") -> Study:
    """A study of one short trial whose log has all speeds."""
    t = np.arange(0.0, 5.0, 0.5)
    flat = {name: np.full(t.size, value) for name, value in {"delta": 0.1, "n": 12.0, "psi": 6.2, "SOG": 1.2}.items()}
    frame = pd.DataFrame(
        {"t": t, **flat, "x": 1.2 * t, "y": 0.0 * t, "r": 0.0 * t, "COG": 2.0 + 0.0 * t, "u": 1.2, "v": 0}
    )
    frame.to_csv(folder / "run.csv", index=False)
    (folder / "s.toml").write_text(
        f'[model]\nuse = "mmg"\nvary = ["Y_v"]\neffects = {effects}\n[channels]\n{channels}\n'
        f'[[trials]]\nfile = "run.csv"\n{log}\n{more}'
    )
    return load_study(folder / "s.toml")


@pytest.mark.parametrize("case", [WATER, GROUND], ids=["water", "ground"])
def test_the_current_is_found_in_what_the_instruments_show(case: Any, tmp_path: Path) -> None:
    """Only the current is free, and one trial: the whole study is in the slow test below."""
    path = study_file(tmp_path, case, file="study.toml", trials="turning_circle_35")
    text = path.read_text()
    head, _, rest = text.partition("[[trials]]")
    rest = rest[rest.index("# The compass") :]
    head = (
        head[: head.index("vary = ")] + 'vary = ["current_*", "Y_v", "N_v", "R_0"]\n' + head[head.index("[channels]") :]
    )
    path.write_text(head + '[[trials]]\nfile = "turning_circle_35.csv"\n' + rest)
    study = load_study(path)
    assert [channel.name for channel in study.model.outputs][-2:] == (
        ["u_w", "v_w"] if case is WATER else ["sog", "cog"]
    )
    found = identify(study).parameters.loc[["current_north", "current_east"], "value"].to_numpy(dtype=float)
    assert math.hypot(*found) == pytest.approx(SPEED, abs=0.005)


WRONG = (through_water, 'u = "STW"\nv = "across"', NOISE)
"""The same log of speeds through the water, taken for speeds over ground."""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("case", "right"), [(WATER, True), (GROUND, True), (WRONG, False)], ids=["water", "ground", "-"]
)
def test_the_demo_returns_the_current_within_two_standard_errors(case: Any, right: bool, tmp_path: Path) -> None:
    estimate = identify(load_study(study_file(tmp_path, case, file="study.toml")))
    names = ["current_north", "current_east"]
    values = estimate.parameters.loc[names, "value"].to_numpy(dtype=float)
    towards = values / math.hypot(*values)
    error = math.sqrt(towards @ estimate.covariance.loc[names, names].to_numpy() @ towards)
    off = abs(math.hypot(*values) - SPEED) / error
    assert off < 2.0 if right else off > 3.0


@pytest.mark.slow
@pytest.mark.parametrize("case", [WATER, GROUND], ids=["water", "ground"])
def test_the_diagnosis_returns_the_current(case: Any, tmp_path: Path) -> None:
    found = diagnose(load_study(study_file(tmp_path, case)))
    assert found.named == ("current",)
    north, east = found.effect("current").parameters
    assert math.hypot(north.value, east.value) == pytest.approx(SPEED, abs=2.0 * max(north.stderr, east.stderr))


def test_courses_follow_the_heading_and_leave_it_on_record(tmp_path: Path) -> None:
    for more in ('sog = "SOG"\n', ""):
        trial = short(tmp_path, more + 'cog = { column = "COG", unit = "rad" }').trials[0]
        assert trial.outputs["cog"][0] == pytest.approx(2.0 + 2.0 * math.pi)
        assert [step.name for step in trial.steps] == ["follow_heading", *(["ground_velocity"] if more else [])]
        assert trial.steps[0].effect.startswith("turned by whole turns 10 of cog")


def test_a_course_follows_a_compass_of_0_to_360_degrees(tmp_path: Path) -> None:
    """No step is asked for: the heading is unwrapped, and both are on record."""
    t = np.arange(0.0, 5.0, 0.5)
    heading, course = np.radians(350.0 + 4.0 * np.arange(t.size)), np.radians(340.0 + 4.0 * np.arange(t.size))
    frame = pd.DataFrame({"t": t, "delta": 0.1, "n": 12.0, "x": 1.2 * t, "y": 0.0 * t, "r": 0.14})
    frame.assign(psi=heading % (2.0 * np.pi), COG=course % (2.0 * np.pi)).to_csv(tmp_path / "run.csv", index=False)
    (tmp_path / "s.toml").write_text(
        '[model]\nuse = "mmg"\nvary = ["Y_v"]\n[channels]\ncog = { column = "COG", unit = "rad" }\n'
        '[[trials]]\nfile = "run.csv"\n'
    )
    trial = load_study(tmp_path / "s.toml").trials[0]
    assert [step.name for step in trial.steps] == ["unwrap", "follow_heading"]
    assert trial.outputs["psi"] == pytest.approx(heading)
    assert trial.outputs["cog"] == pytest.approx(course)


COURSE = 'sog = "SOG"\ncog = { column = "COG", unit = "rad" }'


HELD = COURSE + '\ndelta = { unit = "rad", hold = "foh" }'


NAMED = 'gps = { column = "SOG", measures = "sog" }\n' + COURSE.split("\n")[1]


@pytest.mark.parametrize("channels", [COURSE, HELD, NAMED])
def test_speed_and_course_over_ground_are_compared_as_a_velocity(tmp_path: Path, channels: str) -> None:
    """The noise of a course grows as a vehicle slows, and where it stops its course is any number."""
    study = short(tmp_path, channels)
    assert [channel.name for channel in study.model.outputs] == ["x", "y", "psi", "r", "v_n", "v_e"]
    shown, speed = study.trials[0].outputs, 1.2
    assert shown["v_n"][0] == pytest.approx(speed * math.cos(2.0))
    assert shown["v_e"][0] == pytest.approx(speed * math.sin(2.0))
    assert shown["cog"][0] == pytest.approx(2.0 + 2.0 * math.pi)  # for the checks of the log


@pytest.mark.parametrize(
    ("channels", "more"),
    [
        (COURSE, '[noise]\ncog = "1 deg"'),
        (COURSE.replace(" }", ', invalid_where = "SOG < 1" }'), ""),
        ("sog = { at = [9.0, 0.0, 0.0], column = 'SOG' }\n" + COURSE.split("\n")[1], ""),
    ],
)
def test_speed_and_course_stay_where_the_study_says_more_of_one(tmp_path: Path, channels: str, more: str) -> None:
    outputs = [channel.name for channel in short(tmp_path, channels, more=more).model.outputs]
    assert outputs == ["x", "y", "psi", "r", "sog", "cog"]


@pytest.mark.parametrize(
    ("stated", "noise"),
    [
        ('sog = "0.05 m/s"', {"v_n": 0.05, "v_e": 0.05}),
        ('sog = "estimate"', {"v_n": "estimate", "v_e": "estimate"}),
        ('sog = "0.05 m/s"\nv_e = "0.1 m/s"', {"v_n": 0.05, "v_e": 0.1}),
    ],
)
def test_the_noise_of_a_speed_over_ground_is_that_of_the_velocity(
    tmp_path: Path, stated: str, noise: dict[str, Any]
) -> None:
    study = short(tmp_path, COURSE, more=f"[noise]\n{stated}")
    assert {name: study.noise[name] for name in ("v_n", "v_e")} == noise
    assert "sog" not in study.noise


def test_why_there_is_no_velocity_to_state_a_noise_of(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="A noise of 'cog' keeps speed and course as they are"):
        short(tmp_path, COURSE, more='[noise]\nsog = "0.1 kn"\ncog = "1 deg"\nv_e = "0.05 m/s"')


def test_speeds_over_ground_stay_where_the_study_names_them(tmp_path: Path) -> None:
    study = short(tmp_path, 'u_w = "SOG"\nu = "u"')
    assert [channel.name for channel in study.model.outputs] == ["x", "y", "psi", "u", "v", "r", "u_w"]
    study = short(tmp_path, 'u_w = "SOG"')
    assert [channel.name for channel in study.model.outputs] == ["x", "y", "psi", "v", "r", "u_w"]
    assert "u" not in study.trials[0].outputs
    said = short(tmp_path, 'u_w = "SOG"', log='without = ["u", "v"]')
    assert "u" not in said.trials[0].outputs
    # What the study says is not there is not missed.
    assert "channel-missing" not in {finding.code for finding in check_trials(said.trials, said.model)}


def test_a_channel_of_any_name_says_what_it_measures(tmp_path: Path) -> None:
    study = short(tmp_path, 'gps = { column = "SOG", unit = "kn", measures = "sog", at = [10.0, 0.0, -5.0] }')
    output = study.model.outputs[-1]
    assert (output.name, output.unit) == ("gps", "m/s")
    assert output.description == "speed over ground, at [10, 0, -5] m"
    assert study.trials[0].outputs["gps"][0] == pytest.approx(1.2 * 1852.0 / 3600.0)


def test_an_antenna_away_from_the_origin(tmp_path: Path) -> None:
    study = short(tmp_path, "x = { at = [10.0, 0.0, 0.0] }\ny = { at = [10.0, 0.0, 0.0] }")
    frame = study.simulate()["run"]
    assert frame["x"].iloc[0] == pytest.approx(0.0, abs=1e-9)
    assert (frame["x"].iloc[-1], frame["y"].iloc[-1]) != (0.0, 0.0)


FIXES = 'latitude = { column = "Lat"%s }\nlongitude = { column = "Lon"%s }'
AT = ", at = [2.0, 0.5, -1.0]"


def fixes(folder: Path, latitude: str, longitude: str = "", more: str = "") -> Study:
    """A study whose log has the positions of an antenna in degrees, and the velocity of the same receiver."""
    study = short(folder, "")
    turn = np.linspace(6.2, 7.0, len(study.trials[0]))
    frame = pd.read_csv(folder / "run.csv").drop(columns=["x", "y"])
    frame.assign(psi=turn, Lat=54.0 + 1e-6 * frame["t"], Lon=7.0).to_csv(folder / "run.csv", index=False)
    text = (folder / "s.toml").read_text()
    channels = FIXES % (latitude, longitude)
    (folder / "s.toml").write_text(text.replace("[channels]", f"[channels]\n{channels}\n{more}"))
    return load_study(folder / "s.toml")


@pytest.mark.parametrize(("latitude", "longitude"), [(AT, ""), ("", AT), (AT, AT)])
def test_an_antenna_of_latitude_and_longitude_away_from_the_origin(
    latitude: str, longitude: str, tmp_path: Path
) -> None:
    """As `x = { at = ... }` does: the model shows the antenna, and the log's positions are not moved."""
    speed = f'sog = {{ column = "SOG"{AT} }}\ncog = {{ column = "COG", unit = "rad"{AT} }}'
    study = fixes(tmp_path, latitude, longitude, speed)
    said = {channel.name: channel.description for channel in study.model.outputs}
    assert [*said] == ["x", "y", "psi", "r", "v_n", "v_e"]
    assert all(said[name].endswith(", at [2, 0.5, -1] m") for name in ("x", "y", "v_n", "v_e"))
    assert study.trials[0].outputs["x"][0] == 0.0  # the antenna is where its first fix is
    shown = study.simulate()["run"]
    (tmp_path / "other").mkdir()
    stated = "x = { at = [2.0, 0.5, -1.0] }\ny = { at = [2.0, 0.5, -1.0] }"
    short(tmp_path / "other", stated)
    log = {**study.trials[0].inputs, **study.trials[0].outputs, "SOG": 1.2, "COG": 2.0}
    pd.DataFrame({"t": study.trials[0].t, **log}).to_csv(tmp_path / "other" / "run.csv", index=False)
    (tmp_path / "other" / "s.toml").write_text(
        (tmp_path / "other" / "s.toml").read_text().replace(stated, f"{stated}\n{speed}")
    )
    pd.testing.assert_frame_equal(load_study(tmp_path / "other" / "s.toml").simulate()["run"], shown)


@pytest.mark.parametrize(
    ("latitude", "longitude", "more", "said"),
    [
        (AT, ", at = [1.0, 0.0, 0.0]", "", r"line 6, \[channels\] latitude.at: latitude and longitude have different"),
        (AT, "", "x = { at = [2.0, 0.5, -1.0] }", r"line 8.*'x' is made of latitude and longitude. Remove 'x'"),
        ("", ', measures = "y"', "", r"line 7, \[channels\] longitude.measures: 'longitude' is read as x and y"),
        (AT, "", f'psi = {{ column = "psi"{AT} }}', r"line 8.*what 'psi' measures does not depend on the place"),
    ],
)
def test_wrong_places_of_an_antenna_are_named(
    latitude: str, longitude: str, more: str, said: str, tmp_path: Path
) -> None:
    with pytest.raises(BadInput, match=said):
        fixes(tmp_path, latitude, longitude, more)


@pytest.mark.parametrize(
    ("channels", "log", "said"),
    [
        ('w_w = "SOG"', "", r"line 6.*the model has no 'w'"),
        ('log = { column = "SOG", measures = "speed" }', "", r"line 6.*no measure 'speed'"),
        ('log = { column = "SOG" }', "", r"line 6.*unknown channel 'log'"),
        ("sog = { at = [1.0, 2.0] }", "", r"line 6.*a list of 3"),
        ('delta = { measures = "sog" }', "", r"line 6.*input of the model"),
        ('sog = "SOG"', "channels = { sog = { at = [1.0, 0.0, 0.0] } }", r"line 9.*'at' holds for all trials"),
    ],
)
def test_wrong_channels_are_named_with_their_line(channels: str, log: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=said):
        short(tmp_path, channels, log=log)


def test_a_fixed_start_is_refused_where_a_current_parts_water_from_ground(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match='Set initial = "free"'):
        short(tmp_path, 'u_w = "SOG"', effects='["current"]')
    assert short(tmp_path, 'u_w = "SOG"', effects='["current"]', more='[cost]\ninitial = "free"')
    assert short(tmp_path, 'u_w = "SOG"\nu = "u"', effects='["current"]')


def test_positions_headings_and_clocks_of_a_study(tmp_path: Path) -> None:
    """Two trials share the origin of the first; the frames and clocks of the study hold for both."""
    t = np.arange(6.0)
    text = """[model]
use = "mmg"
vary = ["Y_v"]
[time]
column = "when"
dates = "day-first"
[frames]
body = "FLU"
[channels]
latitude = "Lat"
longitude = "Lon"
psi = { column = "HDG", unit = "deg", declination = "3.5 deg" }
r = { column = "gyro", time = "clock" }
"""
    for k, name in enumerate("ab"):
        frame = pd.DataFrame(
            {"when": [f"03.07.2025 12:0{k}:0{i}" for i in range(6)], "delta": 0.1, "n": 10.0, "HDG": 90.0}
        )
        frame = frame.assign(Lat=54.0 + 0.001 * k, Lon=7.0 + 1e-5 * t, u=1.0, v=0.0, gyro=0.01)
        frame["clock"] = [f"03.07.2025 12:0{k}:0{i}.25" for i in range(6)]
        frame.to_csv(tmp_path / f"{name}.csv", index=False)
        text += f'[[trials]]\nfile = "{name}.csv"\n'
    (tmp_path / "s.toml").write_text(text)
    first, second = load_study(tmp_path / "s.toml").trials
    assert first.conditions["origin"] == second.conditions["origin"] == [54.0, 7.0]
    assert np.nanmin(second.outputs["x"]) == pytest.approx(111.3, abs=0.1)
    assert first.outputs["psi"][0] == pytest.approx(math.radians(93.5))
    assert first.outputs["r"][first.t == 0.25] == -0.01
    assert len(first) == 11  # the last gyro's sample comes after the last of the rudder
    (tmp_path / "s.toml").write_text(text.replace('"3.5 deg"', '"east"'))
    with pytest.raises(BadInput, match="is no number with a unit"):
        load_study(tmp_path / "s.toml")
    (tmp_path / "s.toml").write_text(text.replace('body = "FLU"', 'utm = "32S"'))
    with pytest.raises(BadInput, match=r"\[frames\].*is no UTM zone"):
        load_study(tmp_path / "s.toml")


def proposed(frame: pd.DataFrame, units: dict[str, str] | None = None) -> tuple[str, list[str]]:
    table = Table("log.csv", {str(name): frame[name] for name in frame.columns}, units or {})
    return template("log.csv", Log("log.csv", {"": table}), load_model("mmg"), "mmg")


def test_init_says_what_it_took_each_column_for(tmp_path: Path) -> None:
    t = np.arange(30.0)
    frame = pd.DataFrame(
        {
            "Timestamp": 1753967661000000.0 + 1e6 * t,
            **{"Lat": 54.0 + 1e-5 * t, "Lon": 7.9 + 0.0 * t, "HDG": 80.0 + t, "ROT": 1.0 + 0.1 * t},
            **{"SOG": 12.0 + 0.1 * t, "COG": 82.0 + t, "STW": 11.0 + 0.1 * t, "rudder": t - 15.0, "rpm": 90.0 + t},
        }
    )
    text, notes = proposed(frame)
    (said,) = notes
    assert "too fast for the ship of 7 m" in said
    for line in (
        'unit = "us"   # time read as us since 1970, from 2025-07-31T13:14:21+00:00 on\n',
        'latitude = { column = "Lat", unit = "deg" }   # x and y, from the first fix on; at = [forward, starboard, ',
        "assumed; the header has no unit; velocity through the water, forward",
        "speed over ground",
        "course over ground",
    ):
        assert line in text
    assert "u = {" not in text
    assert "without" not in text
    frame.to_csv(tmp_path / "log.csv", index=False)
    (tmp_path / "s.toml").write_text(text)
    study = load_study(tmp_path / "s.toml")
    assert [channel.name for channel in study.model.outputs] == ["x", "y", "psi", "r", "u_w", "v_n", "v_e"]


def test_init_asks_where_a_column_can_mean_two_things() -> None:
    t = np.arange(30.0)
    frame = pd.DataFrame(
        {"time": [f"03.07.2025 12:00:{k:02d}" for k in range(30)], "speed": 5.0 + t, "rudder": t, "rpm": t}
    )
    text, notes = proposed(frame)
    assert any(note.startswith("Time: the date 03.07.2025 can be 3 Jul 2025 or 7 Mar 2025") for note in notes)
    assert any("'speed' was taken for 'u', the speed over ground along the bow" in note for note in notes)
    assert "# the date 03.07.2025 can be" in text
    text, notes = proposed(frame.assign(time=100.0 * t))
    assert any("can be 100 s (in s) or 0.1 s (in ms)" in note for note in notes)
    assert 'unit = "ms"   # guessed' in text
