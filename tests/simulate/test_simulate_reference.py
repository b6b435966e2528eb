"""Every compiled kernel against the reference backend: plain Python, the same steps, derivatives by differences."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pytest
from known_models import Blowing, Lag, plain_model, record_of

from seatruth.arrays import Array
from seatruth.effects import available as available_effects
from seatruth.effects import effects_by_name, with_effects
from seatruth.errors import BadInput, PluginError
from seatruth.models import available as available_models
from seatruth.models import load_model
from seatruth.models.base import Model
from seatruth.simulate import Hold, Jacobian, Simulator, evaluate_rhs, evaluate_rhs_jacobian, serial, simulator
from seatruth.simulate.serial import RELATIVE_STEP
from seatruth.trials.trial import Trial

pytestmark = pytest.mark.slow

# Effects that use every hook and most kinds of node: own states, delays, limits, branches, time, surroundings.
EFFECTS: Sequence[tuple[str, tuple[str, ...]]] = (
    ("mmg", ("current", "rudder_lag", "heading_bias", "added_mass")),
    ("mmg", ("rudder_dead_band", "rudder_rate_limit", "position_delay")),
    ("mmg", ("rudder_backlash", "shallow_water", "propeller_walk", "speed_scale")),
    ("abkowitz", ("varying_current", "wave_forces", "rate_delay", "compass_deviation")),
    ("diving_plane", ("depth_lag", "net_weight", "flooding", "cross_flow_vertical", "plane_gain", "pitch_delay")),
)
CANDIDATES = 17
"""More than one block of the widest kind, so that kernels of both widths run."""
START: Mapping[str, float] = {"u": 1.2, "v": 0.05, "w": 0.03, "r": 0.01, "q": 0.01, "psi": 0.3, "theta": 0.05}
LARGEST: Mapping[str, float] = {"n": 10.0}
"""Of inputs that are no angles."""


def case(name: str, effects: Sequence[str]) -> tuple[Model, dict[str, float], tuple[str, ...]]:
    """A model with effects at typical magnitudes, all values, and some parameters to set free."""
    base = load_model(name)
    chosen = effects_by_name(effects, available_effects())
    model = with_effects(base, chosen)
    own = {effect.named(q): value for effect in chosen for q, value in effect.typical(base).items()}
    free = [q.name for q in base.parameters if q.value][-4:] + list(own)[:4]
    return model, {**model.nominal(), **own}, tuple(free)


def trials_of(model: Model, seed: int = 1) -> list[Trial]:
    """Two short trials: uneven samples, a gap, inputs that jump, outputs with holes; a channel not recorded."""
    rng = np.random.default_rng(seed)
    made = []
    for name, t in (
        ("uneven", np.cumsum([0.0, 0.1, 0.1, 0.13, 0.1, 0.07, 0.1, 0.45, 0.1, 0.1])),
        ("late", 3.0 + 0.1 * np.arange(7)),
    ):
        inputs = {}
        for channel in model.inputs:
            size = LARGEST.get(channel.name, 0.2)
            jump = np.where(np.arange(t.size) < t.size // 2, 0.6, 1.0)
            inputs[channel.name] = size * jump * (1.0 + 0.1 * rng.normal(size=t.size))
        outputs = {}
        for channel in model.outputs:
            column = START.get(channel.name, 0.0) + 0.01 * rng.normal(size=t.size)
            column[rng.integers(1, t.size)] = math.nan
            outputs[channel.name] = column
        if name == "late":
            outputs.pop(model.outputs[-1].name)
        made.append(Trial(name, t, inputs, outputs, synthetic=True))
    return made


def both(model: Model, trials: Sequence[Trial], **options: Any) -> tuple[Simulator, Simulator]:
    reference = simulator(model, trials, backend="reference", **options)
    return simulator(model, trials, threads=1, **options), reference


def derivatives(jacobian: Jacobian) -> list[Array]:
    """Each column of the Jacobian: the derivative of all outputs and last states by one variable."""
    return list(np.concatenate([_flat(jacobian.dy), _flat(jacobian.dx_end)]).T)


def _flat(values: Array) -> Array:
    return values.reshape(-1, values.shape[-1])


def tolerances(slopes: Jacobian, theta: Array, relative_step: float = RELATIVE_STEP) -> list[float]:
    """Of each column: truncation of the central difference, and rounding of the values over its step."""
    level = max(np.abs(slopes.y).max(), np.abs(slopes.x_end).max(), 1.0)
    columns = derivatives(slopes)
    sizes = [*np.where(theta == 0.0, 1.0, np.abs(theta)), *([1.0] * (len(columns) - len(theta)))]
    return [
        2e-8 * np.abs(column).max() + 1e-14 * level / (relative_step * size) for column, size in zip(columns, sizes)
    ]


def smooth_candidate(
    reference: Simulator, theta: Array, x0: Array, free_states: Sequence[str]
) -> tuple[Array, Array, Jacobian]:
    """The first candidate that crosses no branch of the equations (a relay, a side of the flow) within the steps of
    its differences: those with a quarter of the step are the same.
    """
    for one, start in zip(theta, np.broadcast_to(x0, (len(theta), *x0.shape[-2:]))):
        slopes = reference.jacobian(one, start, free_states)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(serial, "RELATIVE_STEP", RELATIVE_STEP / 4)
            finer = reference.jacobian(one, start, free_states)
        apart = [np.abs(a - b).max(initial=0.0) for a, b in zip(derivatives(slopes), derivatives(finer))]
        if all(a <= most for a, most in zip(apart, tolerances(slopes, one, RELATIVE_STEP / 4))):
            return one, start, slopes
    pytest.fail("no candidate is smooth")


def agree(compiled: Simulator, reference: Simulator, theta: Array, x0: Array, free_states: Sequence[str]) -> None:
    """Outputs, states, costs, last states, Jacobians and what is known before the first run."""
    assert compiled.steps == reference.steps
    assert compiled.rows == reference.rows
    assert compiled.assumed_zero == reference.assumed_zero
    assert np.array_equal(compiled.initial_states, reference.initial_states)
    assert np.array_equal(compiled.measured, reference.measured, equal_nan=True)

    ours, plain = compiled.outputs(theta, x0), reference.outputs(theta, x0)
    assert not plain.diverged.any()
    assert not ours.diverged.any()
    assert ours.y == pytest.approx(plain.y, rel=1e-9, abs=1e-11)
    assert ours.x_end == pytest.approx(plain.x_end, rel=1e-9, abs=1e-11)
    first = x0 if x0.ndim == 2 else x0[0]
    assert compiled.states(theta[0], first) == pytest.approx(reference.states(theta[0], first), rel=1e-9, abs=1e-11)

    weights = np.random.default_rng(5).uniform(0.5, 2.0, compiled.measured.shape)
    costs, plain_costs = (sim.squared_errors(theta, x0, weights) for sim in (compiled, reference))
    assert costs.sums == pytest.approx(plain_costs.sums, rel=1e-8, abs=1e-12)
    assert costs.x_end == pytest.approx(plain_costs.x_end, rel=1e-9, abs=1e-11)

    chosen, start, slopes = smooth_candidate(reference, theta, x0, free_states)
    exact = compiled.jacobian(chosen, start, free_states)
    assert exact.y == pytest.approx(slopes.y, rel=1e-9, abs=1e-11)
    assert exact.x_end == pytest.approx(slopes.x_end, rel=1e-9, abs=1e-11)
    assert not exact.diverged.any()
    for one, other, tolerance in zip(derivatives(exact), derivatives(slopes), tolerances(slopes, chosen)):
        assert np.abs(one - other).max(initial=0.0) <= tolerance

    halved, plain_halved = (sim.discretisation_error(theta[0], first) for sim in (compiled, reference))
    assert halved == pytest.approx(plain_halved, rel=1e-3, abs=1e-12)


def compare(model: Model, values: Mapping[str, float], free: tuple[str, ...], hold: Hold) -> None:
    rng = np.random.default_rng(4)
    trials = trials_of(model)
    pair = both(model, trials, free=free, values=values, hold=hold, max_step=0.06)
    theta = np.array([values[name] for name in free]) * rng.uniform(0.97, 1.03, (CANDIDATES, len(free)))
    x0 = pair[0].initial_states + 0.01 * rng.uniform(-1.0, 1.0, (CANDIDATES, *pair[0].initial_states.shape))
    visible = [channel.name for channel in model.states if channel.name not in model.hidden]
    agree(*pair, theta, x0, visible[:4])


@pytest.mark.parametrize("hold", ["foh", "zoh"])
@pytest.mark.parametrize("name", sorted(available_models()))
def test_every_model(name: str, hold: Hold) -> None:
    model, values, free = case(name, ())
    compare(model, values, free, hold)


@pytest.mark.parametrize(("name", "effects"), EFFECTS, ids=lambda x: x if isinstance(x, str) else "+".join(x))
def test_models_with_effects(name: str, effects: tuple[str, ...]) -> None:
    model, values, free = case(name, effects)
    compare(model, values, free, "foh")


@pytest.mark.parametrize("name", sorted(available_models()))
def test_rates_on_rows(name: str) -> None:
    model, values, free = case(name, ())
    rng = np.random.default_rng(7)
    centre = np.array([START.get(channel.name, 0.0) for channel in model.states])
    states = centre + 0.02 * rng.uniform(-1.0, 1.0, (11, centre.size))
    inputs = np.array([LARGEST.get(c.name, 0.2) for c in model.inputs]) * rng.uniform(0.8, 1.2, (11, len(model.inputs)))
    theta = np.array([values[q] for q in free]) * rng.uniform(0.97, 1.03, (3, len(free)))
    t = np.linspace(0.0, 2.0, 11)
    ours = evaluate_rhs(model, theta, free, values, states, inputs, t)
    plain = evaluate_rhs(model, theta, free, values, states, inputs, t, backend="reference")
    assert ours == pytest.approx(plain, rel=1e-10, abs=1e-12)
    exact = evaluate_rhs_jacobian(model, theta[0], free, values, states, inputs, t)
    slopes = evaluate_rhs_jacobian(model, theta[0], free, values, states, inputs, t, backend="reference")
    for k, value in enumerate(theta[0]):
        tolerance = 1e-7 * np.abs(slopes[:, :, k]).max() + 1e-14 * np.abs(plain).max() / (RELATIVE_STEP * abs(value))
        assert exact[:, :, k] == pytest.approx(slopes[:, :, k], abs=tolerance), free[k]


def test_a_step_of_the_input_between_steps_of_the_simulation() -> None:
    """Inputs jump at samples that no multiple of the longest step meets."""
    t = np.array([0.0, 0.3, 0.37, 1.0, 1.9, 2.0])
    trial = record_of(t, lambda x: (x >= 0.37).astype(float), x=np.zeros(6), angle=np.zeros(6))
    for hold in ("foh", "zoh"):
        pair = both(Lag(), [trial], free=("k", "T"), hold=hold, max_step=0.11)
        agree(*pair, np.array([[1.5, 2.0], [1.0, 0.7]]), pair[0].initial_states, ("x", "angle"))


def test_a_hidden_state_moves_with_the_state_that_it_follows() -> None:
    """The column of a free heading has the delayed heading in it."""
    model, values, _ = case("mmg", ("heading_delay",))
    assert model.follows
    pair = both(model, trials_of(model), values=values)
    agree(*pair, np.zeros((1, 0)), pair[0].initial_states, ("psi", "u"))


def test_conditions_of_every_level() -> None:
    """On parameters, inputs, time and states; as numbers, as branches, and as outputs of the step."""

    def rates(s: Any, i: Any, p: Any, e: Any) -> Any:
        gate = np.where(i.push > 0.5, e.t > 0.3, e.t > 0.9)
        forward = (s.x > 0) - (s.x < 0)
        return p.a * gate - 0.1 * forward * (p.a > 0.5) - 0.2 * s.x, s.x if gate else (i.push > 0.7) * s.y, i.push > 0.6

    model = plain_model(rates, ("x", "y", "z"), ("a",), ("push",))
    t = np.arange(15) * 0.1
    outputs = dict.fromkeys(("x", "y", "z"), 0.2 + 0.1 * t)
    for hold in ("foh", "zoh"):
        pair = both(model, [record_of(t, lambda x: 0.55 + 0.2 * np.sin(4 * x), **outputs)], free=("a",), hold=hold)
        agree(*pair, np.linspace(0.6, 1.4, 9)[:, None], pair[0].initial_states, ("x", "y"))


def test_divergence() -> None:
    trials = [record_of(np.linspace(0.0, 2.0, 41), x=np.ones(41)), record_of(np.linspace(0.0, 0.5, 11), name="short")]
    theta = np.array([[0.1], [1.0], [-1.0], [50.0], [math.nan]])
    pair = both(Blowing(), trials, free=("a",))
    ours, plain = (sim.squared_errors(theta, np.ones((2, 1)), np.ones((52, 1))) for sim in pair)
    assert ours.diverged.tolist() == plain.diverged.tolist()
    assert ours.sums == pytest.approx(plain.sums, rel=1e-10)
    assert [sim.jacobian(np.array([50.0]), np.ones((2, 1))).diverged.tolist() for sim in pair] == [[True, True]] * 2


@pytest.mark.parametrize(
    "rates",
    [
        lambda s, i, p: (math.sqrt(s.x - 2.0),),
        lambda s, i, p: (1.0 / (s.x - s.x),),
        lambda s, i, p: ((s.x - 2.0) ** 0.5,),
        lambda s, i, p: (math.exp(1e4 * s.x),),
    ],
)
def test_what_python_cannot_compute_has_diverged(rates: Any) -> None:
    """Python raises, or gives a complex number, where compiled code gives NaN or infinity."""
    for sim in both(plain_model(rates, ("x",)), [record_of(np.arange(4.0))]):
        assert sim.outputs(np.zeros((1, 0)), np.ones((1, 1))).diverged.all()


def test_a_broken_model_is_said() -> None:
    sim = simulator(plain_model(lambda s, i, p: (s.y,), ("x",)), [record_of(np.arange(4.0))], backend="reference")
    with pytest.raises(PluginError, match="rhs raised AttributeError"):
        sim.outputs(np.zeros((1, 0)), np.ones((1, 1)))


def test_an_unknown_backend_is_said() -> None:
    with pytest.raises(BadInput, match="Did you mean 'compiled'"):
        simulator(Lag(), [record_of(np.arange(4.0), np.ones_like)], backend="compile")
    with pytest.raises(BadInput, match="Did you mean 'reference'"):
        evaluate_rhs(Lag(), np.zeros(0), (), Lag().nominal(), np.ones((1, 2)), np.ones((1, 1)), backend="referenc")
