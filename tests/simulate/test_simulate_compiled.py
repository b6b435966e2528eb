"""The engine against exact solutions, and what it promises: order, holds, masks, divergence, threads, lanes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from known_models import Blowing, Lag, exact_lag, record_of, step_record

import seatruth.simulate.compiler.program
from seatruth.errors import BadInput
from seatruth.models import load_model
from seatruth.models.base import Model
from seatruth.models.parameter import Parameter
from seatruth.simulate import simulator
from seatruth.trials.channel import Channel
from seatruth.trials.trial import Trial


def test_known_trajectory() -> None:
    trial = step_record(x=np.zeros(51))
    sim = simulator(Lag(), [trial])
    found = sim.outputs(np.zeros((1, 0)), sim.initial_states)
    assert found.y[0, :, 0] == pytest.approx(exact_lag(trial.t, 1.5, 2.0, 0.0), abs=1e-7)
    assert not found.diverged.any()
    assert found.x_end[0, 0] == pytest.approx(found.y[0, -1])
    assert sim.steps == 50


def test_fourth_order() -> None:
    errors = []
    for steps in (10, 20, 40):
        sim = simulator(Lag(), [record_of(np.linspace(0.0, 4.0, steps + 1), np.ones_like)])
        end = sim.outputs(np.zeros((1, 0)), np.zeros((1, 2))).x_end[0, 0, 0]
        errors.append(abs(end - exact_lag(4.0, 1.5, 2.0, 0.0)))
    assert errors[0] / errors[1] == pytest.approx(16.0, rel=0.2)
    assert errors[1] / errors[2] == pytest.approx(16.0, rel=0.2)


def test_sums_are_those_of_the_outputs() -> None:
    rng = np.random.default_rng(1)
    trials = [step_record(51, x=rng.normal(size=51), angle=rng.normal(size=51)), step_record(23, x=rng.normal(size=23))]
    trials[1] = Trial("short", trials[1].t, trials[1].inputs, trials[1].outputs, synthetic=True)
    sim = simulator(Lag(), trials, free=("k", "T"))
    theta = np.column_stack([rng.uniform(1.0, 2.0, 37), rng.uniform(1.0, 3.0, 37)])
    x0 = rng.normal(size=(37, 2, 2))
    weights = rng.uniform(0.5, 2.0, sim.measured.shape)
    sums, outputs = sim.squared_errors(theta, x0, weights), sim.outputs(theta, x0)
    error = np.nan_to_num((sim.measured - outputs.y) * weights)
    for k, rows in enumerate(sim.rows):
        assert sums.sums[:, k] == pytest.approx((error[:, rows] ** 2).sum(axis=1), rel=1e-11)
    assert sums.x_end == pytest.approx(outputs.x_end, rel=1e-12)
    assert (sums.sums[:, 1, 1] == 0.0).all()  # the second trial has no angle


def test_samples_that_are_not_valid_do_not_count() -> None:
    x = np.zeros(51)
    whole = simulator(Lag(), [step_record(x=x)])
    x = x.copy()
    x[10:20] = math.nan
    holed = simulator(Lag(), [step_record(x=x)])
    one = np.zeros((1, 0))
    weights = np.ones((51, 2))
    lost = whole.outputs(one, np.zeros((1, 2))).y[0, 10:20, 0]
    difference = (
        whole.squared_errors(one, np.zeros((1, 2)), weights).sums
        - holed.squared_errors(one, np.zeros((1, 2)), weights).sums
    )
    assert difference[0, 0, 0] == pytest.approx((lost**2).sum(), rel=1e-12)


def test_diverged_candidates_are_infinite_and_counted() -> None:
    trial = record_of(np.linspace(0.0, 2.0, 201), x=np.ones(201))
    sim = simulator(Blowing(), [trial, record_of(np.linspace(0.0, 0.5, 51), name="short")], free=("a",))
    theta = np.array([[0.1], [1.0], [-1.0], [50.0], [math.inf], [math.nan]])
    found = sim.squared_errors(theta, np.ones((2, 1)), np.ones((252, 1)))
    assert found.diverged.tolist() == [
        [False, False],
        [True, False],
        [False, False],
        [True, True],
        [True, True],
        [True, True],
    ]
    assert np.isinf(found.sums[found.diverged]).all()
    assert np.isfinite(found.sums[~found.diverged]).all()
    outputs = sim.outputs(theta, np.ones((2, 1)))
    assert (outputs.diverged == found.diverged).all()
    alone = sim.squared_errors(theta[:1], np.ones((2, 1)), np.ones((252, 1)))
    assert alone.sums[0] == pytest.approx(found.sums[0], rel=0)
    assert sim.jacobian(np.array([50.0]), np.ones((2, 1))).diverged.tolist() == [True, True]


@pytest.mark.parametrize("name", ["mmg", "diving_plane", "abkowitz"])
def test_threads_and_lanes_do_not_change_a_bit(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    model = load_model(name)
    rng = np.random.default_rng(2)
    n = 60
    inputs = {channel.name: rng.uniform(0.0, 0.3, n) for channel in model.inputs}
    outputs = {channel.name: rng.normal(size=n) for channel in model.outputs}
    trials = [Trial(f"run {k}", np.arange(n) * 0.1, inputs, outputs, synthetic=True) for k in range(3)]
    free = tuple(p.name for p in model.parameters if p.value)[-5:]
    theta = np.array([model.nominal()[p] for p in free]) * rng.uniform(0.9, 1.1, (50, 5))
    x0 = np.abs(rng.normal(1.0, 0.1, (3, len(model.states))))
    found = []
    for threads in (1, 2, 3, 8, 64):
        for width in (8, 16):
            split = [(slice(0, 24), width), (slice(24, None), 24 - width)]
            monkeypatch.setattr(seatruth.simulate.compiler.program, "lane_blocks", lambda *_, split=split: split)
            sim = simulator(model, trials, free=free, threads=threads)
            weights = np.ones(sim.measured.shape)
            sums = sim.squared_errors(theta, x0, weights)
            jacobian = sim.jacobian(theta[0], x0, [model.states[0].name])
            monkeypatch.undo()
            one = sim.squared_errors(theta[7:8], x0, weights)
            assert np.array_equal(one.sums[0], sums.sums[7])
            found.append((sums.sums.tobytes(), sums.x_end.tobytes(), jacobian.dy.tobytes(), jacobian.dx_end.tobytes()))
    assert len(set(found)) == 1
    assert not np.isnan(np.frombuffer(found[0][0])).any()


def test_derivatives_by_parameters_and_initial_states() -> None:
    """Against the exact derivative of the lag's solution."""
    trial = record_of(np.arange(41) * 0.05, np.ones_like)
    sim = simulator(Lag(), [trial, Trial("again", trial.t, trial.inputs, {}, synthetic=True)], free=("k", "T"))
    x0 = np.array([[0.4, 0.0], [2.0, 1.0]])
    found = sim.jacobian(np.array([1.5, 2.0]), x0, ["x", "angle"])
    decay = np.exp(-trial.t / 2.0)
    for rows, first in zip(sim.rows, x0[:, 0]):
        assert found.dy[rows, 0, 0] == pytest.approx(1.0 - decay, abs=1e-7)
        assert found.dy[rows, 0, 1] == pytest.approx((first - 1.5) * decay * trial.t / 4.0, abs=1e-7)
        assert found.dy[rows, 0, 2] == pytest.approx(decay, abs=1e-7)
        assert found.dy[rows, 0, 3] == pytest.approx(np.zeros(41), abs=0)
        assert found.dy[rows, 1, 3] == pytest.approx(np.ones(41), abs=1e-15)
    assert found.dx_end[0] == pytest.approx(found.dy[sim.rows[0].stop - 1])
    assert found.y == pytest.approx(sim.outputs(np.array([[1.5, 2.0]]), x0).y[0], rel=1e-14)


def test_derivatives_are_those_of_a_complex_step() -> None:
    """Workload's own equations in complex Python, step 1e-30, to the last digits."""
    model = load_model("abkowitz")
    rng = np.random.default_rng(3)
    n = 40
    trial = Trial("run", np.arange(n) * 0.5, {"delta": rng.uniform(-0.2, 0.2, n)}, {}, synthetic=True)
    x0 = np.array([[7.0, 0.1, 0.001, 0.0, 0.0, 0.2]])
    free = ("Y_v", "N_r", "m", "L", "X_du")
    sim = simulator(model, [trial], free=free)
    theta = np.array([model.nominal()[name] for name in free])
    found = sim.jacobian(theta, x0)
    for k, name in enumerate(free):
        values: dict[str, Any] = {**model.nominal(), name: model.nominal()[name] + 1e-30j}
        exact = _complex_run(model, trial, x0[0], values).imag / 1e-30
        assert found.dy[:, :, k] == pytest.approx(exact, rel=1e-11, abs=1e-13 * np.abs(exact).max())


def _complex_run(model: Model, trial: Trial, x0: Any, values: dict[str, Any]) -> Any:
    """The model's equations by hand in complex numbers; U stays above its least value in this run."""
    import cmath
    import types

    from seatruth.models import abkowitz
    from seatruth.models.base import Environment, record

    names = {"max": lambda a, b: a if complex(a).real > complex(b).real else b, "math": cmath}
    function = types.FunctionType(model.rhs.__code__, {**vars(abkowitz), **names})
    p = record("P", model.parameters)(*[values[q.name] for q in model.parameters])
    state, inputs = record("S", model.states), record("I", model.inputs)

    def rate(s: Any, d: float) -> Any:
        return np.array(function(state(*s), inputs(d), p, Environment()))

    s, found, delta = x0.astype(complex), [], trial.inputs["delta"]
    for k in range(len(trial)):
        found.append([dict(zip([c.name for c in model.states], s))[c.name] for c in model.outputs])
        if k + 1 < len(trial):
            h, d0, d1 = trial.t[k + 1] - trial.t[k], delta[k], delta[k + 1]
            k1 = rate(s, d0)
            k2 = rate(s + h / 2 * k1, (d0 + d1) / 2)
            k3 = rate(s + h / 2 * k2, (d0 + d1) / 2)
            s = s + h / 6 * (k1 + 2 * k2 + 2 * k3 + rate(s + h * k3, d1))
    return np.array(found)


def test_discretisation_error_is_about_the_true_one() -> None:
    trial = record_of(np.linspace(0.0, 4.0, 9), np.ones_like)
    sim = simulator(Lag(), [trial])
    reported = sim.discretisation_error(np.zeros(0), np.zeros((1, 2)))[0]
    y = sim.outputs(np.zeros((1, 0)), np.zeros((1, 2))).y[0, :, 0]
    true = float(np.sqrt(np.mean((y - exact_lag(trial.t, 1.5, 2.0, 0.0)) ** 2)))
    assert reported == pytest.approx(true, rel=0.15)


@settings(max_examples=25, deadline=None)
@given(
    sizes=st.lists(st.integers(1, 40), min_size=1, max_size=5), candidates=st.integers(1, 40), seed=st.integers(0, 99)
)
def test_each_trial_and_candidate_stands_alone(sizes: list[int], candidates: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    trials = [
        Trial(f"run {k}", np.cumsum(rng.uniform(0.05, 0.2, n)), {"push": rng.normal(size=n)}, {}, synthetic=True)
        for k, n in enumerate(sizes)
    ]
    theta, x0 = rng.uniform(0.5, 2.0, (candidates, 1)), rng.normal(size=(candidates, len(sizes), 2))
    together = simulator(Lag(), trials, free=("k",)).outputs(theta, x0)
    chosen, trial = int(rng.integers(candidates)), int(rng.integers(len(sizes)))
    alone = simulator(Lag(), [trials[trial]], free=("k",)).outputs(theta[[chosen]], x0[chosen, [trial]])
    rows = slice(sum(sizes[:trial]), sum(sizes[: trial + 1]))
    assert np.array_equal(together.y[chosen, rows], alone.y[0])


def test_states_and_outputs_that_are_functions() -> None:
    class Speed(Lag):
        name = "speed"
        outputs = (Channel("speed", "1"), Channel("clock", "s"), Channel("gain", "1"))

        @staticmethod
        def output(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
            return abs(s.x) * i.push, e.t, p.k

        @staticmethod
        def initial_state(y: Any, i: Any, p: Any) -> tuple[Any, ...]:
            return y.speed, 0.0

    t = 100.0 + np.arange(11) * 0.1
    trial = record_of(t, lambda x: 1.0 + x, speed=np.full(11, 0.5))
    sim = simulator(Speed(), [trial])
    assert sim.initial_states.tolist() == [[0.5, 0.0]]
    assert sim.assumed_zero == (("run", "clock"), ("run", "gain"))
    found = sim.outputs(np.zeros((1, 0)), sim.initial_states).y[0]
    states = sim.states(np.zeros(0), sim.initial_states)
    assert found[:, 0] == pytest.approx(np.abs(states[:, 0]) * (1.0 + t))
    assert found[:, 1] == pytest.approx(t)
    assert found[:, 2] == pytest.approx(np.full(11, 1.5))


def test_first_state_is_of_the_first_valid_sample() -> None:
    x = np.full(51, math.nan)
    x[4:] = 3.0
    sim = simulator(Lag(), [step_record(x=x)])
    assert sim.initial_states.tolist() == [[3.0, 0.0]]
    assert sim.assumed_zero == (("run", "angle"),)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"free": ("kk",)}, "Did you mean 'k'"),
        ({"values": {"T": 1.0}}, "'k' has no value"),
        ({"values": {"T": 1.0, "k": math.nan, "unused": 1.0}}, "'k' is nan"),
        ({"free": ("k", "k")}, "twice"),
        ({"hold": "zoha"}, "Did you mean 'zoh'"),
        ({"max_step": 0.0}, "longest step"),
        ({"max_step": 1e-9}, "steps"),
        ({"threads": 0}, "threads"),
    ],
)
def test_what_cannot_be_simulated_is_said(change: dict[str, Any], words: str) -> None:
    with pytest.raises(BadInput, match=words):
        simulator(Lag(), [step_record()], **change)


def test_one_sample_is_a_trial() -> None:
    sim = simulator(Lag(), [step_record(1, x=np.ones(1))], free=("k",))
    found = sim.squared_errors(np.ones((3, 1)), sim.initial_states + 0.5, np.ones((1, 2)))
    assert found.sums[:, 0, 0] == pytest.approx(np.full(3, 0.25))
    assert sim.jacobian(np.ones(1), sim.initial_states, ["x"]).dy[0, 0].tolist() == [0.0, 1.0]


def test_a_model_without_parameters_or_inputs() -> None:
    class Fall(Model):
        name = "fall"
        states = (Channel("x", "m"), Channel("v", "m/s"))
        outputs = (states[0],)

        @staticmethod
        def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
            return s.v, -9.81

        @staticmethod
        def initial_state(y: Any, i: Any, p: Any) -> tuple[Any, ...]:
            return y.x, 0.0

    sim = simulator(Fall(), [record_of(np.linspace(0.0, 1.0, 11), x=np.zeros(11))])
    assert sim.outputs(np.zeros((1, 0)), sim.initial_states).x_end[0, 0] == pytest.approx([-4.905, -9.81])


def test_a_vanishing_parameter_is_a_parameter(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Blowing, "parameters", (Parameter("a", 0.0, "1"),))
    sim = simulator(Blowing(), [record_of(np.linspace(0.0, 1.0, 11))], free=("a",))
    found = sim.jacobian(np.zeros(1), np.full((1, 1), 2.0))
    assert found.dy[-1, 0, 0] == pytest.approx(4.0)
