"""Currents on models whose equations do not know them: the path is that in still water, carried along."""

from __future__ import annotations

import math
import pickle
from typing import Any

import numpy as np
import pytest

from seatruth import Channel, Model, Parameter
from seatruth.effects import available, with_effects
from seatruth.models import load_model
from seatruth.simulate import simulator
from seatruth.trials.trial import Trial

_CURRENT = {"current_north": 0.3, "current_east": -0.2}
_STATES = (
    Channel("u", "m/s", "surge"),
    Channel("v", "m/s", "sway"),
    Channel("r", "rad/s", "yaw rate"),
    Channel("psi", "rad", "heading", angle=True),
    Channel("x", "m", "north"),
    Channel("y", "m", "east"),
)


class Unaware(Model):
    """A boat whose author gave the equations no environment."""

    name = "unaware"
    kind = "ship"
    states = outputs = _STATES
    inputs = (Channel("helm", "rad"), Channel("n", "rev/s"))
    parameters = (Parameter("k", 0.02, "m"), Parameter("d", 0.3, "1/s"))

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return (
            p.k * i.n * abs(i.n) - p.d * s.u + s.v * s.r,
            -0.8 * s.v - 0.4 * s.u * s.r,
            0.5 * s.u * i.helm - 0.9 * s.r - 0.2 * s.v,
            s.r,
            s.u * math.cos(s.psi) - s.v * math.sin(s.psi),
            s.u * math.sin(s.psi) + s.v * math.cos(s.psi),
        )


class NoSway(Model):
    """Nomoto's boat: it moves where it points. Its author forgot what a current does across the heading."""

    name = "no_sway"
    kind = "ship"
    states = outputs = tuple(channel for channel in _STATES if channel.name != "v")
    inputs = (Channel("helm", "rad"), Channel("n", "rev/s"))
    parameters = (Parameter("k", 0.02, "m"), Parameter("d", 0.3, "1/s"))

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        return (
            p.k * i.n * abs(i.n) - p.d * (s.u - e.u_c) + e.X,
            0.5 * i.helm - 0.9 * s.r,
            s.r,
            s.u * math.cos(s.psi),
            s.u * math.sin(s.psi),
        )


_T = np.arange(0.0, 60.0, 0.1)


def _run(model: Model, first: dict[str, float], values: dict[str, float]) -> dict[str, Any]:
    """Outputs of 60 s in turns to both sides, from this state and rest."""
    trial = Trial("turns", _T, {"helm": 0.3 * np.sign(np.sin(0.2 * _T)), "n": np.full_like(_T, 6.0)}, {})
    start = np.array([[first.get(channel.name, 0.0) for channel in model.states]])
    found = simulator(model, [trial], values={**model.nominal(), **values}).outputs(np.zeros((1, 0)), start)
    return {channel.name: found.y[0, :, k] for k, channel in enumerate(model.outputs)}


@pytest.mark.parametrize("model", [Unaware(), NoSway()], ids=lambda model: model.name)
def test_a_current_only_carries_the_vehicle(model: Model) -> None:
    """Seen from the water the path is the same: positions differ by the way of the water, headings not at all."""
    moved = with_effects(model, [available()["current"]])
    north, east = _CURRENT["current_north"], _CURRENT["current_east"]
    still = _run(model, {"u": 1.0}, {})
    # Ahead is north at the start.
    first = {"u": 1.0 + north, "v": east} if "v" in still else {"u": 1.0 + north}
    carried = _run(moved, first, _CURRENT)
    assert np.ptp(still["psi"]) > 1.0  # it turns
    assert carried["psi"] == pytest.approx(still["psi"], abs=1e-6)  # of the integration
    assert carried["x"] == pytest.approx(still["x"] + north * _T, abs=1e-6)
    assert carried["y"] == pytest.approx(still["y"] + east * _T, abs=1e-6)
    ahead = north * np.cos(still["psi"]) + east * np.sin(still["psi"])
    assert carried["u"] == pytest.approx(still["u"] + ahead, abs=1e-6)


def test_a_copy_in_another_process_moves_with_the_water_too() -> None:
    copied = pickle.loads(pickle.dumps(Unaware()))
    extra = dict(_CURRENT)
    effect = available()["current"]
    here, there = (_run(with_effects(model, [effect]), {"u": 1.3}, extra) for model in (Unaware(), copied))
    assert here["y"] == pytest.approx(there["y"], abs=0.0)


def test_forces_still_need_an_environment() -> None:
    assert "takes no environment e" in available()["wind"].missing(Unaware())
    assert not available()["current"].missing(Unaware())


@pytest.mark.parametrize(("model", "drift"), [(NoSway(), True), (Unaware(), True), (load_model("mmg"), False)])
def test_where_wind_would_look_the_same_the_cause_is_the_environment(model: Model, drift: bool) -> None:
    for name in ("current", "varying_current", "trial_current"):
        (form,) = available()[name].variants(model)
        assert form.cause == ("environment" if drift else available()[name].cause)
        assert ("leeway" in form.title) == form.stands_for_untried == drift
        again = form.of_trials(["a", "b"])
        assert (again.cause, again.title, again.stands_for_untried) == (form.cause, form.title, drift)
