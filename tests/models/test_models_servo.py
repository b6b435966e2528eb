"""Servos: exact against fine integration, nothing at their null, in the engine as in plain Python and in manoeuvres."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from seatruth import BadInput
from seatruth.manoeuvres import TurningCircle, Zigzag, run_manoeuvre
from seatruth.models import Channel, Model, ModelWrapper, Order, Parameter, WithServos, load_model
from seatruth.models.servo import stages
from seatruth.models.with_servos import with_servos_at
from seatruth.simulate import evaluate_rhs, simulator
from seatruth.trials.trial import Trial


def fine(z: float, order: float, later: float, h: float, lag: float, rate: float) -> tuple[float, float, float]:
    """Middle, end and mean of a servo in a step, by 2000 small steps."""
    count, area, middle = 2000, 0.0, z
    dt = h / count
    for k in range(count):
        at = order + (later - order) * (k + 0.5) / count
        half = z + 0.5 * dt * max(-rate, min(rate, (at - z) / lag))
        after = z + dt * max(-rate, min(rate, (at - half) / lag))
        area += 0.5 * dt * (z + after)
        z = after
        middle = z if k == count // 2 - 1 else middle
    return middle, z, area / h


@pytest.mark.parametrize(
    ("z", "order", "later", "lag", "rate"),
    [
        (0.0, 0.3, 0.3, 0.5, 0.1),  # at the limit all the time
        (0.0, 0.3, 0.3, 0.5, 0.4),  # at the limit, then behind by the lag
        (0.1, 0.1, 0.9, 0.3, 0.5),  # behind by the lag, then at the limit: the order is too fast
        (0.5, 0.1, 1.1, 0.2, 0.6),  # towards the order, through it, and behind it
        (0.2, 0.25, 0.2, 1.0, 5.0),  # the lag alone
    ],
)
def test_a_step_is_exact(z: float, order: float, later: float, lag: float, rate: float) -> None:
    start, middle, end = stages(z, order, later, 1.0, lag, 1.0 / rate)
    expected = fine(z, order, later, 1.0, lag, rate)
    assert (middle, end, (start + 4.0 * middle + end) / 6.0) == pytest.approx(expected, abs=2e-6)


def test_a_servo_without_lag_and_limit_is_not_there() -> None:
    assert stages(0.3, 0.3, 0.7, 0.5, 0.0, 0.0) == pytest.approx((0.3, 0.5, 0.7), rel=1e-11)
    assert stages(0.0, 0.4, 0.4, 0.5, 0.0, 0.0) == pytest.approx((0.4, 0.4, 0.4), rel=1e-11)


class Follower(Model):
    """Its state is the integral of the angle, and its output the angle: it shows what acts."""

    name = "follower"
    states = (Channel("turned", "rad s"),)
    inputs = (Channel("delta", "rad"),)
    outputs = (Channel("turned", "rad s"), Channel("angle", "rad"))
    parameters = (Parameter("gain", 1.0),)

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return (p.gain * i.delta,)

    @staticmethod
    def output(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return s.turned, i.delta

    @staticmethod
    def initial_state(y: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return (y.turned,)


T = np.arange(0.0, 8.0, 0.5)
JUMP = np.where(T >= 2.0, 0.4, 0.0)


def run(model: Model, hold: Any = "zoh", backend: Any = "compiled", **values: float) -> np.ndarray:
    sim = simulator(
        model,
        [Trial("t", T, {"delta": JUMP}, {}, synthetic=True)],
        values={**model.nominal(), **values},
        hold=hold,
        backend=backend,
    )
    return np.asarray(sim.outputs(np.zeros((1, 0)), sim.initial_states).y[0])


def test_the_engine_solves_it_exactly_with_long_steps() -> None:
    model = WithServos(Follower(), {"delta": Order(rate_limit=0.25)})
    ramp = np.clip(0.25 * (T - 2.0), 0.0, 0.4)
    found = run(model)
    np.testing.assert_allclose(found[:, 1], ramp, atol=1e-12)
    area = np.where(T < 2.0, 0.0, np.where(T < 3.6, 0.125 * (T - 2.0) ** 2, 0.32 + 0.4 * (T - 3.6)))
    np.testing.assert_allclose(found[:, 0], area, atol=1e-12)
    lagged = run(WithServos(Follower(), {"delta": Order(lag=0.05)}))
    np.testing.assert_allclose(lagged[T > 2.0, 0], 0.4 * (T[T > 2.0] - 2.0) - 0.4 * 0.05, atol=1e-5)


@pytest.mark.parametrize("hold", ["zoh", "foh"])
def test_backends_and_wrappers_agree(hold: Any) -> None:
    model = ModelWrapper(WithServos(Follower(), {"delta": Order(lag=0.4, rate_limit=0.3)}))
    values = {"gain": 0.7, "delta_lag": 0.6}
    np.testing.assert_allclose(run(model, hold, **values), run(model, hold, "reference", **values), atol=1e-13)


def test_derivatives_are_slopes() -> None:
    model = WithServos(Follower(), {"delta": Order(lag=0.4, rate_limit=0.3)})
    free = ("delta_lag", "delta_rate_limit", "gain")
    trial, theta = Trial("t", T, {"delta": JUMP}, {}, synthetic=True), np.array([0.4, 0.3, 1.0])
    exact, plain = (
        simulator(model, [trial], free=free, backend=backend).jacobian(theta, np.zeros((1, 2)), ("delta_acting",))
        for backend in ("compiled", "reference")
    )
    np.testing.assert_allclose(exact.dy, plain.dy, atol=1e-7)
    assert (np.abs(exact.dy[:, :, :3]).max(axis=(0, 1)) > 0.1).all()


def test_a_delay_shifts_the_order() -> None:
    model = WithServos(Follower(), {"delta": Order(delay=1.0)})
    np.testing.assert_allclose(run(model)[:, 1], np.where(T > 3.0, 0.4, 0.0), atol=1e-12)
    linear = run(WithServos(Follower(), {"delta": Order(delay=0.25)}), "foh")
    np.testing.assert_allclose(linear[:, 1], np.interp(T - 0.25, T, JUMP), atol=1e-12)


def test_rates_on_rows_take_what_acts() -> None:
    model = WithServos(Follower(), {"delta": Order(lag=0.4)})
    states, orders = np.array([[0.0, 0.1], [0.0, 0.2]]), np.array([[0.9], [0.9]])
    for backend in ("compiled", "reference"):
        rates = evaluate_rhs(model, np.zeros(0), (), model.nominal(), states, orders, backend=backend)
        np.testing.assert_allclose(rates[:, 0], [0.1, 0.2])


def test_a_manoeuvre_moves_the_servo_and_the_engine_replays_it() -> None:
    ship = WithServos(load_model("mmg"), {"delta": Order(rate_limit=math.radians(5.0)), "n": Order(lag=1.0)})
    first = {"u": 1.2}
    trial = run_manoeuvre(ship, TurningCircle(0.3, 1.0), dt=0.25, first_state=first, inputs={"n": 11.0}, limit=20.0)
    assert trial.inputs["delta"].max() == pytest.approx(0.3)
    plain = run_manoeuvre(
        load_model("mmg"),
        TurningCircle(0.3, 1.0),
        dt=0.25,
        first_state=first,
        inputs={"n": 11.0},
        rudder_rate=math.radians(5.0),
        limit=20.0,
    )
    both = min(len(trial), len(plain))
    np.testing.assert_allclose(trial.outputs["psi"][:both], plain.outputs["psi"][:both], atol=0.01)
    replayed = simulator(ship, [trial])
    y = replayed.outputs(np.zeros((1, 0)), replayed.initial_states).y[0]
    np.testing.assert_allclose(y[:, 2], trial.outputs["psi"], atol=1e-9)


def test_orders_alone_sail_a_zigzag() -> None:
    ship = WithServos(load_model("mmg"), {"delta": Order(rate_limit=math.radians(15.8), lag=0.05)})
    plan = Zigzag(math.radians(20), math.radians(20), approach=2.0)
    trial = run_manoeuvre(ship, plan, dt=0.2, first_state={"u": 1.18}, inputs={"n": 10.4})
    assert abs(trial.outputs["psi"]).max() > math.radians(20)


@pytest.mark.parametrize(("name", "said"), [("rudder", "no input 'rudder'"), ("delta", "a servo already")])
def test_what_cannot_be_is_refused(name: str, said: str) -> None:
    model = WithServos(Follower(), {"delta": Order(lag=0.4)})
    with pytest.raises(BadInput, match=said):
        WithServos(model, {name: Order(lag=1.0)})


def test_servos_are_added_where_there_are_none() -> None:
    model = WithServos(Follower(), {"delta": Order(lag=0.4)})
    assert with_servos_at(model, ["delta"]) is model
    idle = with_servos_at(Follower(), ["delta", "delta"])
    assert idle.hidden == ("delta_acting",)
    np.testing.assert_allclose(run(idle, "foh"), run(Follower(), "foh"), atol=1e-12)
    np.testing.assert_allclose(run(idle)[:, 0], run(Follower())[:, 0], atol=1e-12)
    assert run(idle)[T == 2.0, 1] == 0.0  # at the sample of a jump it stands where it stood
