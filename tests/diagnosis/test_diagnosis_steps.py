"""Steps of fits: they fall, keep to their bounds, and follow curved valleys."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import small_case as small

import seatruth.diagnosis.steps as module
from seatruth.diagnosis.problem import Point, Problem
from seatruth.diagnosis.settings import Settings
from seatruth.diagnosis.sizes import Sizes, first_sizes, noise_prior
from seatruth.diagnosis.steps import Step, corrected, likelihood_at, objective, step, weighted_squares
from seatruth.models.base import Model
from seatruth.models.parameter import Parameter, Prior
from seatruth.study import Study
from seatruth.trials.channel import Channel
from seatruth.trials.trial import Trial, Trials

EFFECTS = ("rudder_offset",)


@pytest.fixture(scope="module")
def problem(ship_folder: Path, offset_runs: list[Trial]) -> Problem:
    return small.problem(ship_folder, offset_runs)


@pytest.fixture(scope="module")
def sizes(problem: Problem) -> Sizes:
    return first_sizes(problem, noise_prior(problem)).without_discrepancy()


def far(problem: Problem) -> Point:
    """A point from which a straight step leads far astray: half the time constant, twice the gain."""
    shared = problem.start.shared.copy()
    shared[problem.coefficients] *= (2.0, 0.5)
    return Point(shared, problem.start.initial, np.zeros_like(problem.start.forces))


def test_a_step_falls_by_what_it_says(problem: Problem, sizes: Sizes) -> None:
    at = problem.linearize(far(problem), EFFECTS, discrepancy=False)
    likelihood = likelihood_at(problem, at, sizes, EFFECTS)
    to, fall, damping, _ = step(problem, at, sizes, likelihood)
    values = [objective(problem, p, problem.errors(p), sizes, EFFECTS, likelihood) for p in (at.point, to)]
    assert fall == pytest.approx(values[0] - values[1], rel=1e-9)
    assert fall > 0.0
    assert damping == 0.0
    assert (to.shared >= problem.low).all()
    assert (to.shared <= problem.high).all()


class Bent:
    """A descent along which the model bends `bend` times as much as its derivatives say; 10 nats are promised."""

    def __init__(self, bend: float) -> None:
        self._bend, self.fall = bend, 10.0 * (2.0 - bend)

    def promised(self, *_: object) -> float:
        return 10.0

    def simulated(self, part: float) -> bool:
        fall = 10.0 * (2.0 * part - self._bend * part * part)
        better = fall > self.fall
        self.fall = max(fall, self.fall)
        return better


@pytest.mark.parametrize(
    ("bend", "part"), [(1.6, 1 / 1.6), (1.0, 1.0), (1.1, 1.0), (0.6, 1 / 0.6), (0.2, 2.0), (-0.5, 2.0), (1.9, 1 / 1.9)]
)
def test_a_whole_step_goes_on_to_the_lowest_point_of_its_parabola(bend: float, part: float) -> None:
    nothing: Any = SimpleNamespace(moved=lambda *_: None, point=None, shared=None, local=None)
    valley: Any = Bent(bend)
    way: Any = float  # the part itself stands for its point
    found = module._to_the_lowest(valley, nothing, nothing, nothing, way)
    assert found == pytest.approx(part)
    assert valley.fall == pytest.approx(10.0 * (2.0 * part - bend * part * part))


def test_a_part_of_a_step_stays_what_it_is(problem: Problem, sizes: Sizes, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the whole step is of no use, nothing is told of its length."""
    at = problem.linearize(far(problem), EFFECTS, discrepancy=False)
    likelihood = likelihood_at(problem, at, sizes, EFFECTS)
    whole, found = likelihood.solve(sizes, EFFECTS), module._Descent(problem, at, sizes, likelihood)
    monkeypatch.setattr(module, "_PARTS", (0.2,))
    assert module._useful_part(found, problem, at, sizes, whole) == 0.2


def test_a_step_leads_back_from_where_the_model_diverges(
    problem: Problem, sizes: Sizes, monkeypatch: pytest.MonkeyPatch
) -> None:
    at = problem.linearize(far(problem), EFFECTS, discrepancy=False)
    likelihood = likelihood_at(problem, at, sizes, EFFECTS)
    monkeypatch.setattr(module, "_DIVERGED", 0.99 * float(np.abs(at.errors).max()))
    taken = step(problem, at, sizes, likelihood)
    assert taken.fall == np.inf
    assert np.isfinite(objective(problem, taken.point, problem.errors(taken.point), sizes, EFFECTS, likelihood))
    # Nothing is lower where everything diverges.
    monkeypatch.setattr(module, "_DIVERGED", 0.0)
    assert step(problem, at, sizes, likelihood)[1:] == (0.0, 0.0, 0.0)


def test_corrections_come_nearer_to_where_the_step_was_to_lead(problem: Problem, sizes: Sizes) -> None:
    at = problem.linearize(far(problem), EFFECTS, discrepancy=False)
    likelihood = likelihood_at(problem, at, sizes, EFFECTS)
    whole = likelihood.solve(sizes, EFFECTS)
    linear = at.errors + 0.2 * (
        at.shared @ whole.shared + np.einsum("nl,nl->n", at.local, whole.local[problem.trial_of])
    )
    left = []
    for point, errors in corrected(problem, at, sizes, likelihood, whole, 0.2):
        np.testing.assert_array_equal(errors, problem.errors(point))
        left.append(weighted_squares(problem, errors - linear, sizes))
    assert len(left) >= 3
    assert left[-1] < 0.01 * left[0]


class Valley(Model):
    """Two rates of which one sees sharply how far the parameters are off a parabola (Rosenbrock 1960)."""

    name = "valley"
    title = "curved valley"
    states = (Channel("x", "m"), Channel("y", "m"))
    inputs = (Channel("push", "1"),)
    outputs = (Channel("x", "m"), Channel("y", "m"))
    parameters = (
        Parameter("a", -1.0, "m/s", min=-5.0, max=5.0, vary=True),
        Parameter("b", 1.0, "m/s", min=-20.0, max=20.0, vary=True),
    )

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> Any:
        return p.a * i.push, 1000.0 * (p.b - p.a * p.a) * i.push


def walked(steps: int) -> tuple[float, list[float]]:
    """Where `a` is after so many steps along the valley, and the damping that each of them hands on."""
    t, rng = np.arange(20.0), np.random.default_rng(0)
    outputs = {"x": t + 0.1 * rng.normal(size=20), "y": 0.1 * rng.normal(size=20)}
    trial = Trial("run", t, {"push": np.ones(20)}, outputs, synthetic=True)
    wide = tuple(q.replace(prior=Prior(q.value, 10.0)) for q in Valley.parameters)
    study = Study(name="valley", model=Valley(), trials=Trials([trial]), parameters=wide)
    problem = Problem(study, [], Settings(), threads=1)
    nothing = np.zeros(0)
    sizes = Sizes(np.log([0.1, 0.1]), (0, 0), nothing, nothing, nothing)
    point, names = problem.start, [q.name for q in problem.unknowns]
    taken: Step | None = None
    dampings = []
    for _ in range(steps):
        at = problem.linearize(point, (), discrepancy=False)
        taken = step(problem, at, sizes, likelihood_at(problem, at, sizes, ()), taken)
        point = taken.point
        dampings.append(taken.damping)
    return float(point.shared[names.index("a")]), dampings


@pytest.mark.parametrize("corrections", [0, module._CORRECTIONS])
def test_corrected_steps_follow_a_curved_valley(corrections: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Straight steps leave it at once; the truth is at a = 1."""
    monkeypatch.setattr(module, "_CORRECTIONS", corrections)
    monkeypatch.setattr(module, "_SMALL_PART", 0.0)
    reached, dampings = walked(8)
    assert not any(dampings)
    assert reached == pytest.approx(1.0, abs=0.02) if corrections else reached < 0.5


def test_steps_that_are_held_back_follow_it_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where corrections do not, as of long runs that bend by more than their first order tells."""
    monkeypatch.setattr(module, "_CORRECTIONS", 0)
    reached, dampings = walked(8)
    monkeypatch.setattr(module, "_SMALL_PART", 0.0)
    straight, _ = walked(8)
    assert max(dampings) > 1.0
    assert reached + 1.0 > 2.0 * (straight + 1.0)
