"""The conformance suite of models. A third party's tests are

    from seatruth.testing.models import ModelConformance

    class TestMine(ModelConformance):
        @pytest.fixture
        def model(self):
            return MyShip()

and inherit every check below. `ranges` says over which states and inputs the model must stay finite, by channel name
(for channels that it does not name, `RANGES` holds usual ones); `start` is the state from which the compiled model is
compared with the plain one (zero where it names none).
"""

from __future__ import annotations

import importlib
import math
import pickle
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
import pytest

from seatruth.arrays import Array
from seatruth.manoeuvres import Stepper
from seatruth.models.base import Environment, Model, record
from seatruth.trials.trial import Trial
from seatruth.units import is_unit

RANGES: Mapping[str, tuple[float, float]] = {
    **dict.fromkeys(("x", "y", "z"), (-1e4, 1e4)),
    **dict.fromkeys(("phi", "theta"), (-1.5, 1.5)),
    "psi": (-20.0, 20.0),
    "u": (-3.0, 10.0),
    **dict.fromkeys(("v", "w"), (-3.0, 3.0)),
    **dict.fromkeys(("p", "q", "r"), (-0.5, 0.5)),
    **dict.fromkeys(("delta", "delta_s", "delta_r", "delta_e"), (-0.7, 0.7)),
    "n": (-20.0, 20.0),
    "voltage": (12.0, 17.0),
}


class ModelConformance:
    """Checks that every model must pass; see the module for how to inherit them."""

    ranges: ClassVar[Mapping[str, tuple[float, float]]] = {}
    start: ClassVar[Mapping[str, float]] = {"u": 1.0}
    seed: ClassVar[int] = 1

    @pytest.fixture
    def model(self) -> Model:
        """The model under test; every inheriting class gives its own."""
        pytest.fail(f"{type(self).__name__} needs a fixture `model`", pytrace=False)

    def test_declares_itself(self, model: Model) -> None:
        assert model.name.isidentifier()
        assert model.title
        assert model.source, "say where the equations come from"
        for channel in (*model.states, *model.inputs, *model.outputs):
            assert is_unit(channel.unit), f"{channel.name}: {channel.unit!r} is no unit"

    def test_parameters_have_units_bounds_and_sources(self, model: Model) -> None:
        for parameter in model.parameters:
            assert is_unit(parameter.unit), f"{parameter.name}: {parameter.unit!r} is no unit"
            assert parameter.min <= parameter.value <= parameter.max, parameter.name
            assert parameter.source, f"{parameter.name}: say where the value comes from"

    def test_channels_of_one_name_have_one_unit(self, model: Model) -> None:
        units: dict[str, str] = {}
        for channel in (*model.states, *model.inputs, *model.outputs):
            assert units.setdefault(channel.name, channel.unit) == channel.unit, channel.name

    def test_rates_and_outputs_are_finite_numbers(self, model: Model) -> None:
        stepper = Stepper(model)
        for state, inputs in self.samples(model, 300):
            result = stepper.rate(0.0, state, inputs)
            assert len(result) == len(model.states)
            assert all(math.isfinite(x) for x in result), f"{result} at {state}, {inputs}"
            outputs = stepper.outputs(state, inputs)
            assert list(outputs) == [channel.name for channel in model.outputs]
            assert all(math.isfinite(x) for x in outputs.values())

    def test_is_finite_at_rest(self, model: Model) -> None:
        stepper = Stepper(model)
        rest, still = tuple(0.0 for _ in model.states), {channel.name: 0.0 for channel in model.inputs}
        assert all(math.isfinite(x) for x in stepper.rate(0.0, rest, still))
        for k in range(len(rest)):
            for size in (1e-300, 1e-12, 1e-6, 1e-3, -1e-3):
                near = tuple(size if j == k else 0.0 for j in range(len(rest)))
                assert all(math.isfinite(x) for x in stepper.rate(0.0, near, still))

    def test_same_question_same_answer(self, model: Model) -> None:
        first, second = Stepper(model), Stepper(model)
        questions = self.samples(model, 20)
        forwards = [first.rate(0.0, *question) for question in questions]
        backwards = [second.rate(0.0, *question) for question in reversed(questions)]
        assert forwards == backwards[::-1]

    def test_first_state_returns_the_outputs(self, model: Model) -> None:
        stepper = Stepper(model)
        for state, inputs in self.samples(model, 20):
            outputs = stepper.outputs(state, inputs)
            first = model.first_state(outputs, inputs, model.nominal())
            assert len(first) == len(model.states)
            again = stepper.outputs(first, inputs)
            assert again == pytest.approx(outputs, rel=1e-9, abs=1e-9)

    def test_kinematics_of_standard_channels(self, model: Model) -> None:
        names = {channel.name for channel in model.states}
        stepper = Stepper(model)
        for state, inputs in self.samples(model, 20):
            s = dict(zip((c.name for c in model.states), state))
            rate = dict(zip(s, stepper.rate(0.0, state, inputs)))
            if {"x", "y", "psi", "u", "v", "r"} <= names and not {"theta", "phi"} & names:
                assert rate["x"] == pytest.approx(s["u"] * math.cos(s["psi"]) - s["v"] * math.sin(s["psi"]), abs=1e-9)
                assert rate["y"] == pytest.approx(s["u"] * math.sin(s["psi"]) + s["v"] * math.cos(s["psi"]), abs=1e-9)
                assert rate["psi"] == s["r"]
            if {"z", "theta", "u", "w", "q"} <= names and not {"phi", "v"} & names:
                down = -s["u"] * math.sin(s["theta"]) + s["w"] * math.cos(s["theta"])
                assert rate["z"] == pytest.approx(down, abs=1e-9)
                assert rate["theta"] == s["q"]

    def test_a_uniform_current_only_carries_the_vehicle(self, model: Model) -> None:
        """In axes that drift with a steady current the motion is the same as in still water."""
        names = [channel.name for channel in model.states]
        pairs = [(a, b) for a, b in (("u", "u_c"), ("v", "v_c"), ("w", "w_c")) if a in names]
        if not model.takes_current or len(pairs) < 2:
            pytest.skip("the model takes no current")
        rng = np.random.default_rng(self.seed)
        for state, inputs in self.samples(model, 50):
            s = dict(zip(names, state))
            c = dict(zip((b for _, b in pairs), rng.uniform(-1.0, 1.0, len(pairs)).tolist()))
            u, v, w = (c.get(key, 0.0) for key in ("u_c", "v_c", "w_c"))
            p, q, r = (s.get(key, 0.0) for key in ("p", "q", "r"))
            change = {"u": r * v - q * w, "v": p * w - r * u, "w": q * u - p * v}
            environment = Environment(**c, **{f"d{a}_c": change[a] for a, _ in pairs})
            through = tuple(s[name] - c.get(f"{name}_c", 0.0) for name in names)
            still = dict(zip(names, Stepper(model).rate(0.0, through, inputs)))
            carried = dict(zip(names, Stepper(model, None, _constant(environment)).rate(0.0, state, inputs)))
            for name in ("u", "v", "w", "p", "q", "r"):
                if name in names:
                    expected = still[name] + change.get(name, 0.0)
                    assert carried[name] == pytest.approx(expected, rel=1e-7, abs=1e-9), name

    def test_an_outside_force_pushes_its_way(self, model: Model) -> None:
        """Each force accelerates its own degree of freedom in its direction, and twice the force does so twice."""
        names = [channel.name for channel in model.states]
        rows = [
            (a, b) for a, b in (("u", "X"), ("v", "Y"), ("w", "Z"), ("p", "K"), ("q", "M"), ("r", "N")) if a in names
        ]
        if not model.takes_environment or not rows:
            pytest.skip("the model takes no outside force")
        state, inputs = self.samples(model, 1)[0]
        plain = Stepper(model).rate(0.0, state, inputs)
        for name, force in rows:
            k = names.index(name)
            once, twice = (
                Stepper(model, None, _constant(Environment(**{force: size}))).rate(0.0, state, inputs)[k] - plain[k]
                for size in (1e4, 2e4)
            )
            assert once > 0, force
            assert twice == pytest.approx(2 * once, rel=1e-6)

    def test_what_effects_ask_of_it(self, model: Model) -> None:
        """Its dimensions are lengths, a mass and a density; drag brakes and thrust is a number."""
        p = record("Parameters", model.parameters)(**model.nominal())
        if model.dimensions is not None:
            size = model.dimensions(p)
            assert all(math.isfinite(x) and x > 0 for x in size if x is not None), size
            assert size.length > size.draft
        e = Environment()
        for state, inputs in self.samples(model, 20):
            s, i = record("States", model.states)(*state), record("Inputs", model.inputs)(**inputs)
            if model.drag is not None:
                assert math.isfinite(model.drag(s, i, p, e))
                assert model.drag(s, i, p, e) * s.u >= 0.0
            if model.thrust is not None:
                assert math.isfinite(model.thrust(s, i, p, e))
            if model.thrusts is not None:
                forces = tuple(model.thrusts(s, i, p, e))
                named = [actuator.name for actuator in model.actuators if actuator.kind == "thruster"]
                assert len(forces) == len(named), f"thrusts gives {len(forces)} forces for the thrusters {named}"
                assert all(math.isfinite(force) for force in forces)

    def test_survives_pickling(self, model: Model) -> None:
        copy = pickle.loads(pickle.dumps(model))
        state, inputs = self.samples(model, 1)[0]
        assert Stepper(copy).rate(0.0, state, inputs) == Stepper(model).rate(0.0, state, inputs)

    def test_compiled_motion_is_the_plain_one(self, model: Model) -> None:
        trial, states = self.sailed(model)
        simulator = _simulator(model, trial)
        result = simulator.states(np.empty(0), states[:1])
        assert result == pytest.approx(states, rel=1e-9, abs=1e-11)
        simulated = simulator.outputs(np.empty((1, 0)), states[:1])
        assert not simulated.diverged.any()
        measured = np.array([trial.outputs[channel.name] for channel in model.outputs]).T
        assert simulated.y[0] == pytest.approx(measured, rel=1e-9, abs=1e-11)

    def test_derivatives_are_those_of_the_plain_motion(self, model: Model) -> None:
        """The engine's exact derivatives against central differences of the plain equations, parameter by parameter."""
        trial, states = self.sailed(model)
        free = tuple(p.name for p in model.parameters if p.value != 0.0)[-12:]
        nominal = model.nominal()
        theta = np.array([nominal[name] for name in free])
        result = _simulator(model, trial, free).jacobian(theta, states[:1], free_states=())
        for k, name in enumerate(free):
            h = 1e-5 * abs(nominal[name])
            ahead, behind = (self.replay(model, trial, states[0], {name: nominal[name] + x}) for x in (h, -h))
            expected = (ahead - behind) / (2 * h)
            scale = np.abs(expected).max()
            assert result.dy[:, :, k] == pytest.approx(expected, abs=1e-5 * scale + 1e-9 / h), name

    def sailed(self, model: Model) -> tuple[Trial, Array]:
        """A short trial under gently moved inputs, integrated in plain Python: the trial and its states (n, S)."""
        rng = np.random.default_rng(self.seed)
        t: Array = np.arange(41) * np.float64(0.1)
        inputs: dict[str, Array] = {}
        for channel in model.inputs:
            low, high = self._range(channel.name)
            middle, reach = 0.5 * (low + high), 0.2 * (high - low)
            inputs[channel.name] = middle + reach * np.sin(rng.uniform(0.5, 2.0) * t + rng.uniform(0.3, 1.2))
        bare = Trial("conformance", t, inputs, {}, synthetic=True)
        stepper = Stepper(model)
        known = {channel.name for channel in model.states}
        first = stepper.first({name: value for name, value in self.start.items() if name in known})
        states = self._states(stepper, bare, first)
        outputs = self._outputs(stepper, bare, states)
        named = {channel.name: outputs[:, k] for k, channel in enumerate(model.outputs)}
        return Trial("conformance", t, inputs, named, synthetic=True), states

    def replay(self, model: Model, trial: Trial, first: Array, values: Mapping[str, float]) -> Array:
        """Outputs (n, D) of the plain equations with changed parameter values."""
        stepper = Stepper(model, values)
        states = self._states(stepper, trial, tuple(first.tolist()))
        return self._outputs(stepper, trial, states)

    def _states(self, stepper: Stepper, trial: Trial, first: tuple[float, ...]) -> Array:
        rows = _rows(trial)
        states = [first]
        for k in range(len(trial) - 1):
            h = float(trial.t[k + 1] - trial.t[k])
            states.append(stepper.step(float(trial.t[k]), states[-1], rows[k], rows[k + 1], h))
        return np.array(states)

    def _outputs(self, stepper: Stepper, trial: Trial, states: Array) -> Array:
        result = [stepper.outputs(tuple(s), i) for s, i in zip(states.tolist(), _rows(trial))]
        return np.array([list(row.values()) for row in result])

    def samples(self, model: Model, size: int) -> list[tuple[tuple[float, ...], dict[str, float]]]:
        """Random states and inputs from the ranges."""
        rng = np.random.default_rng(self.seed)
        return [
            (
                tuple(float(rng.uniform(*self._range(c.name))) for c in model.states),
                {c.name: float(rng.uniform(*self._range(c.name))) for c in model.inputs},
            )
            for _ in range(size)
        ]

    def _range(self, name: str) -> tuple[float, float]:
        return self.ranges.get(name, RANGES.get(name, (-1.0, 1.0)))


def _rows(trial: Trial) -> list[dict[str, float]]:
    return [{name: float(values[k]) for name, values in trial.inputs.items()} for k in range(len(trial))]


def _simulator(model: Model, trial: Trial, free: tuple[str, ...] = ()) -> Any:
    """The engine on one trial, one Runge-Kutta step a sample."""
    engine = importlib.import_module("seatruth.simulate")
    if not hasattr(engine, "simulator"):
        pytest.skip("seatruth.simulate has no engine here, so there is nothing compiled to compare")
    return engine.simulator(model, [trial], free=free, values=model.nominal(), hold="foh")


def _constant(environment: Environment) -> Any:
    return lambda t, s: environment
