"""The model of a first study, where the user names none."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from seatruth.readers import Log, Table
from seatruth.study.usual_model import usual_model

WAVE = np.sin(np.linspace(0.0, 20.0, 50))
DIVE = ("pitch_deg", "depth_m")


@pytest.mark.parametrize(
    ("columns", "model"),
    [
        (("rudder_deg", "rpm", "heading_deg"), "mmg"),
        (("rudder_deg", "rpm", *DIVE), "mmg"),  # a ship in waves, with an echo sounder
        (("rpm_left", "rpm_right", *DIVE), "mmg"),
        (("pitch_deg", "heading_deg"), "mmg"),
        (("elevator_deg", *DIVE), "diving_plane"),
        (("elevator_cmd_deg", "thrust_N", *DIVE), "diving_plane_driven"),
        (("batt_cmd_in", "ballast_meas_cc", "pitch_deg", "press_dbar"), "glider"),
        (("m_battpos", "m_pitch", "m_depth"), "glider"),
        ((*(f"servo{k}_raw" for k in range(1, 7)), *DIVE), "bluerov2"),
        (DIVE, "diving_plane"),
        ((*DIVE, "sternplane_deg", "rudder_deg"), "diving_plane"),
        ((*DIVE, "rudder_deg"), "mmg"),
    ],
)
def test_what_dives_is_no_ship(columns: tuple[str, ...], model: str) -> None:
    base = {name: 1500.0 + 100.0 * WAVE if "servo" in name else 20.0 + 5.0 * WAVE for name in columns}
    table = Table("log.csv", {name: pd.Series(numbers) for name, numbers in base.items()}, {})
    found = usual_model(Log("log.csv", {"": table}))
    assert found.name == model
    assert bool(found.why) == (model != "mmg")
