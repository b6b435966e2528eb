"""Wrappers keep what the model around which they stand declares, and pass on its equations."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from seatruth.diagnosis.discrepancy.model import DiscrepancyModel
from seatruth.effects import ExtendedModel, available
from seatruth.errors import BadInput
from seatruth.manoeuvres import Stepper
from seatruth.models import Channel, Model, Observation, Parameter
from seatruth.models.abkowitz import AbkowitzShip
from seatruth.models.base import Environment, Equations, record
from seatruth.models.observed import ObservedModel
from seatruth.models.with_holds import WithHolds
from seatruth.models.with_servos import Order, WithServos
from seatruth.models.wrapper import MODEL_ATTRIBUTES, ModelWrapper
from seatruth.prediction.population import ByRow

MARKS = {"hidden": ("u",), "follows": {"u": ("v", 1.0)}, "longest_step": 0.25, "standard": {"v": ("v", 1)}}


class Ship(AbkowitzShip):
    """A model that declares something for every attribute that a wrapper could forget."""

    hidden = ("n",)
    longest_step = 0.25
    standard = {"y": ("y", 1)}  # noqa: RUF012

    @staticmethod
    def thrust(s: Any, i: Any, p: Any, e: Any) -> Any:
        return 100.0 * s.u

    @staticmethod
    def drag(s: Any, i: Any, p: Any, e: Any) -> Any:
        return 50.0 * s.u * abs(s.u)


class Leaking(ModelWrapper):
    """Adds a state that fills with the first state of the model, an input that stops it and a rate."""

    def __init__(self, base: Model) -> None:
        super().__init__(
            base,
            states=[Channel("tank", "1")],
            inputs=[Channel("open", "1")],
            parameters=[Parameter("leak", 0.5, "1/s")],
            hidden=["tank"],
        )

    def make_rhs(self) -> Equations:
        split_s, split_i, split_p = self.split_states(), self.split_inputs(), self.split_parameters()
        rhs = self.base.rhs

        def filling(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
            (plain, (tank,)), (inputs, (opened,)), (parameters, (leak,)) = split_s(s), split_i(i), split_p(p)
            return (*rhs(plain, inputs, parameters, e), opened * plain[0] - leak * tank)

        return filling

    def make_initial_state(self) -> Equations:
        split_i, split_p, base = self.split_inputs(), self.split_parameters(), self.base
        names = [channel.name for channel in base.states]

        def initial_state(y: Any, i: Any, p: Any) -> tuple[Any, ...]:
            first = base.initial_state
            plain = [getattr(y, n) for n in names] if first is None else first(y, split_i(i)[0], split_p(p)[0])
            return (*plain, 0.0)

        return initial_state


def ship() -> Ship:
    return Ship()


def lacking(model: Model) -> ModelWrapper:
    scales = {channel.name: 1.0 for channel in (*model.states, *model.inputs)}
    return DiscrepancyModel(model, 3, 10.0, scales)


WRAPPERS: dict[type[ModelWrapper], Callable[[Model], ModelWrapper]] = {
    ExtendedModel: lambda model: ExtendedModel(model, [available()["current"], available()["rudder_lag"]]),
    DiscrepancyModel: lacking,
    Leaking: Leaking,
    ByRow: lambda model: ByRow(model, ["Y_v", "rho"]),
    WithServos: lambda model: WithServos(model, {"delta": Order(lag=0.5)}),
    WithHolds: lambda model: WithHolds(model, {"delta": "zoh"}),
    ObservedModel: lambda model: ObservedModel(model, [Observation("sog")], keep=("u", "v")),
}


def test_every_wrapper_is_in_this_file() -> None:
    assert {kind for kind in ModelWrapper.__subclasses__() if kind.__module__ != "docs"} == set(WRAPPERS)


def test_every_public_attribute_is_listed() -> None:
    values = {name for name, value in vars(Model).items() if not callable(value) and not name.startswith("_")}
    assert values <= set(MODEL_ATTRIBUTES), "annotate new attributes of Model, so that wrappers pass them on"


@pytest.mark.parametrize("kind", WRAPPERS)
def test_every_attribute_is_kept(kind: type[ModelWrapper]) -> None:
    """Channels and parameters come first in the wrapper's, the rest is the same; functions give the same values."""
    model = ship()
    wrapper = WRAPPERS[kind](model)
    functions = {"rhs", "output", "initial_state", "dimensions", "thrust", "drag"}
    for name in set(MODEL_ATTRIBUTES) - functions - {"title"}:
        theirs, ours = getattr(model, name), getattr(wrapper, name)
        if isinstance(theirs, tuple):
            assert ours[: len(theirs)] == theirs, name
        elif name in ("follows", "holds"):
            assert theirs.items() <= ours.items()
        elif name == "longest_step":
            assert ours <= theirs
        else:
            assert ours == theirs, name
    assert wrapper.title.startswith(model.title)
    s, i, p = records(model)
    long_s, long_i, long_p = records(wrapper)
    e = Environment()
    assert model.dimensions is not None
    assert wrapper.dimensions is not None
    assert wrapper.dimensions(long_p) == model.dimensions(p)
    for theirs, ours in ((model.thrust, wrapper.thrust), (model.drag, wrapper.drag), (model.rhs, wrapper.rhs)):
        assert theirs is not None
        assert ours is not None
        size = len(model.states)
        expected, found = theirs(s, i, p, e), ours(long_s, long_i, long_p, e)
        assert (found[:size] if isinstance(found, tuple) else found) == pytest.approx(expected)


def records(model: Model) -> tuple[Any, Any, Any]:
    """States, inputs and parameters of a model; what a wrapper adds is zero, or the parameter that it stands for."""
    values = {"u": 7.0, "v": 0.3, "r": 0.01, "delta": 0.1, **{f"own_{q.name}": q.value for q in model.parameters}}
    s = record("States", model.states)(*(values.get(channel.name, 0.0) for channel in model.states))
    i = record("Inputs", model.inputs)(*(values.get(channel.name, 0.0) for channel in model.inputs))
    return s, i, record("Parameters", model.parameters)(**model.nominal())


def test_a_wrapper_adds_states_inputs_and_parameters() -> None:
    wrapper = Leaking(ship())
    assert wrapper.hidden[-1] == wrapper.states[-1].name == "tank"
    s, i, p = records(wrapper)
    rates = wrapper.rhs(s._replace(tank=2.0), i._replace(open=3.0), p, Environment())
    assert rates[-1] == pytest.approx(3.0 * s[0] - 0.5 * 2.0)
    outputs = {channel.name: 0.0 for channel in wrapper.outputs}
    inputs = {channel.name: 0.0 for channel in wrapper.inputs}
    assert len(wrapper.first_state(outputs, inputs, wrapper.nominal())) == len(wrapper.states)


class WithoutEnvironment(Model):
    name = "without_environment"
    states = (Channel("x", "m"),)
    outputs = (Channel("double", "m"),)
    parameters = (Parameter("a", 2.0, "1/s"),)

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return (-p.a * s.x,)

    @staticmethod
    def output(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return (2.0 * s.x,)

    @staticmethod
    def initial_state(y: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return (0.5 * y.double,)


def test_equations_without_environment_get_the_one_form() -> None:
    model = WithoutEnvironment()
    s, i, p = record("States", model.states)(3.0), record("Inputs", model.inputs)(), record("P", model.parameters)(2.0)
    assert not model.takes_environment
    assert model.rhs(s, i, p, Environment()) == (-6.0,)
    assert model.output is not None
    assert model.output(s, i, p, Environment()) == (6.0,)
    wrapper = lacking(model)
    assert not wrapper.takes_environment
    assert AbkowitzShip().takes_environment
    again = pickle.loads(pickle.dumps(model))
    assert not again.takes_environment
    assert Stepper(again).rate(0.0, (3.0,), {}) == (-6.0,)


def test_other_numbers_of_arguments_are_refused() -> None:
    class Short(WithoutEnvironment):
        @staticmethod
        def rhs(s: Any, p: Any) -> tuple[Any, ...]:  # type: ignore[override]  # the mistake under test
            return (np.nan,)

    with pytest.raises(BadInput, match=r"rhs cannot be called with \(s, i, p\)"):
        Short()
