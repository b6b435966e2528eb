"""The column of the pressure that a depth cell recorded."""

from __future__ import annotations

import tomllib

import numpy as np
import pandas as pd
import pytest

from seatruth.models import load_model
from seatruth.readers import Log, Table
from seatruth.study.fields import Fields
from seatruth.study.pressure_columns import pressure_of_depth
from seatruth.study.template import template

DIVE = np.linspace(2.0, 30.0, 50)


def log(**columns: np.ndarray) -> Log:
    return Log("log.csv", {"": Table("log.csv", {name: pd.Series(values) for name, values in columns.items()}, {})})


@pytest.mark.parametrize(
    ("header", "unit"),
    [
        ("press_dbar", "dbar"),
        ("pressure [dbar]", "dbar"),
        ("CTD Pressure (dbar)", "dbar"),
        ("pressure_kPa", "kPa"),
        ("m_pressure", "bar"),
        ("sci_water_pressure", "bar"),
        ("/depth_cell.fluid_pressure [Pa]", "Pa"),
    ],
)
def test_a_pressure_of_the_water_is_known_with_its_unit(header: str, unit: str) -> None:
    hit = pressure_of_depth(Fields(log(**{header: DIVE})), "z").found
    assert hit is not None
    assert (hit.channel, hit.column, hit.unit, hit.turned) == ("z", header, unit, "")


@pytest.mark.parametrize("header", ["hull_pressure_bar", "vacuum [mbar]", "oil_pressure_bar", "pressure_rate_dbar"])
def test_other_pressures_are_left_alone(header: str) -> None:
    assert pressure_of_depth(Fields(log(**{header: DIVE})), "z") == (None, ())


def test_the_weather_is_no_depth() -> None:
    assert pressure_of_depth(Fields(log(**{"pressure [hPa]": 1013.0 + 0.01 * DIVE})), "z").found is None


def written(**columns: np.ndarray) -> tuple[dict, list[str], str]:
    """What `init` makes of a log of a dive."""
    text, notes = template("log.csv", log(t=np.arange(50.0), **columns), load_model("diving_plane_driven"), "x")
    return tomllib.loads(text)["channels"], notes, text


def test_init_takes_it_for_z_and_says_what_may_be_wrong() -> None:
    channels, notes, text = written(press_dbar=DIVE)
    assert channels["z"] == {"column": "press_dbar", "unit": "dbar"}
    assert "in fresh water add scale = 1.025; if it counts the air's, add offset = -10.08" in text
    assert not any("pressure" in note for note in notes)
    assert written(press_abs_bar=DIVE)[0]["z"] == {"column": "press_abs_bar", "unit": "bar", "offset": -10.08}


def test_a_depth_goes_first_and_a_unit_that_is_missing_is_asked_for() -> None:
    assert written(press_dbar=DIVE, depth_m=DIVE)[0]["z"]["column"] == "depth_m"
    channels, notes, _ = written(pressure=DIVE)
    assert "z" not in channels
    assert any('z = { column = "pressure", unit = "dbar" }, or "bar"' in note for note in notes)
