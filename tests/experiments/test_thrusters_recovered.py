"""The experiment on errors of thrusters: what it puts in, that its trials show it, and its words for what is said."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "experiments"))

import thrusters_recovered as experiment

from seatruth import simulator
from seatruth.effects import available, with_effects
from seatruth.models import load_model


def test_every_effect_on_thrusters_is_put_in() -> None:
    put_in = {form.name for vehicle in (experiment.BOAT, experiment.ROV) for form in experiment.forms(vehicle)}
    assert set(experiment.FEW) <= put_in
    models = [load_model(vehicle.model) for vehicle in (experiment.BOAT, experiment.ROV)]
    on_thrusters = {name: effect for name, effect in available().items() if effect.actuator == "thruster"}
    kinds = {name for name, effect in on_thrusters.items() if not all(effect.missing(model) for model in models)}
    assert set(on_thrusters) - kinds == {"drive_gain"}  # of drives without a name
    assert {kind for kind in kinds if any(name.startswith(kind) for name in put_in)} == kinds
    model = load_model(experiment.ROV.model)
    tried = {form.name for effect in available().values() for form in effect.candidates(model)}
    names = [form.name for form in experiment.forms(experiment.ROV)]
    assert [name for name in names if name not in tried] == list(experiment.ROV.further)
    assert len(names) == len(set(names))


def test_trials_are_the_same_each_time_and_show_what_is_put_in() -> None:
    for vehicle in (experiment.BOAT, experiment.ROV):
        model = load_model(vehicle.model)
        effects = {form.name: form for form in experiment.forms(vehicle)}
        weak, strong = effects["battery_discharge"], effects["thruster_gain"]
        first, again, other = (experiment.trials(vehicle, one, 20.0) for one in (weak, weak, strong))
        assert all(np.array_equal(a.outputs["u"], b.outputs["u"]) for a, b in zip(first, again))
        shift = max(np.abs(a.outputs["u"] - b.outputs["u"]).max() for a, b in zip(first, other))
        assert shift > 5.0 * experiment.NOISE["u"]
        assert experiment.size(weak, model) == 3e-4
        assert experiment.size(strong, model) == pytest.approx(-0.3)
        nominal, true = model.nominal(), experiment.true_coefficients(vehicle)
        assert all(0.0 < abs(true[name] / nominal[name] - 1.0) < experiment.OFF for name in vehicle.free)
        assert all(trial.synthetic for trial in first)


@pytest.mark.parametrize(
    ("kind", "causes", "words"),
    [
        ("effects", [("thruster_gain",)], "right"),
        ("inseparable", [("thrust_gain", "thruster_gain")], "right"),
        ("effects", [("thrust_gain",)], "right"),
        ("inseparable", [("voltage_sag", "thruster_gain")], "among look-alikes"),
        ("effects", [("thruster_gain",), ("current",)], "right, and others"),
        ("effects", [("voltage_sag",)], "another"),
        ("unknown", [], "unknown"),
        ("no_gap", [], "nothing"),
        ("underpowered", [], "undecided"),
    ],
)
def test_the_words_for_what_is_said(kind: str, causes: list[tuple[str, ...]], words: str) -> None:
    verdict = SimpleNamespace(kind=kind, causes=[SimpleNamespace(effects=names) for names in causes])
    found: Any = SimpleNamespace(verdict=verdict)
    assert experiment.said(found, available()["thruster_gain"]) == words


def test_no_thrust_of_all_stands_for_that_of_one() -> None:
    model = load_model(experiment.BOAT.model)
    port = next(form for form in available()["thruster_gain"].variants(model) if form.which == ("port",))
    verdict = SimpleNamespace(kind="effects", causes=[SimpleNamespace(effects=("thrust_gain",))])
    found: Any = SimpleNamespace(verdict=verdict)
    assert experiment.said(found, port) == "another"


def test_the_picture_shows_how_far_each_size_is_from_the_one_put_in() -> None:
    sizes = ["vehicle", "effect", "said", "put in", "found", "lower", "upper"]
    rows = [
        ("boat", "gain", "right", -0.3, -0.303, -0.306, -0.297),
        ("boat", "lag", "another", 0.3, math.nan, math.nan, math.nan),
    ]
    wide, close = experiment.picture(pd.DataFrame(rows, columns=sizes)).axes
    assert wide.get_xlim()[1] == pytest.approx(20.0 * close.get_xlim()[1])
    dots = [line.get_xdata()[0] for line in wide.lines if len(line.get_xdata()) == 1]
    assert dots == pytest.approx([1.0, math.nan], nan_ok=True)
    ends = [list(line.get_xdata()) for line in wide.lines if list(line.get_ydata()) == [0, 0]]
    assert ends == [pytest.approx([-1.0, 2.0])]


def test_the_whole_library_sails_the_same_runs() -> None:
    """Effects have steps of their own; the runs must not depend on which effects the model carries at null."""
    for vehicle in (experiment.BOAT, experiment.ROV):
        model = load_model(vehicle.model)
        library = [effect for effect in available().values() if not effect.missing(model)]
        gain = next(form for form in experiment.forms(vehicle) if form.name == "thruster_gain")
        runs = experiment.trials(vehicle, gain, 10.0)
        found = []
        for effects in ([gain], library):
            whole = with_effects(model, effects)
            values = whole.nominal() | {"thruster_gain_k": -0.3}
            sim = simulator(whole, list(runs), values=values, max_step=experiment.MAX_STEP, threads=1)
            found.append(sim.outputs(np.zeros((1, 0)), sim.initial_states).y[0])
        sd = np.array([experiment.NOISE[channel.name] for channel in model.outputs])
        assert (np.abs(found[0] - found[1]).max(axis=0) < 1e-3 * sd).all()


@pytest.mark.slow
def test_a_dead_band_is_named_with_its_size() -> None:
    library = ["thruster_dead_band", "thruster_gain", "thruster_lag"]
    row = experiment.case(experiment.BOAT, "thruster_dead_band", experiment.QUICK_SECONDS, library, 1)
    assert (row["tried"], row["said"], row["named"]) == (True, "right", "thruster_dead_band")
    assert row["lower"] < row["put in"] < row["upper"]
    assert row["found"] == pytest.approx(row["put in"], rel=0.05)
    assert math.isfinite(row["cpu_s"])
