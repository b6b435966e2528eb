"""Positions, headings and axes as logs give them, in seatruth's axes."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation

from seatruth.errors import BadInput
from seatruth.trials import ColumnSpec, Frames, Trial, read_trial
from seatruth.trials.frames import with_origin

N = 6
ORIGIN = (52.1, 4.2)
EAST = np.linspace(0.0, 500.0, N)
NORTH = np.linspace(0.0, 300.0, N)
# Radii of curvature of WGS-84 at 52.1 deg north, from its axis and flattening: an independent formula for short ways.
_A, _F = 6378137.0, 1.0 / 298.257223563
_S = 1.0 - (2.0 - _F) * _F * math.sin(math.radians(ORIGIN[0])) ** 2
LATITUDE = ORIGIN[0] + np.degrees(NORTH / (_A * (1.0 - _F) ** 2 / _S**1.5))
LONGITUDE = ORIGIN[1] + np.degrees(EAST / (_A / math.sqrt(_S) * math.cos(math.radians(ORIGIN[0]))))


def read(folder: Path, columns: dict[str, Any], outputs: dict[str, Any], **options: Any) -> Trial:
    frame = pd.DataFrame({"t": np.arange(N, dtype=float), **columns})
    frame.to_csv(folder / "log.csv", index=False)
    return read_trial(folder / "log.csv", inputs={}, outputs=outputs, **options)


PLACES = {"latitude": "Lat", "longitude": "Lon"}
FIXES = {"Lat": LATITUDE, "Lon": LONGITUDE}


def test_latitude_and_longitude_become_north_and_east_of_an_origin_on_record(tmp_path: Path) -> None:
    trial = read(tmp_path, FIXES, PLACES)
    assert set(trial.outputs) == {"x", "y"}
    assert trial.outputs["x"] == pytest.approx(NORTH, abs=0.05)
    assert trial.outputs["y"] == pytest.approx(EAST, abs=0.05)
    assert trial.conditions["origin"] == pytest.approx(list(ORIGIN))
    step = trial.steps[-1]
    assert step.name == "position"
    assert "52.1000000, 4.2000000 (WGS-84, tangent plane)" in step.effect
    assert "turns by up to 0.0058 deg" in step.effect


def test_an_origin_can_be_stated_and_is_shared(tmp_path: Path) -> None:
    trial = read(tmp_path, FIXES, PLACES, frames=Frames(origin=(52.0, 4.2)))
    assert trial.outputs["x"][0] == pytest.approx(11126.0, abs=3.0)
    later = with_origin(Frames(), trial)
    assert later.origin == (52.0, 4.2)
    assert with_origin(later, read(tmp_path, FIXES, PLACES)).origin == (52.0, 4.2)
    assert with_origin(Frames(), Trial("bare", [0.0, 1.0], {}, {})).origin is None


def test_nmea_degrees_and_minutes(tmp_path: Path) -> None:
    nmea = {name: np.floor(values) * 100.0 + values % 1.0 * 60.0 for name, values in FIXES.items()}
    places = {name: ColumnSpec(column, unit="ddmm") for name, column in PLACES.items()}
    assert read(tmp_path, nmea, places).outputs["y"] == pytest.approx(EAST, abs=0.05)
    with pytest.raises(BadInput, match=r'lines 2-7.*are no degrees.*"ddmm"'):
        read(tmp_path, nmea, PLACES)


def test_utm_is_turned_from_grid_north_to_true_north(tmp_path: Path) -> None:
    """Points on the meridian of the origin have one easting in no zone but in its middle."""
    import utm

    easting, northing, number, _ = utm.from_latlon(LATITUDE, LONGITUDE)
    trial = read(
        tmp_path,
        {"E": easting, "N": northing},
        {"easting": "E", "northing": "N"},
        frames=Frames(utm=f"{number} north"),
    )
    assert trial.outputs["x"] == pytest.approx(NORTH, abs=0.05)
    assert trial.outputs["y"] == pytest.approx(EAST, abs=0.05)
    assert trial.steps[-1].options["utm"] == "31 north"
    # Grid north is 0.95 deg off there, 9 m in 583 m.
    assert abs(northing[-1] - northing[0] - NORTH[-1]) > 5.0


@pytest.mark.parametrize(
    ("columns", "outputs", "frames", "said"),
    [
        ({"Lat": LATITUDE}, {"latitude": "Lat"}, {}, "longitude is missing"),
        (FIXES, {**PLACES, "x": "Lat"}, {}, "position is given twice"),
        ({"Lat": 0 * EAST, "Lon": 0 * EAST}, PLACES, {}, "without a fix"),
        ({"Lat": LATITUDE + np.array([0] * 5 + [3]), "Lon": LONGITUDE}, PLACES, {}, r"line 7.*more than 50 km"),
        ({"Lat": LONGITUDE, "Lon": LATITUDE}, PLACES, {"origin": ORIGIN}, "stand in each other's place"),
        ({"Lat": np.nan * EAST, "Lon": LONGITUDE}, PLACES, {}, "no sample has a position"),
        ({"E": EAST, "N": NORTH}, {"easting": "E", "northing": "N"}, {}, "need their zone"),
        ({"E": EAST, "N": NORTH}, {"easting": "E", "northing": "N"}, {"utm": "31 north"}, "are no UTM coordinates"),
        ({"x": EAST}, {"x": "x"}, {"earth": "ENU"}, "names only one of x and y"),
    ],
)
def test_positions_that_are_none_are_refused(
    columns: dict[str, Any], outputs: dict[str, str], frames: dict[str, Any], said: str, tmp_path: Path
) -> None:
    with pytest.raises(BadInput, match=said) as problem:
        read(tmp_path, columns, outputs, frames=Frames(**frames))
    assert problem.value.do


def test_frames_that_are_none_are_refused() -> None:
    for zone in ("32S", "61 north", "here"):
        with pytest.raises(BadInput, match="is no UTM zone"):
            Frames(utm=zone)
    with pytest.raises(BadInput, match="is no place"):
        Frames(origin=(95.0, 0.0))


@pytest.mark.parametrize("frames", [Frames(), Frames("ENU", "FLU")], ids=["NED", "ENU"])
def test_one_motion_in_either_axes(frames: Frames, tmp_path: Path) -> None:
    """A log of the same motion in east-north-up and forward-left-up axes, with its attitude as a quaternion."""
    t = np.arange(N)
    phi, theta, psi = 0.1 * np.sin(t), 0.2 * np.cos(t), 1.0 + 0.3 * t
    turn = Rotation.from_euler("ZYX", np.stack([psi, theta, phi], axis=1))
    mirror, swap = np.diag([1.0, -1.0, -1.0]), np.array([[0, 1, 0], [1, 0, 0], [0, 0, -1.0]])
    log = {"x": NORTH, "y": EAST, "z": 1.0 * t, "v": 0.1 * t, "w": 0.2 * t, "q": 0.01 * t, "r": 0.02 * t, "u": 1.0 * t}
    if frames.earth == "ENU":
        turn = Rotation.from_matrix(swap @ turn.as_matrix() @ mirror)
        log |= {name: -values for name, values in log.items() if name in "zvwqr"} | {"x": EAST, "y": NORTH}
    x, y, z, w = turn.as_quat().T
    log |= {"qw": w, "qx": x, "qy": y, "qz": z}
    angles = {name: ColumnSpec(name, quaternion=("qw", "qx", "qy", "qz")) for name in ("phi", "theta", "psi")}
    names = {name: name for name in ("x", "y", "z", "u", "v", "w", "q", "r")}
    found = read(tmp_path, log, {**names, **angles}, frames=frames).outputs
    expected = {"x": NORTH, "y": EAST, "z": t, "u": t, "v": 0.1 * t, "w": 0.2 * t, "q": 0.01 * t, "r": 0.02 * t}
    for name, values in {**expected, "phi": phi, "theta": theta}.items():
        assert found[name] == pytest.approx(values, abs=1e-9), name
    assert np.cos(found["psi"] - psi) == pytest.approx(1.0)


def test_headings_from_cosine_and_sine(tmp_path: Path) -> None:
    psi = np.linspace(-3.0, 3.0, N)
    trial = read(tmp_path, {"c": 2 * np.cos(psi), "s": 2 * np.sin(psi)}, {"psi": ColumnSpec("", vector=("c", "s"))})
    assert trial.outputs["psi"] == pytest.approx(psi)
    assert trial.steps[0].effect == "psi: computed from its cosine and sine"


@pytest.mark.parametrize(("frames", "sign"), [(Frames(), 1.0), (Frames("ENU"), 1.0)])
def test_magnetic_headings_become_true(frames: Frames, sign: float, tmp_path: Path) -> None:
    written = 1.0 if frames.earth == "NED" else math.pi / 2 - 1.0
    trial = read(
        tmp_path, {"h": np.full(N, written)}, {"psi": ColumnSpec("h", declination=math.radians(3.5))}, frames=frames
    )
    assert trial.outputs["psi"] == pytest.approx(1.0 + sign * math.radians(3.5))
    assert "declination of +3.5 deg" in trial.steps[0].effect


@pytest.mark.parametrize(
    ("columns", "spec", "said"),
    [
        ({"c": 0 * EAST, "s": 0 * EAST}, {"psi": ColumnSpec("", vector=("c", "s"))}, r"lines 2-7.*no direction"),
        ({"c": 1, "s": 0}, {"psi": ColumnSpec("", unit="deg", vector=("c", "s"))}, "has a unit beside"),
        ({"a": 3.0}, {"psi": ColumnSpec("", quaternion=("a", "a", "a", "a"))}, "length of the first is 6"),
        ({"a": 0.5}, {"r": ColumnSpec("", quaternion=("a", "a", "a", "a"))}, "not 'r'"),
        ({"c": 1}, {"psi": ColumnSpec("", vector=("c", "sin"))}, "no column 'sin'"),
    ],
)
def test_attitudes_that_are_none_are_refused(
    columns: dict[str, Any], spec: dict[str, ColumnSpec], said: str, tmp_path: Path
) -> None:
    with pytest.raises(BadInput, match=said):
        read(tmp_path, columns, spec)
