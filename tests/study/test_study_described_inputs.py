"""Columns of inputs that the model's words tell."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pytest

from seatruth.models import Channel, Model, load_model
from seatruth.readers import Log, Table
from seatruth.study.described_inputs import described_inputs
from seatruth.study.template import template

WAVE = np.sin(np.linspace(0.0, 20.0, 200))


class Boat(Model):
    """A boat whose inputs have names and words of its own."""

    name = "boat"
    states = outputs = (Channel("u", "m/s"), Channel("r", "rad/s"))
    inputs = (
        Channel("delta", "rad", "steering angle of the outboard, positive turns to starboard"),
        Channel("c", "1", "throttle"),
        Channel("tabs", "rad", "angle of the trim tabs (down)"),
    )

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return i.c - s.u, i.delta - s.r


@pytest.mark.parametrize(
    ("header", "name", "unit"),
    [
        ("Steer_deg", "delta", "deg"),
        ("Steer", "delta", "deg"),
        ("Outboard angle [deg]", "delta", "deg"),
        ("Tiller_fb_deg", "delta", "deg"),
        ("drive.steer_actual_deg", "delta", "deg"),
        ("Throttle_pct", "c", "percent"),
        ("Throttle", "c", "percent"),
        ("Engine load [%]", "c", "%"),
        ("trim_tabs_deg", "tabs", "deg"),
    ],
)
def test_a_column_is_taken_by_the_words_of_the_model(header: str, name: str, unit: str) -> None:
    found = described_inputs({header: 20.0 * WAVE}, Boat.inputs, Boat()).found
    assert {key: (hit.column, hit.unit) for key, hit in found.items()} == {name: (header, unit)}


@pytest.mark.parametrize(
    ("header", "most", "unit"), [("CPP_PITCH_pct", 96.0, "percent"), ("PITCH", 96.0, "percent"), ("PITCH", 0.9, "1")]
)
def test_the_pitch_of_a_propeller_is_no_angle(header: str, most: float, unit: str) -> None:
    """Numbers beyond 10 are per cent, where the model's 1 is full ahead."""
    pitch = Channel("pitch", "1", "propeller pitch, 1 = full ahead")
    found = described_inputs({header: most * WAVE}, [pitch], Boat()).found
    assert {key: (hit.column, hit.unit) for key, hit in found.items()} == {"pitch": (header, unit)}


@pytest.mark.parametrize(
    "header",
    ["Engine_temp_C", "steering_motor_current_A", "Starboard_deg", "speed", "angle", "Throttle_port_pct", "steer_pct"],
)
def test_words_of_something_else_are_left_alone(header: str) -> None:
    assert described_inputs({header: 20.0 * WAVE}, Boat.inputs, Boat()).found == {}


def test_an_angle_is_no_command() -> None:
    assert described_inputs({"Throttle_deg": 20.0 * WAVE}, Boat.inputs, Boat()).found == {}


def test_what_acted_goes_before_an_order_and_two_columns_are_a_question() -> None:
    log = {"steer_cmd_deg": WAVE, "steer_deg": WAVE}
    hit = described_inputs(log, Boat.inputs, Boat()).found["delta"]
    assert (hit.column, hit.order) == ("steer_deg", False)
    assert described_inputs({"steer_cmd_deg": WAVE}, Boat.inputs, Boat()).found["delta"].order
    both = described_inputs({"wheel_deg": WAVE, "tiller_deg": WAVE}, Boat.inputs, Boat())
    assert both.found == {}
    assert both.notes(Boat.inputs) == ["The columns 'wheel_deg' and 'tiller_deg' may all be meant for 'delta'."]


def test_sides_tell_drives_and_a_share_is_no_speed_of_revolution() -> None:
    ship = load_model("twin_thruster")
    log = {"Engine_stbd_rpm": WAVE, "Engine_port_rpm": WAVE}
    found = described_inputs(log, ship.inputs, ship).found
    assert {name: hit.column for name, hit in found.items()} == {
        "n_port": "Engine_port_rpm",
        "n_starboard": "Engine_stbd_rpm",
    }
    shares = described_inputs({"Throttle_port": 50.0 * WAVE}, ship.inputs, ship)
    assert shares.found == {}
    assert "'Throttle_port' may be meant for 'n_port', which the model takes in rev/s" in shares.notes(ship.inputs)[0]


@pytest.mark.parametrize(
    "names", [("RudderFb P [deg]", "RudderFb S [deg]"), ("Rudder P", "Rudder S"), ("FIN_P", "FIN_S")]
)
def test_sides_may_be_letters_where_a_model_has_both(names: tuple[str, str]) -> None:
    """S for starboard is no unit: of a ferry with two rudders neither "RudderFb P" nor "RudderFb S" was recognised."""
    both = [
        Channel(f"d_{side[0]}", "rad", f"{side} rudder or fin, positive to starboard") for side in ("port", "starboard")
    ]
    found = described_inputs(dict.fromkeys(names, 20.0 * WAVE), both, Boat()).found
    assert {name: hit.column for name, hit in found.items()} == dict(zip(("d_p", "d_s"), names, strict=True))


@pytest.mark.parametrize("header", ["", "---", "[deg]", "°", "S", "s"])
def test_a_header_without_a_word_is_no_input(header: str) -> None:
    both = [Channel(f"d_{side[0]}", "rad", f"{side} rudder") for side in ("port", "starboard")]
    assert described_inputs({header: 20.0 * WAVE}, both, Boat()).found == {}


def test_a_part_of_full_speed_is_told_its_scale() -> None:
    ship = load_model("twin_thruster")
    (note, *_) = described_inputs({"Thr_Port_pct": 50.0 * WAVE}, ship.inputs, ship).notes(ship.inputs)
    assert 'n_port = { column = "Thr_Port_pct", unit = "rev/s", scale = 0.2 }' in note  # 100 % of 1200 rpm is 20 rev/s


def test_init_takes_it_and_asks_for_the_rest() -> None:
    columns = {"t": np.arange(200.0), "Steer_deg": 20.0 * WAVE, "Throttle_pct": 50.0 + WAVE, "r": WAVE, "u": WAVE}
    table = Table("log.csv", {name: pd.Series(values) for name, values in columns.items()}, {})
    text, notes = template("log.csv", Log("log.csv", {"": table}), load_model("mmg"), "mmg")
    assert 'delta = { column = "Steer_deg", unit = "deg" }   # unit from the header; taken by its words' in text
    assert notes[:2] == [
        "No column was recognised for the input 'n': name it in [channels], or give it a value, as { value = 0.0 }.",
        "The column 'Throttle_pct' may be meant for 'n', which the model takes in rev/s: that column is not. Where "
        '100 % is 1200 rpm, write n = { column = "Throttle_pct", unit = "rev/s", scale = 0.2 }; or '
        "name another column.",
    ]
    taken, _ = template("log.csv", Log("log.csv", {"": table}), Boat(), "boat.py:Boat")
    assert 'c = { column = "Throttle_pct", unit = "percent" }' in taken


class Glider(Boat):
    """A glider whose inputs are told by their words."""

    name = "glider"
    inputs = (
        Channel("V_b", "m3", "pumped oil volume, positive makes the vehicle lighter"),
        Channel("x_b", "m", "battery position forward of its neutral place"),
    )


@pytest.mark.parametrize(
    ("header", "name", "unit", "order"),
    [
        ("oil_volume_cc", "V_b", "cc", False),
        ("ballast_meas_cc", "V_b", "cc", False),
        ("m_ballast_pumped [cc]", "V_b", "cc", False),
        ("vbdCC", "V_b", "cc", False),
        ("c_ballast_pumped [cc]", "V_b", "cc", True),
        ("battery_position_in", "x_b", "in", False),
        ("batt_cmd_in", "x_b", "in", True),
        ("m_battpos [in]", "x_b", "in", False),
    ],
)
def test_oil_and_battery_of_a_glider_are_known(header: str, name: str, unit: str, order: bool) -> None:
    found = described_inputs({header: WAVE}, Glider.inputs, Glider()).found
    assert {key: (hit.column, hit.unit, hit.order) for key, hit in found.items()} == {name: (header, unit, order)}


@pytest.mark.parametrize(
    "header", ["battery", "Battery_V", "batt_current_A", "battery_pct", "oil_temperature", "m_vacuum"]
)
def test_the_supply_is_no_position(header: str) -> None:
    assert described_inputs({header: WAVE}, Glider.inputs, Glider()).found == {}


def test_an_input_s_own_name_tells_its_column_among_pulses() -> None:
    """Thrusters of an ROV that nobody calls by name; what else a column says is another thing."""
    inputs = [Channel(name, "us") for name in ("fp", "as_", "a")]
    columns = {name: np.array([1500.0, 1700.0]) for name in ("pwm_fp_us", "servo_as_us", "pwm_a_us", "temp_fp_us")}
    found = described_inputs(columns, inputs, load_model("mmg")).found
    assert {name: (hit.column, hit.unit) for name, hit in found.items()} == {
        "fp": ("pwm_fp_us", "us"), "as_": ("servo_as_us", "us"),
    }  # fmt: skip
