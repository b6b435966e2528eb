"""Long records made shorter for the diagnosis: on record, with the inputs' steps in their place."""

from __future__ import annotations

import numpy as np
import pytest

from seatruth.trials import Trial
from seatruth.trials.prepare.decimate import MAX_COMPARED, MAX_SAMPLES, decimate


def trial(n: int, step: float, name: str = "run") -> Trial:
    t = step * np.arange(n)
    delta = np.where(t < 0.437 * t[-1], -0.2, 0.3)
    return Trial(name, t, {"delta": delta}, {"u": 1.0 + 0.1 * t, "r": np.sin(t)})


def test_a_short_record_stays_as_it_is() -> None:
    record = trial(500, 0.5)
    assert decimate([record], ["u", "r"])[0] is record


def test_a_long_record_says_what_was_kept() -> None:
    record = trial(60_000, 0.05)
    short = decimate([record], ["u", "r"])[0]
    assert len(short) <= MAX_SAMPLES
    assert [step.name for step in short.steps][:1] == ["decimate"]
    every = short.steps[0].options["every"]
    assert short.outputs["u"][np.isfinite(short.outputs["u"])] == pytest.approx(
        record.outputs["u"][::every][np.isfinite(short.outputs["u"])]
    )


def test_a_step_of_an_input_keeps_its_time() -> None:
    """The area under the input, which is what turns the vehicle, stays the same to half a new interval's rounding."""
    record = trial(60_000, 0.05)
    short = decimate([record], ["u", "r"])[0]
    area = np.trapezoid(record.inputs["delta"], record.t)
    new_step = float(short.t[1] - short.t[0])
    assert np.trapezoid(short.inputs["delta"], short.t) == pytest.approx(area, abs=0.5 * new_step)
    assert short.inputs["delta"].min() >= -0.2 - 1e-12
    assert short.inputs["delta"].max() <= 0.3 + 1e-12


def test_no_step_becomes_longer_than_a_second() -> None:
    slow = trial(40_000, 0.6)
    short = decimate([slow], ["u", "r"])[0]
    assert float(np.median(np.diff(short.t))) == pytest.approx(0.6)
    compared = sum(int(np.isfinite(values).sum()) for values in short.outputs.values())
    assert compared <= MAX_COMPARED + 2
    assert short.steps[-1].name == "compare"
