"""Other spellings of a channel's names."""

from __future__ import annotations

import numpy as np
import pytest

from seatruth.study.infer_columns import infer_columns
from seatruth.trials import STANDARD_CHANNELS

WAVE = np.sin(np.linspace(0.0, 20.0, 200))
WANTED = list(STANDARD_CHANNELS.values())


@pytest.mark.parametrize(
    ("header", "channel", "unit"),
    [
        ("yawrate_dps", "r", "deg/s"),
        ("turnrate [deg/s]", "r", "deg/s"),
        ("rollangle_deg", "phi", "deg"),
        ("usbl_n", "x", "m"),
        ("pos_e_m", "y", "m"),
        ("usbl_north_m", "x", "m"),
        ("usbl_east_m", "y", "m"),
        ("gps easting (m)", "y", "m"),
        ("mocap_x", "x", "m"),
        ("imu_yaw_rate", "r", "rad/s"),
        ("gyro_q_dps", "q", "deg/s"),
        ("dvl_bt_u_mps", "u", "m/s"),
        ("DVL BT vel w [m/s]", "w", "m/s"),
        ("GNSS SOG (kn)", "sog", "kn"),
        ("GNSS COG (deg)", "cog", "deg"),
        ("GNSS VelN (m/s)", "v_n", "m/s"),
        ("HDT (deg)", "psi", "deg"),
        ("ahrs_pitch_deg", "theta", "deg"),
        ("usbl_depth", "depth", "m"),
        ("usbl_lat", "latitude", "deg"),
        ("ins_lon [deg]", "longitude", "deg"),
        ("m_depth", "depth", "m"),
        ("m_pitch", "theta", "rad"),
        ("eng_pitchAng [deg]", "theta", "deg"),
    ],
)
def test_glued_words_and_the_system_before_a_name_are_understood(header: str, channel: str, unit: str) -> None:
    wanted = [one for one in WANTED if one.name not in ("northing", "easting")]
    found = infer_columns({header: WAVE}, wanted)
    assert {name: hit.unit for name, hit in found.items()} == {channel: unit}


@pytest.mark.parametrize("header", ["usbl_x", "gps x", "Fx", "un", "imu_north", "ship_yaw_north"])
def test_what_may_be_something_else_is_left_alone(header: str) -> None:
    assert infer_columns({header: WAVE}, WANTED) == {}


def test_the_plain_name_goes_first() -> None:
    assert infer_columns({"gps_north": WAVE, "north": WAVE}, [STANDARD_CHANNELS["x"]])["x"].column == "north"
