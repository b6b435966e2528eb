"""The conformance suite of effects. A third party's tests are

    from seatruth.testing.effects import EffectConformance

    class TestMine(EffectConformance):
        @pytest.fixture
        def effect(self):
            return MyEffect()

and inherit every check below, on every installed model that the effect can act on.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import pytest

from seatruth.arrays import Array
from seatruth.effects import EQUATIONS, Effect, with_effects
from seatruth.effects.causes import ROOT, children, is_cause
from seatruth.models import Observation, Thruster, available, observed
from seatruth.models.base import Model
from seatruth.simulate import simulator
from seatruth.testing.models import RANGES
from seatruth.trials.trial import Trial
from seatruth.units import is_unit

TRIAL = "conformance"
"""Name of the trial that the suite simulates."""
STEP = 0.05
"""s: short enough for quick models too, such as a small vehicle at high revolutions."""

_SEEN = {"x", "y", "psi", "u", "v"}
"""States of a model whose velocity north and east a receiver may show."""


class EffectConformance:
    """Checks that every effect must pass; see the module for how to inherit them."""

    seed: ClassVar[int] = 1

    @pytest.fixture
    def effect(self) -> Effect:
        """The effect under test; every inheriting class gives its own."""
        pytest.fail(f"{type(self).__name__} needs a fixture `effect`", pytrace=False)

    @pytest.fixture
    def bound(self, effect: Effect) -> Effect:
        """The effect for the one trial of this suite, where it has values for each trial."""
        return effect.of_trials([TRIAL, "another"])

    @pytest.fixture
    def models(self, bound: Effect) -> list[Model]:
        """Models that it can act on; as a receiver of satellites shows them where it acts on no plain one."""
        if not bound.dynamic:
            pytest.skip("it is noise, no term of the equations")
        plain = [kind() for kind in available().values()]
        result = [model for model in plain if not bound.missing(model)]
        if not result:
            seen = [
                observed(model, [Observation("v_n"), Observation("v_e")])
                for model in plain
                if {c.name for c in model.states} >= _SEEN
            ]
            result = [model for model in seen if not bound.missing(model)]
        assert result, "no installed model lets it act"
        return result

    def test_declares_itself(self, bound: Effect) -> None:
        assert bound.title
        assert bound.source, "say where the equation and the magnitude come from"
        assert is_cause(bound.cause), "say where it stands in the tree of causes"
        assert bound.family in children(ROOT)
        assert bound.magnitudes, "at least one parameter must have a null at which the effect vanishes"
        assert bound.acts_on, "say where it acts"
        for place in bound.acts_on:
            word, _, channel = place.partition(":")
            assert (word in ("actuator", "sensor") and channel.isidentifier()) or place in EQUATIONS, place
        for parameter in bound.parameters:
            assert is_unit(parameter.unit), f"{parameter.name}: {parameter.unit!r} is no unit"
            assert parameter.source, f"{parameter.name}: say where the magnitude comes from"
            assert parameter.min <= bound.null[parameter.name] <= parameter.max
            assert parameter.min <= parameter.value <= parameter.max
        for values in (*bound.starts, *bound.likely):
            for parameter in bound.parameters:
                assert parameter.min <= values[parameter.name] <= parameter.max

    def test_its_priors_are_usable_on_every_model(self, bound: Effect, models: list[Model]) -> None:
        for model in models:
            priors = bound.priors(model)
            typical = bound.typical(model)
            assert sorted(priors) == sorted(typical) == sorted(bound.null)
            for parameter in bound.parameters:
                prior = priors[parameter.name]
                assert prior.mean == bound.null[parameter.name]
                assert np.isfinite(prior.sd)
                assert prior.sd > 0.0
                assert parameter.min <= typical[parameter.name] <= parameter.max
                if parameter.name in bound.shape_priors:
                    assert typical[parameter.name] == prior.mean
            for start in bound.starting_points(model):
                for parameter in bound.parameters:
                    assert parameter.min <= start[parameter.name] <= parameter.max

    def test_its_places_are_those_of_the_model(self, bound: Effect, models: list[Model]) -> None:
        for model in models:
            for place in bound.places(model):
                word, _, channel = place.partition(":")
                if channel:
                    channels = model.inputs if word == "actuator" else model.outputs
                    assert channel in {c.name for c in channels}, f"{model.name}: {place}"

    def test_vanishes_at_its_null(self, bound: Effect, models: list[Model]) -> None:
        for model in models:
            extended = with_effects(model, [bound])
            trial, first = self.trial(model)
            with_it = self.simulated(extended, trial, first)
            without = self.simulated(model, trial, first)
            assert with_it == pytest.approx(without, rel=1e-11, abs=1e-12), model.name

    def test_its_shape_has_no_influence_at_its_null(self, bound: Effect, models: list[Model]) -> None:
        if not bound.shape_priors:
            pytest.skip("all its parameters are magnitudes")
        shape = {
            bound.named(q.name): min(q.max, q.prior.mean + q.prior.sd) for q in bound.parameters if q.prior is not None
        }
        for model in models:
            trial, first = self.trial(model)
            with_it = self.simulated(with_effects(model, [bound]), trial, first, shape)
            assert with_it == pytest.approx(self.simulated(model, trial, first), rel=1e-11, abs=1e-12), model.name

    def test_shows_at_its_typical_magnitude(self, bound: Effect, models: list[Model]) -> None:
        for model in models:
            trial, first = self.trial(model)
            values = {bound.named(name): value for name, value in bound.typical(model).items()}
            changed = self.simulated(with_effects(model, [bound]), trial, first, values)
            assert np.isfinite(changed).all(), model.name
            assert np.abs(changed - self.simulated(model, trial, first)).max() > 1e-6, model.name

    def test_derivatives_at_the_null_are_slopes(self, bound: Effect, models: list[Model]) -> None:
        for model in models:
            extended = with_effects(model, [bound])
            trial, first = self.trial(model)
            names = tuple(bound.named(parameter.name) for parameter in bound.parameters)
            null = np.array([bound.null[parameter.name] for parameter in bound.parameters])
            sim = simulator(extended, [trial], free=names, max_step=STEP)
            states = self.padded(first, extended, trial)
            exact = sim.jacobian(null, states).dy
            assert np.isfinite(exact).all(), model.name
            for k, parameter in enumerate(bound.parameters):
                h = 1e-6 * np.eye(len(names))[k]
                if parameter.min < null[k] < parameter.max:
                    ahead, behind = sim.outputs(np.array([null + h, null - h]), states).y
                    slope = (ahead - behind) / 2e-6
                else:  # it exists on one side of its null only
                    h = h if null[k] < parameter.max else -h
                    here, near, far = sim.outputs(np.array([null, null + h, null + 2 * h]), states).y
                    slope = (4.0 * near - far - 3.0 * here) / (2 * h[k])
                assert exact[:, :, k] == pytest.approx(slope, abs=1e-5 * (1.0 + np.abs(slope).max())), names[k]

    def trial(self, model: Model) -> tuple[Trial, Array]:
        """A short run under random inputs, and a state to start it from.

        Every input swings slowly and changes sides within one sample, half way: limits of the rate show there alone.
        Thrusters work up to two thirds of their full power.
        """
        rng = np.random.default_rng(self.seed)
        t: Array = np.arange(61) * np.float64(0.2)
        full = {actuator.input: actuator.full for actuator in model.actuators if isinstance(actuator, Thruster)}
        side = np.where(t < 0.5 * t[-1], 1.0, -1.0)
        inputs: dict[str, Array] = {}
        for channel in model.inputs:
            name = channel.name
            low, high = (-full[name], full[name]) if name in full else RANGES.get(name, (-1.0, 1.0))
            swing = np.sin(rng.uniform(0.3, 1.0) * t + 0.5)
            inputs[name] = 0.5 * (low + high) + (high - low) * (0.2 * swing + 0.13 * side)
        first = np.array([1.0 if channel.name == "u" else 0.02 for channel in model.states])
        return Trial(TRIAL, t, inputs, {}, synthetic=True), first

    def padded(self, first: Array, model: Model, trial: Trial) -> Array:
        """A first state with zeros for the effect's own states, servos at their first order: (1, S)."""
        state = np.concatenate([first, np.zeros(len(model.states) - len(first))])
        names = [channel.name for channel in model.states]
        for servo in (one for one in model.servos if one.state in names):  # a black box has no state for it
            state[names.index(servo.state)] = trial.inputs[servo.input][0]
        return state[None]

    def simulated(self, model: Model, trial: Trial, first: Array, values: dict[str, float] | None = None) -> Array:
        """Outputs (n, D) of a run."""
        sim = simulator(model, [trial], values={**model.nominal(), **(values or {})}, max_step=STEP)
        return np.asarray(sim.outputs(np.zeros((1, 0)), self.padded(first, model, trial)).y[0])
