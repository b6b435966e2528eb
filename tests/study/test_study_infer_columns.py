"""Columns of a log taken for channels, with their units."""

from __future__ import annotations

import numpy as np
import pytest

from seatruth.study.infer_columns import infer_columns, split_header
from seatruth.trials import STANDARD_CHANNELS, Channel

WANTED = [Channel("t", "s"), *STANDARD_CHANNELS.values()]
WAVE = np.sin(np.linspace(0.0, 20.0, 200))


@pytest.mark.parametrize(
    ("header", "name", "unit"),
    [
        ("yaw rate [deg/s]", "yaw rate", "deg/s"),
        ("Time(s)", "time", "s"),
        ("rudder_deg", "rudder", "deg"),
        ("yawRate_deg_s", "yaw rate", "deg/s"),
        ("speed, kn", "speed", "kn"),
        ("ROT_deg/min", "rot", "deg/min"),
        ("u_m/s", "u", "m/s"),
        ("u", "u", ""),
        ("Heading (true)", "heading true", ""),
        ("", "", ""),
    ],
)
def test_headers_split_into_name_and_unit(header: str, name: str, unit: str) -> None:
    assert split_header(header) == (name, unit)


@pytest.mark.parametrize(
    ("header", "numbers", "channel", "unit"),
    [
        ("rudder_deg", 20 * WAVE, "delta", "deg"),
        ("rudder", 20 * WAVE, "delta", "deg"),
        ("rudder", 0.3 * WAVE, "delta", "rad"),
        ("yaw rate [deg/s]", 2 * WAVE, "r", "deg/s"),
        ("r", 0.02 * WAVE, "r", "rad/s"),
        ("ROT", 40 * WAVE, "r", "deg/min"),
        ("RateOfTurn", 0.5 * WAVE, "r", "deg/min"),
        ("rot_dps", 2 * WAVE, "r", "deg/s"),
        ("Heading", 180 + 100 * WAVE, "psi", "deg"),
        ("psi", 3 * WAVE, "psi", "rad"),
        ("ship speed (kn)", 12 + WAVE, "u", "kn"),
        ("SOG (kn)", 12 + WAVE, "sog", "kn"),
        ("STW", 22 + WAVE, "u_w", "kn"),
        ("COG", 180 + 100 * WAVE, "cog", "deg"),
        ("velocity_north", WAVE, "v_n", "m/s"),
        ("Lat", 52.0 + WAVE, "latitude", "deg"),
        ("lon", 412.0 + WAVE, "longitude", "ddmm"),
        ("RPM", 90 + WAVE, "n", "rpm"),
        ("n", 12 + WAVE, "n", "rev/s"),
        ("propeller", 95 + WAVE, "n", "rpm"),
        ("t", np.arange(200.0), "t", "s"),
        ("Timestamp", 100 * np.arange(200.0), "t", "ms"),
        ("Elapsed (min)", np.arange(200.0), "t", "min"),
        ("dvl_fwd_cm_s", 20 + WAVE, "u", "cm/s"),
        ("hdg_mag_deg", 180 + WAVE, "psi", "deg"),
        ("speed_kmh", 12 + WAVE, "u", "km/h"),
        ("depth_cm", 300 + WAVE, "depth", "cm"),
        ("acc_x_m_s2", WAVE, "f_x", "m/s^2"),
    ],
)
def test_units_come_from_the_header_or_the_range(header: str, numbers: np.ndarray, channel: str, unit: str) -> None:
    inferred = infer_columns({header: numbers}, WANTED)
    assert {name: hit.unit for name, hit in inferred.items()} == {channel: unit}


@pytest.mark.parametrize(("rudder", "unit"), [(0.6, "rad"), (35.0, "deg")])
def test_a_wound_up_heading_has_the_rudders_unit(rudder: float, unit: str) -> None:
    inferred = infer_columns({"psi": np.linspace(0.0, 13.5, 200), "delta": rudder * WAVE}, WANTED)
    assert inferred["psi"].unit == inferred["delta"].unit == unit


def test_each_column_serves_one_channel_and_the_plain_name_wins() -> None:
    inferred = infer_columns({"speed": WAVE, "u": WAVE, "drift": WAVE, "heading": WAVE, "psi": WAVE}, WANTED)
    assert inferred["u"].column == "u"
    assert inferred["psi"].column == "psi"
    assert len({hit.column for hit in inferred.values()}) == len(inferred) == 2


@pytest.mark.parametrize(
    ("field", "channel"),
    [
        ("vehicle_local_position.x", "x"),
        ("vehicle_local_position.vx", "v_n"),
        ("vehicle_local_position.vz", "v_d"),
        ("vehicle_local_position.heading", "psi"),
        ("vehicle_angular_velocity.xyz[2]", "r"),
        ("sensor_combined[1].gyro_rad[0]", "p"),
        ("vehicle_gps_position.vel_m_s", "sog"),
        ("XKF1[0].PE [m]", "y"),
        ("IMU[1].GyrZ [rad/s]", "r"),
        ("GPS[0].Spd [m/s]", "sog"),
        ("/odom.twist.linear.x", "u"),
    ],
)
def test_fields_of_autopilots_are_what_their_documents_say(field: str, channel: str) -> None:
    assert list(infer_columns({field: WAVE}, WANTED)) == [channel]
    without = [other for other in WANTED if other.name != channel]
    assert infer_columns({field: WAVE}, without) == {}


@pytest.mark.parametrize(("header", "channel"), [("gyro_dps", "r"), ("Gyro [deg]", "psi"), ("gyro", None)])
def test_a_gyro_is_a_compass_or_a_rate_as_its_unit_says(header: str, channel: str | None) -> None:
    found = infer_columns({header: 3.0 * WAVE}, WANTED)
    assert set(found) == ({channel} if channel else set())


def test_a_column_without_numbers_is_no_reason_to_stop() -> None:
    inferred = infer_columns({"rudder": np.full(5, np.nan)}, WANTED)
    assert inferred["delta"].unit == "rad"


@pytest.mark.parametrize(
    ("header", "channel", "unit"),
    [
        ("rudder_cmd_deg", "delta", "deg"),
        ("ordered rudder [deg]", "delta", "deg"),
        ("fin_setpoint_deg", "delta_s", "deg"),
        ("rpm_cmd", "n", "rpm"),
    ],
)
def test_orders_are_taken_for_inputs_and_said_to_be_orders(header: str, channel: str, unit: str) -> None:
    inferred = infer_columns({header: 20 * WAVE}, WANTED, orders=["delta", "delta_s", "n"])
    assert {name: (hit.unit, hit.order, hit.column) for name, hit in inferred.items()} == {
        channel: (unit, True, header)
    }
    assert infer_columns({header: 20 * WAVE}, WANTED) == {}  # a heading that was ordered is no heading


def test_what_an_actuator_did_goes_before_its_order() -> None:
    inferred = infer_columns({"rudder_cmd": WAVE, "steering": WAVE}, WANTED, orders=["delta"])
    assert (inferred["delta"].column, inferred["delta"].order) == ("steering", False)


@pytest.mark.parametrize(
    "headers",
    [
        ["Rudder Order [deg]", "Rudder Feedback [deg]"],
        ["Rudder [deg]", "Rudder Feedback [deg]"],
        ["Rudder Order [deg]", "Rudder Angle Port [deg]"],
        ["rudder_angle_cmd_deg", "measured_rudder_angle_deg"],
        ["Rudder Order SB [deg]", "Rudder actual [deg]"],
    ],
)
def test_the_measured_rudder_goes_before_its_order(headers: list[str]) -> None:
    found = infer_columns(dict.fromkeys(headers, 20 * WAVE), WANTED, orders=["delta", "n"])["delta"]
    assert (found.column, found.unit, found.order) == (headers[1], "deg", False)


@pytest.mark.parametrize(
    ("headers", "channel"),
    [
        (["Rudder Feedback PS [deg]", "Rudder Feedback SB [deg]"], "delta"),
        (["rudder_port_deg", "rudder_stbd_deg"], "delta"),
        (["Shaft Speed PS [rpm]", "Shaft Speed SB [rpm]"], "n"),
        (["RPM left", "RPM right"], "n"),
    ],
)
def test_a_channel_is_the_mean_of_both_sides(headers: list[str], channel: str) -> None:
    found = infer_columns(dict.fromkeys(headers, 20 * WAVE), WANTED)
    assert {name: hit.columns for name, hit in found.items()} == {channel: tuple(headers)}


def test_a_column_of_the_whole_goes_before_those_of_the_sides() -> None:
    headers = ["rpm", "Shaft Speed PS [rpm]", "Shaft Speed SB [rpm]"]
    assert infer_columns(dict.fromkeys(reversed(headers), 90 + WAVE), WANTED)["n"].columns == ("rpm",)


@pytest.mark.parametrize("headers", [("rpm_port_cmd", "rpm_stbd_cmd"), ("left motor [rpm]", "right motor [rpm]")])
def test_thrusters_are_told_by_their_sides(headers: tuple[str, str]) -> None:
    wanted = [Channel("rev_a", "rev/s"), Channel("n_starboard", "rev/s")]
    found = infer_columns(
        dict.fromkeys(reversed(headers), 1200 + WAVE),
        wanted,
        thrusters={"rev_a": "port", "n_starboard": "starboard"},
    )
    assert {name: (hit.column, hit.unit) for name, hit in found.items()} == {
        "rev_a": (headers[0], "rpm"),
        "n_starboard": (headers[1], "rpm"),
    }
    assert {hit.order for hit in found.values()} == {"cmd" in headers[0]}


def test_thrusters_are_told_by_their_numbers() -> None:
    columns = {"current_1": WAVE, "thr2_pct": 50 * WAVE, "thr1_pct": 50 * WAVE, "heading_1": WAVE}
    found = infer_columns(columns, [Channel("c_1", "1"), Channel("c_2", "1")], thrusters={"c_1": "one", "c_2": "two"})
    assert {name: (hit.column, hit.unit) for name, hit in found.items()} == {
        "c_1": ("thr1_pct", "percent"),
        "c_2": ("thr2_pct", "percent"),
    }


def test_milliseconds_are_no_speed() -> None:
    assert infer_columns({"time_ms": 200 * np.arange(200.0)}, WANTED)["t"].unit == "ms"


@pytest.mark.parametrize(
    ("header", "unit"), [("V_b_cc", "cc"), ("V_b [cc]", "cc"), ("v_b_m3", "m^3"), ("Vb ml", "ml"), ("V_b_litres", "l")]
)
def test_units_of_volumes_end_a_name(header: str, unit: str) -> None:
    inferred = infer_columns({header: WAVE}, [Channel("V_b" if "_" in header else "Vb", "m3")])
    assert [hit.unit for hit in inferred.values()] == [unit]


@pytest.mark.parametrize(("name", "unit"), [("flow_in", "m3/s"), ("u_bar", "m/s"), ("gain_l", "1")])
def test_a_channels_own_name_may_end_like_a_unit(name: str, unit: str) -> None:
    assert infer_columns({name: WAVE}, [Channel(name, unit)])[name].unit == unit
