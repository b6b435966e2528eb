"""Preparation steps against known truth, each on record and none changing anything else."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from seatruth.errors import BadInput
from seatruth.trials import STEPS, Trial, apply_steps, prepare

T = np.arange(0, 100, 0.1)


def trial(outputs: dict[str, Any] | None = None, inputs: dict[str, Any] | None = None, t: Any = T) -> Trial:
    return Trial("run", t, {"delta": 0.3 * t} if inputs is None else inputs, outputs or {"psi": 2 * t + 1})


def test_every_step_is_registered_and_described() -> None:
    assert {"cut", "hampel", "low_pass", "resample", "fill_gaps", "lever_arm", "fuse_depth", "differentiate"} <= set(
        STEPS
    )
    for name, step in STEPS.items():
        assert step.name == name
        assert step.summary.endswith(".")
        assert step.options.__doc__


def test_unknown_steps_and_options_name_the_nearest() -> None:
    for steps, says in [
        ([("lowpas", {})], "Did you mean 'low_pass'?"),
        ([("low_pass", {"cutof": 1.0})], "Did you mean 'cutoff'?"),
        ([("low_pass", {"cutoff": "fast"})], "valid number"),
        ([("low_pass", {})], "'cutoff': Field required"),
        ([("hampel", {"window": 4})], "window must be odd"),
        ([("hampel", {"channels": ["ps"]})], "Did you mean 'psi'?"),
    ]:
        with pytest.raises(BadInput) as caught:
            apply_steps(trial(), steps)
        assert says in str(caught.value)


def test_steps_run_in_order_and_leave_themselves_on_record() -> None:
    found = apply_steps(trial(), [("cut", {"start": 10.0, "end": 20.0}), ("change_sign", {"channels": ["delta"]})])
    assert [step.name for step in found.steps] == ["cut", "change_sign"]
    assert found.steps[0].effect == "kept 101 of 1000 samples, 10 to 20 s"
    assert found.steps[0].options == {"start": 10.0, "end": 20.0}
    np.testing.assert_allclose(found.inputs["delta"], -0.3 * found.t)
    assert trial().steps == ()


def test_cut_by_number_and_outside() -> None:
    assert prepare.cut(trial(), first=5, last=9).t.tolist() == pytest.approx([0.5, 0.6, 0.7, 0.8, 0.9])
    with pytest.raises(BadInput, match="leaves 0 samples"):
        prepare.cut(trial(), start=500.0)


def test_hampel_finds_exactly_the_outliers_put_in() -> None:
    rng = np.random.default_rng(0)
    clean = np.sin(0.2 * T) + 0.01 * rng.standard_normal(T.size)
    rows = np.sort(rng.choice(np.arange(5, 995), 12, replace=False))
    dirty = clean.copy()
    dirty[rows] += rng.choice([-1, 1], 12) * rng.uniform(0.5, 3, 12)
    found = prepare.hampel(trial({"u": dirty}), sigmas=6.0)
    assert np.flatnonzero(np.isnan(found.outputs["u"])).tolist() == rows.tolist()
    assert "12 of u" in found.steps[0].effect
    replaced = prepare.hampel(trial({"u": dirty}), sigmas=6.0, replace="median")
    assert np.abs(replaced.outputs["u"] - clean).max() < 0.1


def test_windows_and_rates_beyond_all_measure_are_refused() -> None:
    with pytest.raises(BadInput, match="window 1000000001 is longer than the trial"):
        prepare.hampel(trial({"u": T}), window=1_000_000_001)
    for rate in (1e9, float("inf")):
        with pytest.raises(BadInput, match=r"Hz gives \S+ samples of"):
            prepare.resample(trial(), rate=rate)


def test_hampel_leaves_quantised_and_ramping_data_alone() -> None:
    steps = np.round(np.sin(0.1 * T) * 50) / 50
    found = prepare.hampel(trial({"u": steps, "x": 3 * T, "y": np.where(T > 50, 1.0, 0.0)}))
    for name in ("u", "x", "y"):
        assert np.isfinite(found.outputs[name]).all(), name
    gaps = np.where(np.arange(T.size) % 7 == 0, np.nan, np.sin(T))
    assert np.isfinite(prepare.hampel(trial({"u": gaps})).outputs["u"]).sum() == np.isfinite(gaps).sum()


@settings(max_examples=20, deadline=None)
@given(st.floats(0.02, 0.3), st.floats(0.0, 6.28))
def test_low_pass_shifts_no_sine(frequency: float, phase: float) -> None:
    """Zero phase: the cross-correlation with the original peaks at zero lag, for inputs and outputs alike."""
    wave = np.sin(2 * np.pi * frequency * T + phase)
    found = prepare.low_pass(trial({"u": wave}, {"delta": wave}), cutoff=0.5)
    np.testing.assert_array_equal(found.outputs["u"], found.inputs["delta"])
    middle = slice(200, 800)
    a, b = wave[middle], found.outputs["u"][middle]
    quadrature = np.cos(2 * np.pi * frequency * T + phase)[middle]
    shift = np.linalg.lstsq(np.column_stack([a, quadrature]), b, rcond=None)[0]
    assert abs(np.arctan2(shift[1], shift[0])) < 2e-3
    gain = 1 / (1 + (np.tan(np.pi * frequency / 10) / np.tan(np.pi * 0.5 / 10)) ** 8)
    assert shift[0] == pytest.approx(gain, abs=5e-3)


def test_low_pass_takes_noise_and_keeps_lines() -> None:
    rng = np.random.default_rng(1)
    found = prepare.low_pass(trial({"x": 2 * T + 1, "u": rng.standard_normal(T.size)}), cutoff=0.5)
    np.testing.assert_allclose(found.outputs["x"], 2 * T + 1, atol=1e-9)
    assert np.std(found.outputs["u"]) < 0.4


def test_low_pass_refuses_what_it_would_spoil() -> None:
    holes = np.where((T > 20) & (T < 21), np.nan, np.sin(T))
    with pytest.raises(BadInput, match="no valid sample from 20"):
        prepare.low_pass(trial({"u": holes}), cutoff=1.0)
    found = prepare.low_pass(trial({"u": holes}), cutoff=1.0, bridge=2.0)
    assert (np.isnan(found.outputs["u"]) == np.isnan(holes)).all()
    with pytest.raises(BadInput, match="evenly sampled"):
        prepare.low_pass(trial(t=np.where(T > 50, T + 0.05, T)), cutoff=1.0)
    with pytest.raises(BadInput, match="half the sampling rate"):
        prepare.low_pass(trial(), cutoff=6.0)
    with pytest.raises(BadInput, match="unwrap"):
        prepare.low_pass(trial({"psi": np.mod(T, 2 * np.pi)}), cutoff=1.0)


@pytest.mark.parametrize("rate", [2.0, 5.0, 25.0, 3.7])
def test_resampling_is_exact_on_lines(rate: float) -> None:
    found = prepare.resample(trial(), rate=rate)
    np.testing.assert_allclose(np.diff(found.t), 1 / rate)
    np.testing.assert_allclose(found.outputs["psi"], 2 * found.t + 1, atol=1e-9)
    np.testing.assert_allclose(found.inputs["delta"], 0.3 * found.t, atol=1e-9)
    assert found.t[-1] <= T[-1] + 1e-9


def test_resampling_filters_what_would_alias() -> None:
    wave = np.sin(2 * np.pi * 1.9 * T)  # folds to 0.1 Hz at 2 Hz
    assert np.abs(prepare.resample(trial({"u": wave}), rate=2.0).outputs["u"][20:-20]).max() < 0.01
    assert np.abs(prepare.resample(trial({"u": wave}), rate=2.0, anti_alias=False).outputs["u"]).max() > 0.5


def test_resampling_makes_up_no_samples_in_gaps() -> None:
    holes = np.where((T > 20) & (T < 25), np.nan, T)
    found = prepare.resample(trial({"u": holes}), rate=20.0)
    inside = (found.t > 20.0 + 1e-6) & (found.t < 25.0 - 1e-6)
    assert np.isnan(found.outputs["u"][inside]).all()
    assert np.isfinite(found.outputs["u"][~inside]).all()
    assert np.isfinite(prepare.resample(trial({"u": holes}), rate=20.0, max_gap=10.0).outputs["u"]).all()


def test_resampling_of_held_and_irregular_inputs() -> None:
    t = np.array([0.0, 0.13, 0.2, 0.31, 0.4, 0.55, 0.6])
    steps = np.arange(7.0)
    found = prepare.resample(Trial("run", t, {"n": steps}, {"u": t}), rate=20.0, inputs="zoh", max_gap=0.2)
    assert set(found.inputs["n"]) <= set(steps)
    np.testing.assert_allclose(found.inputs["n"][[0, 2, 3, 4, 6]], [0, 0, 1, 2, 2])
    np.testing.assert_allclose(found.outputs["u"], found.t)
    with pytest.raises(BadInput, match="its own rate"):
        prepare.resample(Trial("run", t, {"n": steps}, {"u": t}), rate=5.0)


def test_fill_gaps_fills_short_ones_only() -> None:
    values = 0.5 * T
    values = np.where((T > 1.05) & (T < 1.35) | (T > 50) & (T < 60), np.nan, values)
    found = prepare.fill_gaps(trial(inputs={"n": values}), max_gap=1.0)
    filled = np.isfinite(found.inputs["n"])
    np.testing.assert_allclose(found.inputs["n"][filled], 0.5 * T[filled], atol=1e-12)
    assert np.isnan(found.inputs["n"][(T > 50.01) & (T < 59.99)]).all()
    assert "filled 3 of n" in found.steps[0].effect
    assert "longer gaps left" in found.steps[0].effect
    held = prepare.fill_gaps(trial(inputs={"n": values}), max_gap=1.0, method="hold")
    np.testing.assert_allclose(held.inputs["n"][11:14], 0.5 * 1.0, atol=1e-12)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 1000), st.floats(0.1, 2.5))
def test_unwrap_undoes_wrapping(seed: int, pace: float) -> None:
    rng = np.random.default_rng(seed)
    truth = np.cumsum(rng.uniform(-pace, pace, T.size))
    holes = np.where(rng.random(T.size) < 0.02, np.nan, 1.0)
    wrapped = (np.mod(truth + np.pi, 2 * np.pi) - np.pi) * holes
    turns = (prepare.unwrap(trial({"psi": wrapped})).outputs["psi"] - truth) / (2 * np.pi)
    longest = np.diff(np.flatnonzero(np.isfinite(holes))).max()
    if pace * longest < np.pi:  # the steps across missing samples are still less than half a turn
        assert np.nanmax(turns) - np.nanmin(turns) < 1e-9
    np.testing.assert_allclose(turns - np.round(turns), 0 * turns, atol=1e-9)


def test_correct_shift_time_mark_invalid_zero_time() -> None:
    found = prepare.correct(trial(), multiply={"psi": 2.0}, add={"delta": 0.1})
    np.testing.assert_allclose(found.outputs["psi"], 2 * (2 * T + 1))
    np.testing.assert_allclose(found.inputs["delta"], 0.3 * T + 0.1)
    late = trial({"u": np.sin(T - 0.35), "v": np.sin(T)})
    moved = prepare.shift_time(late, channels=["u"], seconds=0.35)
    inside = T < 99.5
    assert np.abs(moved.outputs["u"] - np.sin(T))[inside].max() < 2e-3
    assert np.isnan(moved.outputs["u"][-3:]).all()
    held = np.repeat(np.arange(250.0), 4)
    marked = prepare.mark_invalid(trial({"x": held}), channels=["x"], held=True)
    assert np.isfinite(marked.outputs["x"]).sum() == 250
    marked = prepare.mark_invalid(trial(), channels=["psi"], start=10.0, end=19.95)
    assert np.isnan(marked.outputs["psi"]).sum() == 100
    with pytest.raises(BadInput, match="input"):
        prepare.mark_invalid(trial(), channels=["delta"])
    assert prepare.zero_time(trial(t=T + 50)).t[0] == 0.0


def test_differentiate_makes_a_rate() -> None:
    found = prepare.differentiate(trial({"psi": np.sin(0.5 * T)}), of="psi", into="r")
    np.testing.assert_allclose(found.outputs["r"], 0.5 * np.cos(0.5 * T), atol=5e-4)  # the ends are one-sided
    holes = np.where((T > 20) & (T < 21), np.nan, np.sin(0.5 * T))
    rate = prepare.differentiate(trial({"psi": holes}), of="psi", into="r").outputs["r"]
    known = np.isfinite(rate)
    np.testing.assert_allclose(rate[known], 0.5 * np.cos(0.5 * T[known]), atol=5e-4)
    assert not known[(T > 19.6) & (T < 21.4)].any()
    with pytest.raises(BadInput, match="there already"):
        prepare.differentiate(trial(), of="psi", into="delta")


HOLES = np.where((T > 20.0) & (T < 30.0), np.nan, T)


@pytest.mark.parametrize(
    ("step", "options", "outputs", "says"),
    [
        ("low_pass", {"cutoff": 1.0}, {"psi": 0 * T + np.nan}, "'psi' has no valid sample. Leave 'psi' out of"),
        (
            "low_pass",
            {"cutoff": 1.0},
            {"u": HOLES},
            "no valid sample from 20.1 to 29.9 s, and gaps are bridged up to",
        ),
        ("resample", {"rate": 0.005}, None, "0.005 Hz gives 1 samples of 1000. Choose another rate."),
        ("resample", {"rate": 1e5}, None, "gives 9.99e+06 samples of 1000. Choose another rate."),
        (
            "differentiate",
            {"of": "psi", "into": "psi"},
            None,
            "'psi' is there already. Choose another name for 'into'.",
        ),
        ("differentiate", {"of": "psi", "into": "r/s"}, None, "'r/s' cannot name a channel. Use letters, digits and"),
        ("differentiate", {"of": "psi", "into": "r", "window": 1001}, None, "longer than the trial, 1000 samples"),
        ("differentiate", {"of": "psi", "into": "r", "window": 10}, None, "window must be odd and larger than order"),
    ],
)
def test_filters_say_why_they_cannot(step: str, options: dict[str, Any], outputs: Any, says: str) -> None:
    with pytest.raises(BadInput) as caught:
        apply_steps(trial(outputs), [(step, options)])
    assert says in str(caught.value)
    assert step in str(caught.value)


def test_resampling_wants_inputs_without_holes_and_an_even_clock_before_a_lower_rate() -> None:
    with pytest.raises(BadInput, match=r"input 'delta' has missing samples. Run the step 'fill_gaps' before it"):
        prepare.resample(trial(inputs={"delta": HOLES}), rate=1.0)
    uneven = trial({"psi": 2 * T + 1}, t=T + 0.03 * np.sin(T))
    with pytest.raises(BadInput, match=r"First resample to 10\S* Hz, its own rate, or set anti_alias to false"):
        prepare.resample(uneven, rate=1.0)
    assert len(prepare.resample(uneven, rate=1.0, anti_alias=False)) == 100
    with pytest.raises(BadInput, match="fewer than two samples"):
        prepare.resample(trial().section(0, 1), rate=1.0)


def test_an_output_that_was_never_valid_stays_so_when_it_is_resampled() -> None:
    found = prepare.resample(trial({"psi": 2 * T + 1, "x": 0 * T + np.nan}), rate=20.0)
    assert np.isnan(found.outputs["x"]).all()
    np.testing.assert_allclose(found.outputs["psi"], 2 * found.t + 1)


def test_a_derivative_has_no_value_where_its_window_has_a_hole() -> None:
    found = prepare.differentiate(
        trial({"psi": np.where((T < 0.25) | (T > 99.75), np.nan, 2 * T + 1)}), of="psi", into="r"
    )
    slope = found.outputs["r"]
    assert np.isnan(slope[:8]).all()
    assert np.isnan(slope[-7:]).all()
    np.testing.assert_allclose(slope[8:-7], 2.0)
    assert found.steps[-1].effect == "r from psi, window 1.1 s; 10 samples lost near gaps"


def test_unwrapping_degrees_that_were_taken_for_radians_is_refused() -> None:
    """Their jumps of 360 would leave a heading that looks like noise."""
    run = trial({"psi": np.array([358.0, 359.5, 1.0, 2.5])}, {"delta": np.zeros(4)}, np.arange(4.0))
    with pytest.raises(BadInput, match=r"channel 'psi', t = .*jumps by 358.5 rad: it is in degrees"):
        prepare.unwrap(run)
