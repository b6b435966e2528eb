"""The real trials, where they are: they read as they are, and no check calls them wrong."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from known_motion import altered

from seatruth.trials import ColumnSpec, Trial, check_trials, read_trial

DATA = Path(os.environ.get("SEATRUTH_DATA", Path(__file__).parents[3] / "shared" / "data"))
pytestmark = [
    pytest.mark.data,
    pytest.mark.skipif(not DATA.is_dir(), reason=f"the real trials are not in {DATA} (set SEATRUTH_DATA)"),
]


def ships(folder: str) -> list[Trial]:
    found = []
    for file in sorted((DATA / folder).glob("*.csv")):
        outputs = {name: ColumnSpec(name) for name in ("x", "y", "psi", "u", "v", "r")}
        if folder == "esso_osaka":
            outputs |= {name: ColumnSpec(name, invalid_where="pos_hold == 1") for name in ("x", "y")}
        found.append(read_trial(file, inputs={n: ColumnSpec(n) for n in ("delta", "n")}, outputs=outputs))
    return found


@pytest.mark.parametrize(("folder", "count"), [("esso_osaka", 20), ("kvlcc2_marin", 4), ("kvlcc2_hsva", 10)])
def test_good_ships_raise_no_false_alarm(folder: str, count: int) -> None:
    trials = ships(folder)
    assert len(trials) >= count
    found = check_trials(trials)
    assert [f for f in found if f.severity == "error"] == []
    # What remains is in the records: held and jumping satellite fixes, coarse numbers, commanded rudders.
    # In the berthing runs r comes 0.7 to 1.1 s after psi in each third of each run, and in no other run.
    assert {f.trial for f in found if f.code == "clock-offset"} <= {t.name for t in trials if "berthing" in t.name}
    true = {"held", "jumps", "outliers", "quantised-part", "input-jumps", "lever-arm", "heading-coverage"}
    true |= {"clock-offset"}
    if folder == "kvlcc2_marin":
        true |= {"psi-r-offset"}  # in the two zigzags of 20 deg r shows 0.036 and 0.040 deg/s too much
    assert {f.code for f in found} <= true
    if folder == "kvlcc2_hsva":
        assert [f for f in found if f.severity == "warning"] == []


@pytest.mark.parametrize(
    ("sign", "code"), [(("y",), "position-axes"), (("delta",), "rudder-sign"), (("r",), "psi-r-sign")]
)
def test_a_wrong_sign_is_found_in_zigzags(sign: tuple[str, ...], code: str) -> None:
    for trial in (t for t in ships("esso_osaka") if t.name.startswith("zigzag")):
        turned = altered(trial, {name: lambda a: -a for name in sign})
        assert code in {f.code for f in check_trials([turned])}, trial.name


def test_glider() -> None:
    trial = read_trial(
        DATA / "slocum_glider" / "comet_2016-174.csv",
        inputs={"buoyancy": ColumnSpec("buoyancy_cc", "cm^3")},
        outputs={"depth": ColumnSpec("depth"), "theta": ColumnSpec("pitch"), "U": ColumnSpec("U_adcp")},
    )
    # True: 14 pauses, uneven steps, the current profiler only on down-casts, and one burst in it of five samples.
    assert {f.code for f in check_trials([trial])} == {"time-gap", "time-irregular", "output-missing", "outliers"}
    upward = altered(trial, {"depth": lambda a: -a})
    assert {"depth-up", "depth-pitch-sign"} <= {f.code for f in check_trials([upward])}
