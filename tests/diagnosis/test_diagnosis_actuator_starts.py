"""Where an actuator stands when a trial begins: near its order, unless the trials tell otherwise."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import small_case as small

from seatruth.diagnosis.hypotheses import Search
from seatruth.diagnosis.problem import Problem
from seatruth.diagnosis.search import search
from seatruth.diagnosis.settings import Settings
from seatruth.effects import load_effects
from seatruth.models import Order, load_model, with_servos
from seatruth.models.base import Model
from seatruth.simulate import simulator
from seatruth.trials.trial import Trial

STEADY = Order(rate_limit=math.radians(1.5))
LAGGING = Order(lag=4.0)
CUT = (60, 60, 10, 60)
"""Samples before the orders at which the records of a careless crew begin."""


def model(folder: Path, gear: Order = STEADY) -> Model:
    """The ship behind a steering gear."""
    return with_servos(load_model("ship.py:Nomoto", folder), {"delta": gear})


def runs(folder: Path) -> list[Trial]:
    """Trials of it, each begun at rest with its rudder where it is ordered."""
    t, orders = small.rudders()
    return recorded(folder, [Trial(f"run_{k}", t, {"delta": delta}, {}) for k, delta in enumerate(orders)])


def recorded(folder: Path, bare: list[Trial], gear: Order = STEADY) -> list[Trial]:
    """What the ship does under these orders, with noise."""
    ship = model(folder, gear)
    sim = simulator(ship, bare, free=(), values={**ship.nominal(), **small.TRUE})
    y, rng = sim.outputs(np.zeros((1, 0)), sim.initial_states).y[0], np.random.default_rng(5)
    noise = np.array([small.NOISE[channel.name] for channel in ship.outputs])
    noisy = y + noise * rng.normal(size=y.shape)
    names = [channel.name for channel in ship.outputs]
    return [
        replace(trial, outputs={name: noisy[rows, k] for k, name in enumerate(names)})
        for trial, rows in zip(bare, sim.rows)
    ]


def problem(folder: Path, trials: Sequence[Trial], settings: Settings | None = None, gear: Order = STEADY) -> Problem:
    """The problem of diagnosing them."""
    plain, ship = small.study(folder, trials), model(folder, gear)
    own = [p for p in ship.parameters if p.name not in {q.name for q in plain.parameters}]
    study = plain.replace(model=ship, parameters=(*plain.parameters, *own))
    return Problem(study, load_effects(["heading_bias"]), settings or Settings(), threads=1)


@pytest.fixture(scope="module")
def whole(ship_folder: Path) -> list[Trial]:
    """From the first sample on."""
    return runs(ship_folder)


def starts(found: Search) -> np.ndarray:
    """Where the rudder of each trial began by the model alone, rad."""
    return np.asarray(found.null.point.initial[:, found.problem.initial_names.index("delta_acting")])


def test_starts_are_found_where_records_begin_at_an_order(ship_folder: Path, whole: list[Trial]) -> None:
    assert search(problem(ship_folder, whole), small.silent).problem.settings.near_orders
    late = [trial.section(start, len(trial), trial.name) for trial, start in zip(whole, CUT)]
    found = search(problem(ship_folder, late), small.silent)
    assert found.problem.settings.near_orders
    before = [float(np.asarray(trial.inputs["delta"])[start - 1]) for trial, start in zip(whole, CUT)]
    # The third trial goes on with the order that it begins with.
    known = [0, 1, 3]
    np.testing.assert_allclose(starts(found)[known], np.array(before)[known], atol=math.radians(3.0))


@pytest.mark.parametrize("gear", [LAGGING, STEADY])
def test_steady_orders_that_were_just_given_are_seen_in_the_motion(ship_folder: Path, gear: Order) -> None:
    """Nothing in the orders says that the rudder was still amidships."""
    t = np.arange(0.0, 60.0)
    angles = [np.where(t > 5.0, math.radians(a), 0.0) for a in (20, -15)]
    turns = [Trial(f"turn_{k}", t, {"delta": delta}, {}) for k, delta in enumerate(angles)]
    cut = [trial.section(6, 60, trial.name) for trial in recorded(ship_folder, turns, gear)]
    found = search(problem(ship_folder, cut, gear=gear), small.silent)
    assert not found.problem.settings.near_orders
    assert np.abs(starts(found)).max() < math.radians(4.0)
