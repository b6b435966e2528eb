"""What is said of all trials together: still inputs, overlaps, coverage, the model's channels, excitation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from known_motion import altered, codes, step_at, zigzag

from seatruth.trials import Channel, check_trials, findings_table
from seatruth.trials.check import excitation_table
from seatruth.trials.check.excitation import reversals
from seatruth.trials.check.helpers import squared_correlation

GOOD = zigzag(amplitude=0.5, period=80)
OTHER = zigzag(amplitude=0.5, period=55)
DEG = 180 / np.pi


def test_still_inputs() -> None:
    still = altered(GOOD, {"delta": lambda a: 0 * a, "n": lambda a: 0 * a + 10})
    assert "input-constant" in codes(check_trials([still]))
    assert "input-constant" not in codes(check_trials([altered(GOOD, {"n": lambda a: 0 * a + 10})]))


def test_duplicates_and_overlaps() -> None:
    copy = replace(GOOD, name="again")
    found = [f for f in check_trials([GOOD, copy]) if f.code == "duplicate"]
    assert found[0].severity == "error"
    first, second = GOOD.section(0, 1700, "first"), GOOD.section(1500, 3000, "second")
    found = [f for f in check_trials([first, second]) if f.code == "duplicate"]
    assert found[0].severity == "warning"
    assert "200 samples" in found[0].message or "199 samples" in found[0].message
    assert "duplicate" not in codes(check_trials([GOOD.section(0, 1500, "a"), GOOD.section(1500, 3000, "b")]))


def test_one_column_in_two_channels() -> None:
    wrong = replace(GOOD, outputs={**GOOD.outputs, "v": GOOD.outputs["u"]})
    (found,) = [f for f in check_trials([wrong]) if f.code == "same-column"]
    assert found.message == f"u and v have the same values in all {len(GOOD.t)} samples."
    turned = replace(GOOD, outputs={**GOOD.outputs, "v": -GOOD.outputs["u"]})
    assert "same-column" in codes(check_trials([turned]))
    still = replace(GOOD, outputs={**GOOD.outputs, "v": 0 * GOOD.t, "w": 0 * GOOD.t})
    assert "same-column" not in codes(check_trials([GOOD, still]))


def test_coverage_of_headings_and_speeds() -> None:
    straight = zigzag(amplitude=0.1, period=20)
    found = codes(check_trials([straight]))
    assert {"heading-coverage", "speed-range"} <= found
    other = zigzag(amplitude=0.1, period=20, course=2.5, speed=2.4, name="other")
    assert not {"heading-coverage", "speed-range"} & codes(check_trials([straight, other]))


class _Model:
    inputs = (Channel("delta", "rad", "rudder, positive to port"), Channel("n", "rev/s"))
    outputs = (Channel("u", "m/s"), Channel("w", "m/s"))


def test_model_states_its_channels_and_its_rudder() -> None:
    found = check_trials([altered(GOOD, {"delta": lambda a: -a})], _Model())
    assert "rudder-sign" not in codes(found)
    assert [f.channel for f in found if f.code == "channel-missing"] == ["w"]
    without = replace(GOOD, inputs={"n": GOOD.inputs["n"]})
    missing = next(f for f in check_trials([without], _Model()) if f.channel == "delta")
    assert missing.severity == "error"


def test_findings_are_gravest_first_and_show_as_a_table() -> None:
    found = check_trials([altered(GOOD, {"psi": lambda a: a * DEG, "x": step_at, "delta": lambda a: 0.3 * np.sign(a)})])
    order = [f.severity for f in found]
    assert order == sorted(order, key=["error", "warning", "note"].index)
    table = findings_table(found)
    assert list(table["code"]) == [f.code for f in found]
    assert "zigzag" in str(found[0])


def test_excitation_table_counts_reversals() -> None:
    table = excitation_table([GOOD]).set_index("input")
    assert table.loc["delta", "reversals"] == 7  # 300 s of an 80 s zigzag: a reversal every 40 s
    assert table.loc["delta", "max"] == pytest.approx(0.5)
    assert 0.01 < float(table["f95_Hz"]["delta"]) < 0.1
    assert reversals(np.array([0.0, 1.0, 0.0, 1.0, 0.0])) == 3
    assert reversals(np.zeros(5)) == 0


@pytest.mark.parametrize("size", [1e-200, 1.0, 1e200, 1e300])
def test_the_squared_correlation_takes_any_size(size: float) -> None:
    a = np.array([1.0, -2.0, 3.0])
    assert squared_correlation(size * a, a) == pytest.approx(1.0)
    assert squared_correlation(size * a, np.array([2.0, 1.0, 0.0])) == pytest.approx(0.0, abs=1e-30)
    assert squared_correlation(size * a, np.zeros(3)) == 0.0
