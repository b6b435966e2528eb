"""A depth that a log has as a pressure."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from seatruth.errors import BadInput
from seatruth.study import load_study
from seatruth.trials import STANDARD_CHANNELS, Channel, ColumnSpec, Frames, Trial, read_trial
from seatruth.trials.check.helpers import as_stated
from seatruth.trials.pressure import AIR, conversion, is_depth

METRE = 1025.0 * 9.80665
"""Pa that a metre of sea water weighs on its area, [L] hydrostatics."""


def read(path: Path, spec: ColumnSpec, header: str = "press", **more: Frames) -> Trial:
    path.write_text(f"t,{header},delta\n0,10,0\n1,20,0\n2,30,0\n")
    return read_trial(path, inputs={"delta": "delta"}, outputs={"z": spec}, **more)


@pytest.mark.parametrize(
    ("unit", "pascals"), [("dbar", 1e4), ("bar", 1e5), ("kPa", 1e3), ("hPa", 1e2), ("mbar", 1e2), ("psi", 6894.757293)]
)
def test_a_pressure_is_a_depth(tmp_path: Path, unit: str, pascals: float) -> None:
    trial = read(tmp_path / "log.csv", ColumnSpec("press", unit))
    np.testing.assert_allclose(trial.outputs["z"], np.array([10.0, 20.0, 30.0]) * pascals / METRE, rtol=1e-9)
    assert f"z: a depth from a pressure in {unit}, by 1025 kg/m3 and 9.80665 m/s2" in trial.steps[0].effect


def test_scale_and_offset_say_which_water_and_whether_the_air_counts(tmp_path: Path) -> None:
    trial = read(tmp_path / "log.csv", ColumnSpec("press", "bar", scale=1.025, offset=-AIR))
    assert trial.outputs["z"][0] == pytest.approx(1e6 / (1000.0 * 9.80665) - 101325.0 / METRE)


def test_the_header_may_state_it_and_must_not_be_contradicted(tmp_path: Path) -> None:
    trial = read(tmp_path / "log.csv", ColumnSpec("press"), "press [dbar]")
    assert trial.outputs["z"][0] == pytest.approx(1e5 / METRE)
    with pytest.raises(BadInput, match=r"its header says 'dbar' and the study says 'm'.*leave the unit out"):
        read(tmp_path / "log.csv", ColumnSpec("press", "m"), "press [dbar]")


def test_it_grows_downward_in_any_axes(tmp_path: Path) -> None:
    trial = read(tmp_path / "log.csv", ColumnSpec("press", "dbar"), frames=Frames(earth="ENU"))
    assert trial.outputs["z"][0] == pytest.approx(1e5 / METRE)


def test_other_lengths_are_no_depths() -> None:
    assert is_depth(Channel("d", "m", "depth of the nose"))
    assert not is_depth(Channel("z_rate", "m/s", "rate of depth"))
    with pytest.raises(BadInput, match=r"unit 'dbar' is .*, but 'm' is length"):
        conversion("dbar", STANDARD_CHANNELS["x"])


def test_sizes_are_shown_in_the_stated_unit(tmp_path: Path) -> None:
    assert as_stated(read(tmp_path / "log.csv", ColumnSpec("press", "dbar")), "z", 1e4 / METRE, None) == "1 dbar"


def test_a_study_may_state_it(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text("t,press\n" + "".join(f"{k},{10 + k}\n" for k in range(9)))
    (tmp_path / "study.toml").write_text(
        '[model]\nuse = "diving_plane_driven"\nvary = ["*"]\n[channels]\nz = { column = "press", unit = "dbar" }\n'
        'delta_s = { value = 0.0 }\nT = { value = 5.0 }\n[[trials]]\nfile = "log.csv"\n'
        'without = ["x", "u", "w", "q", "theta"]\n'
    )
    assert load_study(tmp_path / "study.toml").trials[0].outputs["z"][0] == pytest.approx(1e5 / METRE)
