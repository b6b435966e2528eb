"""The ship four ways is one ship, also where something acts from outside."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from seatruth import simulator
from seatruth.effects import load_effects, with_effects
from seatruth.models import IsolatedBlackBox, load_model

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "experiments"))

import one_vehicle_four_ways as experiment  # noqa: E402


def test_all_ways_sail_the_same_runs(tmp_path: Path) -> None:
    runs = experiment.trials(experiment.FREE[:2], {}, seconds=20.0, count=1)
    effects, values = load_effects(["current", "wind"]), {"current_north": 0.1, "current_east": -0.1, "wind_north": 4.0}
    found = {}
    for way in experiment.WAYS:
        model = experiment.vehicle(way, tmp_path)
        if isinstance(model, IsolatedBlackBox) and way == "black box":
            assert model.base is not None
            model = model.base  # the same function, in this process
        whole = with_effects(model, effects)
        sim = simulator(whole, list(runs), values={**whole.nominal(), **values}, threads=1)
        names = [channel.name for channel in whole.states[:6]]
        places = [[channel.name for channel in whole.outputs].index(name) for name in sorted(names)]
        found[way] = sim.outputs(np.zeros((1, 0)), sim.initial_states).y[0][:, places]
    first = found["built-in"]
    assert np.array_equal(found["user's file"], first)
    spread = np.ptp(first, axis=0)
    # The black box takes half steps, and asks once a stage; the FMU holds inputs over a quarter of a second.
    assert (np.abs(found["black box"] - first).max(axis=0) < 1e-3 * spread).all()
    assert (np.abs(found["FMU"] - first).max(axis=0) < 1e-2 * spread).all()


def test_what_is_put_in_is_stated() -> None:
    true = experiment.true_coefficients(experiment.FREE)
    assert list(true) == list(experiment.FREE)
    assert all(abs(value / nominal - 1.0) <= 0.15 for value, nominal in
               ((true[name], load_model("mmg").nominal()[name]) for name in true))  # fmt: skip
    assert np.hypot(*experiment.CURRENT) == pytest.approx(0.128, abs=1e-3)
