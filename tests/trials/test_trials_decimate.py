"""Long records made shorter for the diagnosis: on record, with the inputs' steps in their place."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from seatruth.trials import Trial
from seatruth.trials.prepare.decimate import MAX_COMPARED, MAX_SAMPLES, _skips, decimate


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


def with_fixes(n: int, step: float, every: int, first: int) -> Trial:
    """A trial in which a position stands in each `every`-th row alone, as one of 1 Hz among rows of 10 Hz."""
    record = trial(n, step)
    x = np.full(n, np.nan)
    x[first::every] = record.t[first::every]
    return Trial("run", record.t, record.inputs, {**record.outputs, "x": x})


def fixes(record: Trial) -> int:
    return int(np.isfinite(record.outputs["x"]).sum())


@pytest.mark.parametrize("first", [0, 3, 7])
def test_a_slow_sensor_keeps_its_samples_whatever_row_they_stand_in(first: int) -> None:
    """Rows of 10 Hz, of which every sixth is kept, and a position each second."""
    record = with_fixes(50_000, 0.1, 10, first)
    short = decimate([record], ["u", "r", "x"])[0]
    assert len(short) <= 2 * MAX_SAMPLES
    kept = fixes(short)
    assert kept > 0.45 * fixes(record)
    assert short.outputs["x"][np.isfinite(short.outputs["x"])] == pytest.approx(
        short.t[np.isfinite(short.outputs["x"])]
    )


def test_an_input_keeps_its_area_over_uneven_rows() -> None:
    record = with_fixes(50_000, 0.1, 10, 3)
    short = decimate([record], ["u", "r", "x"])[0]
    assert np.ptp(np.diff(short.t)) > 0.05
    area = np.trapezoid(record.inputs["delta"], record.t)
    assert np.trapezoid(short.inputs["delta"], short.t) == pytest.approx(area, abs=0.5)


def test_fewer_samples_are_compared_of_the_channels_that_have_most() -> None:
    """A position of 1 Hz in odd rows was lost where every second row of all channels was compared."""
    record = with_fixes(8_001, 0.1, 10, 3)
    short = decimate([record], ["u", "r", "x"])[0]
    assert len(short) == len(record)
    assert fixes(short) == fixes(record) == 800
    compared = {name: int(np.isfinite(values).sum()) for name, values in short.outputs.items()}
    assert compared["u"] == compared["r"] == 4001
    assert short.steps[-1].options == {"every": {"u": 2, "r": 2}}
    assert "every 2nd sample of u" in short.steps[-1].effect


@given(st.lists(st.integers(0, 30_000), min_size=1, max_size=8), st.integers(100, 20_000))
@example(counts=[0, 0, 832, 835, 927, 677], whole=1951)  # the second was thinned with the third, and with the first
def test_what_may_be_compared_is_shared_out_among_the_channels(counts: list[int], whole: int) -> None:
    named = {str(k): count for k, count in enumerate(counts)}
    skips = _skips(named, whole)
    kept = {name: count / skips.get(name, 1) for name, count in named.items()}
    assert sum(kept.values()) <= whole or not skips
    cut = [kept[name] for name in skips]
    # What is whole has no more than twice what is left of a channel that was cut.
    assert not cut or max(kept.values()) <= 2.3 * min(cut)
    assert all(skip >= 2 for skip in skips.values())


def test_channels_of_one_rate_are_cut_alike_and_slow_ones_stay_whole() -> None:
    counts = {"psi": 5240, "r": 5200, "x": 2400, "y": 2400, "v_n": 2400, "v_e": 2400}
    assert _skips(counts, 14_000) == {"psi": 3, "r": 3}
    assert _skips({"u": 8001, "r": 8001}, 14_000) == {"u": 2, "r": 2}
    assert _skips({"u": 10}, 14_000) == {}


def test_kept_rows_meet_those_of_a_receiver_of_half_the_rate() -> None:
    """Positions in the odd rows of a log of 10 Hz: with every second row from the first on, all rows would stay."""
    n = 2 * MAX_SAMPLES
    t = 0.1 * np.arange(n)
    x = np.where(np.arange(n) % 2 == 1, t, np.nan)
    (kept,) = decimate([Trial("run", t, {"delta": t}, {"psi": t, "x": x})], ["psi", "x"])
    assert len(kept) == MAX_SAMPLES
    assert np.isfinite(kept.outputs["x"]).sum() == np.isfinite(kept.outputs["psi"]).sum()
    assert kept.t[0] == pytest.approx(0.1)
    assert kept.inputs["delta"][:3] == pytest.approx([0.05, 0.25, 0.45])
