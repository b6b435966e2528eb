"""Other faults of a single actuator join the search where one of its faults leads."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
import small_case as small

from seatruth.diagnosis.other_faults import untried, with_other_faults
from seatruth.diagnosis.pipeline import diagnose
from seatruth.diagnosis.preconditions import usable_effects
from seatruth.diagnosis.problem import Problem
from seatruth.diagnosis.search import search
from seatruth.diagnosis.settings import Settings
from seatruth.effects import load_effects, with_effects
from seatruth.models import Channel, Dimensions, Model, Parameter, Thruster
from seatruth.models.parameter import Prior
from seatruth.simulate import simulator
from seatruth.study import Study
from seatruth.trials.trial import Trial, Trials

NAMES = ("a", "b", "c", "d", "e")
PLACES = (-0.4, -0.2, 0.0, 0.2, 0.4)


class Five(Model):
    """Surge and yaw of a raft with five thrusters abreast: more than are tried in every form."""

    name = "five"
    title = "a raft with five thrusters"
    kind = "ship"
    source = "[S] made for these tests"
    states = outputs = (Channel("u", "m/s"), Channel("r", "rad/s"), Channel("psi", "rad", angle=True))
    inputs = tuple(Channel(name, "1") for name in NAMES)
    parameters = (
        Parameter("X_u", 12.0, "kg/s", 1.0, 100.0, vary=True, prior=Prior(12.0, 1.2), source="[S] test"),
        Parameter("N_r", 4.0, "kg m2/s", 0.5, 100.0, vary=True, prior=Prior(4.0, 0.4), source="[S] test"),
    )
    actuators = tuple(
        Thruster(name, name, (-0.5, y, 0.0), (1.0, 0.0, 0.0), full=1.0, diameter=0.1) for name, y in zip(NAMES, PLACES)
    )

    @staticmethod
    def thrusts(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        return tuple(10.0 * x for x in (i.a, i.b, i.c, i.d, i.e))

    @staticmethod
    def dimensions(p: Any) -> Dimensions:
        return Dimensions(1.2, 1.0, 0.2, 40.0, 1000.0)

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        a, b, c, d, f = Five.thrusts(s, i, p, e)
        turning = 0.4 * (a - f) + 0.2 * (b - d)
        return (a + b + c + d + f - p.X_u * s.u + e.X) / 40.0, (turning - p.N_r * s.r + e.N) / 6.0, s.r


def study(effect: str, **values: float) -> Study:
    """Three trials in steps of single thrusters, with one effect and noise; SYNTHETIC."""
    plain = Five()
    model = with_effects(plain, load_effects([effect], model=plain))
    truth = model.nominal() | {"X_u": 12.7, "N_r": 3.8} | {f"{effect}_{name}": v for name, v in values.items()}
    t, rng = np.arange(0.0, 40.0, 0.25), np.random.default_rng(1)
    found = []
    for run in range(3):
        steps = np.random.default_rng(10 + run).choice([-0.5, 0.0, 0.4, 0.8], (5, 14))
        inputs = {name: np.repeat(steps[k], 12)[: t.size] for k, name in enumerate(NAMES)}
        bare = Trial(f"run {run}", t, inputs, {c.name: np.zeros(t.size) for c in plain.outputs}, synthetic=True)
        sim = simulator(model, [bare], values=truth)
        y = sim.outputs(np.zeros((1, 0)), sim.initial_states).y[0]
        sizes = (0.01, math.radians(0.1), math.radians(0.2))
        noisy = {c.name: y[:, k] + sizes[k] * rng.normal(size=t.size) for k, c in enumerate(plain.outputs)}
        found.append(dataclasses.replace(bare, outputs=noisy))
    return Study("five", plain, Trials(found))


def problem(of: Study) -> Problem:
    return Problem(of, load_effects(["thruster_gain_b", "thruster_gain_d"], model=of.model), Settings(), threads=1)


def test_what_one_actuator_may_lack_besides() -> None:
    one = study("thruster_gain_b", k=0.0)
    tried = {effect.name: effect for effect in usable_effects(one, None)[0]}
    assert {name for name, effect in tried.items() if effect.which == ("b",)} == {"thruster_gain_b"}
    others = {effect.name for effect in untried(one, tried, "thruster_gain_b")}
    assert {"thruster_lag_b", "thruster_dead_band_b", "thruster_rate_limit_b"} <= others
    assert all(name.endswith("_b") for name in others)
    assert untried(one, tried, "thruster_gain") == []


def test_the_search_goes_on_over_a_wider_library_with_the_fits_that_it_has() -> None:
    found = search(problem(study("thruster_lag_b", tau=0.6)), small.silent)
    assert found.leader.effects == ("thruster_gain_b",)
    said: list[str] = []
    wider = with_other_faults(found, said.append)
    assert said[0].endswith("_b")
    assert set(found.problem.effects) < set(wider.problem.effects)
    for place in (((), False), (("thruster_gain_b",), False)):
        assert wider.fits[place].evidence == pytest.approx(found.fits[place].evidence, abs=0.01)
    leader = wider.leader
    assert leader.effects == ("thruster_lag_b",)
    (column,) = wider.problem.columns["thruster_lag_b"]
    assert leader.point.shared[column] == pytest.approx(0.6, abs=4.0 * leader.stderr(wider.problem)[column])


def test_it_stays_as_it_is_where_no_single_actuator_leads() -> None:
    found = search(problem(study("thruster_gain_b", k=0.0)), small.silent)
    assert found.leader.effects == ()
    assert with_other_faults(found, print) is found


@pytest.mark.slow
def test_a_lag_of_one_of_five_thrusters_is_named_by_the_whole_library() -> None:
    one = study("thruster_lag_b", tau=0.6)
    found = diagnose(one, suggest=False, validate=False, threads=1)
    (cause,) = found.verdict.causes
    assert cause.effects == ("thruster_lag_b",)
    assert "untried-forms" not in small.codes(found)
