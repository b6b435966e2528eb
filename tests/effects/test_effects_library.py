"""The library of effects on every installed model, compiled together: it vanishes, shows, and has exact slopes."""

from __future__ import annotations

import math
from collections.abc import Callable
from copy import copy
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from diver import Diver, diver_trials
from known_trials import NOISE, boat_trials, diving_trials, rov_trials, ship_trials, start, torpedo_trials
from numpy.typing import NDArray
from scipy.optimize import least_squares
from twin import Twin, Unnamed, twin_trials

from seatruth.effects import EQUATIONS, Effect, available, broken, load_effects, with_effects
from seatruth.effects.causes import ROOT, children
from seatruth.effects.reference import markdown
from seatruth.models import Observation, load_model, observed
from seatruth.models import available as models
from seatruth.models.base import Model
from seatruth.simulate import simulator
from seatruth.testing.effects import STEP, TRIAL, EffectConformance
from seatruth.trials.channel import Channel
from seatruth.trials.trial import Trial

Array = NDArray[np.float64]


def followed() -> Model:
    """A ship as a receiver of satellites shows it, by its velocity north and east."""
    return observed(load_model("mmg"), [Observation("v_n"), Observation("v_e")])


OWN: dict[str, Callable[[], Model]] = {"twin": Twin, "diver": Diver, "unnamed": Unnamed, "followed": followed}
"""A user's models with thrusters, on the surface, under water, and without names; one that is followed from above."""


def the_model(name: str) -> Model:
    """An installed model, or one of the user's own."""
    return OWN[name]() if name in OWN else load_model(name)


class Joint:
    """A model with every effect that can act on it, a short run of it, and what the run gives at null."""

    def __init__(self, name: str) -> None:
        self.model = the_model(name)
        found = [form.of_trials([TRIAL, "another"]) for e in available().values() for form in e.candidates(self.model)]
        self.effects = [effect for effect in found if not effect.missing(self.model)]
        self.extended = with_effects(self.model, self.effects)
        self.names = [q.name for q in self.extended.parameters[len(self.model.parameters) :]]
        self.null = np.array([self.extended.nominal()[name] for name in self.names])
        self.declared = [(effect, q) for effect in self.effects for q in effect.parameters]
        trial, first = EffectConformance().trial(self.model)
        self.bare = simulator(self.model, [trial], max_step=STEP).outputs(np.zeros((1, 0)), first[None]).y[0]
        self.first = EffectConformance().padded(first, self.extended, trial)
        self.simulator = simulator(self.extended, [trial], free=self.names, max_step=STEP)

    def outputs(self, theta: Array) -> Array:
        """Outputs (P, n, D) of candidates (P, K)."""
        return np.asarray(self.simulator.outputs(theta, self.first).y)


@cache
def joint(name: str) -> Joint:
    return Joint(name)


OTHER_VALUES = ("torpedo_324", "bluerov2_heavy", "twin", "unnamed", "followed")
"""Models with the equations of another one of the list, which the fast tests take."""


@pytest.fixture(
    params=[pytest.param(name, marks=[pytest.mark.slow] * (name in OTHER_VALUES)) for name in (*sorted(models()), *OWN)]
)
def one(request: pytest.FixtureRequest) -> Joint:
    found = joint(request.param)
    if not found.effects:
        pytest.skip("no effect can act on it")
    return found


def test_all_vanish_at_null(one: Joint) -> None:
    found = one.outputs(one.null[None])[0]
    assert found == pytest.approx(one.bare, rel=1e-11, abs=1e-12)


def test_each_shows_at_its_typical_magnitude(one: Joint) -> None:
    rows = []
    for effect in one.effects:
        values = {effect.named(name): value for name, value in effect.typical(one.model).items()}
        rows.append([values.get(name, null) for name, null in zip(one.names, one.null)])
    found = one.outputs(np.array(rows))
    assert np.isfinite(found).all()
    shift = np.abs(found - one.bare).max(axis=(1, 2))
    assert not [effect.name for effect, size in zip(one.effects, shift) if size < 1e-6]


def test_derivatives_at_the_null_are_slopes(one: Joint) -> None:
    exact = one.simulator.jacobian(one.null, one.first).dy
    assert np.isfinite(exact).all()
    # Of what is far smaller than its unit, a part of its typical magnitude.
    h = np.array([min(1e-6, 1e-3 * (abs(q.value) or 1.0)) for _, q in one.declared])
    ahead, far = np.tile(one.null, (2, len(one.null), 1))
    sides = np.array([1.0 if null < q.max else -1.0 for (_, q), null in zip(one.declared, one.null)])
    inside = np.array([q.min < null < q.max for (_, q), null in zip(one.declared, one.null)])
    k = np.arange(len(one.null))
    ahead[k, k] += h * sides
    far[k, k] += np.where(inside, -h, 2 * h * sides)
    near, other = one.outputs(ahead), one.outputs(far)
    here = one.outputs(one.null[None])[0]
    for j, name in enumerate(one.names):
        if inside[j]:
            slope = (near[j] - other[j]) / (2 * h[j])
        else:
            slope = (4 * near[j] - other[j] - 3 * here) / (2 * h[j] * sides[j])
        assert exact[:, :, j] == pytest.approx(slope, abs=1e-5 * (1.0 + np.abs(slope).max())), name


def test_priors_starts_and_places_fit_the_model(one: Joint) -> None:
    for effect in one.effects:
        priors, typical = effect.priors(one.model), effect.typical(one.model)
        for q in effect.parameters:
            assert priors[q.name].mean == effect.null[q.name]
            assert np.isfinite(priors[q.name].sd)
            assert priors[q.name].sd > 0
            assert q.min <= typical[q.name] <= q.max
            assert all(q.min <= begin[q.name] <= q.max for begin in (*effect.starts, *effect.likely))
        for place in effect.places(one.model):
            word, _, channel = place.partition(":")
            known = {"actuator": one.model.inputs, "sensor": one.model.outputs}.get(word, ())
            assert place in EQUATIONS or channel in {c.name for c in known}, f"{effect.name}: {place}"


def test_the_catalogue_is_complete() -> None:
    assert not broken()
    found = available()
    assert {effect.number for effect in found.values()} == set(range(1, 32))
    for name, effect in found.items():
        assert effect.name == name
        assert effect.family in children(ROOT)
        assert effect.equation, name
        assert effect.source.startswith("["), name
        assert effect.distinguished_by, name
        assert set(effect.confused_with) <= set(found), name
        assert name not in effect.confused_with


def test_the_document_has_the_catalogue() -> None:
    text = (Path(__file__).parents[2] / "docs" / "effects.md").read_text()
    own = [effect for effect in available().values() if type(effect).__module__.startswith("seatruth.")]
    assert text.endswith(markdown(own)), "write the end of docs/effects.md again from seatruth.effects.reference"


def test_each_acts_on_some_installed_model() -> None:
    kinds = [the_model(name) for name in (*OWN, *models())]
    for effect in available().values():
        acts = [model for model in kinds if not effect.missing(model)]
        assert acts or not effect.dynamic, effect.name


MADE = {
    "mmg": ship_trials,
    "diving_plane": diving_trials,
    "torpedo": torpedo_trials,
    "twin": twin_trials,
    "diver": diver_trials,
    "twin_thruster": boat_trials,
    "bluerov2_heavy": rov_trials,
    "unnamed": twin_trials,
    "followed": ship_trials,
}
"""Trials of the models that recover effects; an effect takes the first model that it can act on."""


@cache
def trials(name: str) -> tuple[Model, list[Trial], list[dict[str, float]]]:
    return (the_model(name), *MADE[name]())


def fitted(effect: Effect, near: tuple[dict[str, float], ...], on: str) -> tuple[Array, Array, Array, Array, float]:
    """On a model: null, truth, estimate and errors of an effect's parameters (K,), and chi-square over its expectation.

    The effect alone is simulated at its typical magnitude, with noise; all other parameters are known. The fit starts
    from the effect's starting points (its null where it has none), and from `near`. Its shape has the declared priors.
    """
    model, runs, first = trials(on)
    runs, first = (runs[:1], first[:1]) if effect.name == "wave_forces" else (runs, first)
    effect = effect.of_trials([run.name for run in runs])
    extended = with_effects(model, [effect])
    names = [effect.named(q.name) for q in effect.parameters]
    sim = simulator(extended, runs, free=names)
    sd = np.array([NOISE[channel.name] for channel in model.outputs])
    nominal = extended.nominal()

    def begin(theta: Array) -> Array:
        values = {**nominal, **dict(zip(names, theta.tolist()))}
        return np.array([start(extended, given, run, values) for given, run in zip(first, runs)])

    truth = np.array(list(effect.typical(model).values()))
    clean = sim.outputs(truth[None], begin(truth)).y[0]
    rng = np.random.default_rng(effect.number or 0)
    recorded = clean + sd * rng.standard_normal(clean.shape)

    scale = np.array([prior.sd for prior in effect.priors(model).values()])
    mean = np.array([effect.null[q.name] for q in effect.parameters])
    shape = np.array([q.name in effect.shape_priors for q in effect.parameters])

    def residuals(theta: Array) -> Array:
        found = ((recorded - sim.outputs(theta[None], begin(theta)).y[0]) / sd).ravel()
        return np.concatenate([np.where(np.isfinite(found), found, 1e6), ((theta - mean) / scale)[shape]])

    def slopes(theta: Array) -> Array:
        found = -(sim.jacobian(theta, begin(theta)).dy / sd[:, None]).reshape(-1, len(names))
        return np.concatenate([np.where(np.isfinite(found), found, 0.0), np.diag(1.0 / scale)[shape]])

    low, high = (np.array([getattr(q, side) for q in effect.parameters]) for side in ("min", "max"))
    best = None
    # Of an effect with values for each trial, each begins at the same one.
    near = tuple(
        {q.name: next(value for name, value in one.items() if q.name.startswith(name)) for q in effect.parameters}
        for one in near
    )
    for values in (*(effect.starting_points(model) or (dict(effect.null),)), *effect.likely, *near):
        x0 = np.clip([values[q.name] for q in effect.parameters], low + 1e-6 * scale, high - 1e-6 * scale)
        found = least_squares(residuals, x0, slopes, bounds=(low, high), x_scale=scale)
        best = found if best is None or found.cost < best.cost else best
    assert best is not None
    error = np.sqrt(np.diag(np.linalg.inv(best.jac.T @ best.jac)))
    return mean, truth, best.x, error, 2 * best.cost / recorded.size


# The likelihood of a frequency has a valley every 1/duration: it must be read from the residual's spectrum first.
NEAR = {"wave_forces": ({"cosine": 0.01, "sine": 0.01, "ln_frequency": math.log(0.82), "towards": -0.1, "lever": 0.3},)}


ALONE = sorted(
    form.name
    for e in available().values()
    for form in e.variants(Twin())
    if form.which and not form.pairs and not form.missing(Twin())
)
"""Effects on one thruster of the boat that has two."""
BOAT = load_model("twin_thruster")
ON_BOAT = {form.name: form for e in available().values() for form in e.variants(BOAT) if not form.missing(BOAT)}
"""Every form of every effect that can act on the built-in boat with two thrusters."""
ROV = load_model("bluerov2_heavy")
ON_ROV = {form.name: form for e in available().values() for form in e.candidates(ROV) if not form.missing(ROV)}
"""What a diagnosis tries on the vehicle with eight thrusters."""
_SINGLE = ("dead_band", "lag", "rate_limit", "oblique_loss", "hull_interaction", "direction", "tilt")
NAMED_ON_ROV = (
    *(f"thruster_{error}_front_port" for error in _SINGLE),
    *(f"thruster_{error}_up_rear_starboard" for error in _SINGLE if error != "direction"),
    "thrusters_exchanged_front_starboard_front_port",
    "thrusters_exchanged_front_port_up_rear_starboard",
)
"""Forms there that only a study names: of one horizontal and one vertical thruster, and of two pairs.

A vertical thruster that is turned about the vertical pushes as before.
"""


def assert_recovered(effect: Effect, on: str) -> None:
    null, truth, found, error, misfit = fitted(effect, NEAR.get(effect.name, ()), on)
    assert (np.abs(found - truth) <= 3 * error).all(), f"{found} +- {error}, true {truth}"
    assert misfit == pytest.approx(1.0, abs=0.05)
    assert (error < np.abs(truth - null)).any(), "the trials do not show it"


@pytest.mark.slow
@pytest.mark.parametrize("name", [*sorted(name for name, e in available().items() if e.dynamic), *ALONE])
def test_is_recovered_when_it_alone_is_simulated(name: str) -> None:
    forms = {form.name: form for e in available().values() for form in (*e.variants(Twin()), e)}
    effect = forms[name]
    assert_recovered(effect, next(model for model in MADE if not effect.missing(the_model(model))))


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(ON_BOAT))
def test_is_recovered_on_the_boat_with_two_thrusters(name: str) -> None:
    assert_recovered(ON_BOAT[name], "twin_thruster")


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(ON_ROV))
def test_is_recovered_on_the_vehicle_with_eight_thrusters(name: str) -> None:
    assert_recovered(ON_ROV[name], "bluerov2_heavy")


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMED_ON_ROV)
def test_is_recovered_on_single_thrusters_of_eight(name: str) -> None:
    (effect,) = load_effects([name], model=ROV)
    assert_recovered(effect, "bluerov2_heavy")


def test_a_log_pitched_in_a_vehicle_without_pitch_is_not_asked_for() -> None:
    """The pitch of the vehicle itself, bow down under thrust, would pass for it."""
    pitched = available()["log_misalignment_vertical"]
    assert not pitched.missing(load_model("diving_plane"))
    unpitched = copy(load_model("diving_plane"))
    unpitched.states = unpitched.outputs = (Channel("u", "m/s"), Channel("w", "m/s"), Channel("z", "m"))
    assert "own pitch shows the same" in pitched.missing(unpitched)
