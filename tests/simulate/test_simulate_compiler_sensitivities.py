"""Derivatives by the linearized equations are those of the simulation with derivatives in its lanes."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from known_models import Blowing, plain_model, record_of

from seatruth.effects import available, effects_by_name, with_effects
from seatruth.errors import PluginError
from seatruth.models import load_model
from seatruth.simulate import simulator
from seatruth.simulate.compiler import sensitivities as module
from seatruth.simulate.compiler.graph import Graph
from seatruth.simulate.compiler.pool import run_kernel
from seatruth.trials.trial import Trial

NAMES = ["current", "rudder_lag", "heading_bias", "rudder_rate_limit"]


@pytest.mark.parametrize("acting", [(), ("current_north", "rudder_lag_tau")])
def test_both_ways_agree(acting: tuple[str, ...], monkeypatch: pytest.MonkeyPatch) -> None:
    """A ship whose effects are at their null, or partly on: hidden states follow, steps are halved, threads share."""
    model = with_effects(load_model("mmg"), effects_by_name(NAMES, available()))
    rng = np.random.default_rng(1)
    trials = []
    for number, n in enumerate((40, 25)):
        inputs = {channel.name: np.full(n, 10.0) for channel in model.inputs}
        inputs["delta"] = 0.3 * np.sin(0.2 * np.arange(n) + number) + 0.02 * rng.normal(size=n)
        outputs = {channel.name: np.full(n, 1.0) for channel in model.outputs}
        trials.append(Trial(f"run {number}", 0.5 * np.arange(n), inputs, outputs, synthetic=True))
    free = tuple(p.name for p in model.parameters)
    values = {**model.nominal(), **dict.fromkeys(acting, 0.2)}
    theta, states = np.array([values[name] for name in free]), ("u", "v", "r", "psi")
    monkeypatch.setattr(module, "_STRETCH", 17)
    found = []
    for threads in (1, 3):
        sim = simulator(model, trials, free=free, max_step=0.25, threads=threads)
        found.append(sim.jacobian(theta, sim.initial_states, states, last_states=False))
    exact = sim.jacobian(theta, sim.initial_states, states)
    size = np.abs(exact.dy).max(axis=0)
    assert found[0].dy.tobytes() == found[1].dy.tobytes()
    assert np.abs(found[0].dy - exact.dy).max(axis=0) == pytest.approx(np.zeros_like(size), abs=1e-11 * size.max())
    assert (np.abs(found[0].dy - exact.dy).max(axis=0) <= 1e-11 * size + 1e-14).all()
    assert found[0].y == pytest.approx(exact.y, rel=1e-13, abs=1e-13)
    assert found[0].dx_end.shape == (2, 0, len(free) + 4)


def test_a_run_that_diverges_has_no_finite_derivatives_from_there_on() -> None:
    trial = record_of(np.arange(60) * 0.1)
    sim = simulator(Blowing(), [trial, trial], free=("a",))
    found = sim.jacobian(np.array([1.0]), np.array([[1.0], [0.01]]), ["x"], last_states=False)
    exact = sim.jacobian(np.array([1.0]), np.array([[1.0], [0.01]]), ["x"])
    assert found.diverged.tolist() == exact.diverged.tolist() == [True, False]
    assert found.dy[sim.rows[1]] == pytest.approx(exact.dy[sim.rows[1]], rel=1e-12)
    assert np.isfinite(found.dy[:5]).all()
    assert not np.isfinite(found.dy[59]).any()


def test_derivatives_of_every_operation() -> None:
    """Functions, branches, and an output that no state reaches."""

    def rates(s: Any, i: Any, p: Any) -> Any:
        bent = math.sqrt(abs(s.x)) if s.x > 0.3 else math.exp(p.a * s.x)
        return (
            -p.a * bent + math.atan2(i.push, s.y) + math.hypot(s.y, p.b) * math.copysign(1.0, s.x),
            max(s.y, p.b) ** 1.7 - math.sin(p.a * s.y) + min(i.push, s.x) / p.b,
            p.c * s.x,
        )

    model = plain_model(rates, ("x", "y", "z"), ("a", "b", "c"), ("push",))
    trial = record_of(np.arange(30) * 0.05, np.cos)
    sim = simulator(model, [trial], free=("a", "b", "c"))
    x0, theta = np.array([[0.2, 0.4, 0.0]]), np.array([1.1, 0.7, 0.0])
    found = sim.jacobian(theta, x0, ["x", "y", "z"], last_states=False)
    assert found.dy == pytest.approx(sim.jacobian(theta, x0, ["x", "y", "z"]).dy, rel=1e-11, abs=1e-13)
    assert np.abs(found.dy[-1, :2, [0, 1, 3, 4]]).min() > 0.1


def _cubed_beyond(x: Any, band: float) -> Any:
    d = abs(x) - band
    return 0.0 * d if d <= 0.0 else d * math.sqrt(d)


def _soft(x: Any) -> Any:
    return x if x > 0.5 else math.log1p(math.exp(900.0 * x)) / 900.0


def _power(x: Any) -> Any:
    return x**0.7 if x > 0.0 else 0.0 * x


def _ratio(x: Any) -> Any:
    return math.sin(x) / x if x != 0.0 else 1.0


@pytest.mark.parametrize("function", [lambda x: _cubed_beyond(x, 0.3), _soft, _power, _ratio])
def test_the_side_of_an_if_that_is_not_taken_counts_for_nothing(function: Callable[[Any], Any]) -> None:
    """Though it has no finite value there: a thruster within its dead band, whose law is a root beyond it.

    By the parameter that scales it and by the state, the order being at rest at first.
    """

    def rates(s: Any, i: Any, p: Any) -> Any:
        return p.a * function(i.push) - p.b * s.x - p.b * function(s.x - 1.0), s.x - s.y

    model = plain_model(rates, ("x", "y"), ("a", "b"), ("push",))
    trial = record_of(np.arange(40) * 0.05, lambda t: np.where(t < 0.5, 0.0, 2.0 * np.sin(3.0 * t)))
    sim = simulator(model, [trial], free=("a", "b"))
    for x in (0.2, 3.0):
        theta, x0 = np.array([1.3, 0.8]), np.array([[x, 0.1]])
        found = sim.jacobian(theta, x0, ["x", "y"], last_states=False)
        assert np.isfinite(found.dy).all()
        assert found.dy == pytest.approx(sim.jacobian(theta, x0, ["x", "y"]).dy, rel=1e-11, abs=1e-12)
        for k, step in enumerate(1e-6 * np.eye(2)):
            ends = [sim.outputs((theta + sign * step)[None], x0).y[0] for sign in (1.0, -1.0)]
            assert found.dy[..., k] == pytest.approx((ends[0] - ends[1]) / 2e-6, rel=1e-5, abs=1e-7)


def test_derivatives_of_too_many_operations_are_refused_in_words(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Graph, "most_with_derivatives", 1)
    trial = record_of(np.arange(60) * 0.1)
    sim = simulator(Blowing(), [trial], free=("a",))
    assert np.isfinite(sim.outputs(np.array([[1.0]]), np.array([[0.01]])).y).any()
    with pytest.raises(PluginError, match="derivatives of its equations cannot be compiled: they grow beyond 1 "):
        sim.jacobian(np.array([1.0]), np.array([[0.01]]), ["x"], last_states=False)


def test_what_moves_nothing_before_its_time_is_not_carried_until_then(monkeypatch: pytest.MonkeyPatch) -> None:
    """Twelve pushes, one after the other: half of the blocks of directions are at rest over the first stretches."""
    names = tuple(f"f_{k}" for k in range(12))

    def rates(s: Any, i: Any, p: Any) -> Any:
        pushes = 0.0
        for k, name in enumerate(names):
            pushes = pushes + getattr(p, name) * max(1.0 - abs(i.push - 2.0 * k), 0.0)
        return pushes - 0.3 * s.x, s.x

    model = plain_model(rates, ("x", "y"), names, ("push",))
    trial = record_of(np.arange(250) * 0.1, lambda t: t)
    sim = simulator(model, [trial], free=names)
    carried: list[int] = []

    def counted(*args: Any) -> None:
        carried.append(args[-1])
        run_kernel(*args)

    monkeypatch.setattr(module, "run_kernel", counted)
    monkeypatch.setattr(module, "_STRETCH", 50)
    theta, x0 = np.linspace(1.0, 2.0, 12), np.array([[0.0, 0.0]])
    found = sim.jacobian(theta, x0, [], last_states=False)
    assert carried == [1, 1, 1, 2, 2]
    assert found.dy == pytest.approx(sim.jacobian(theta, x0, []).dy, rel=1e-11, abs=1e-13)
    assert not found.dy[:100, :, 11].any()
    assert found.dy[-1, 0, 11] != 0.0
