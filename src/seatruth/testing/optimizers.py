"""The conformance suite of optimizers. A third party's tests are

    from seatruth.testing.optimizers import OptimizerConformance

    class TestMine(OptimizerConformance):
        @pytest.fixture
        def optimizer(self):
            return Mine(batch=20)

and inherit every check below. What a solver cannot reach is stated on the class (`tolerance`, `tolerances`, `skip`),
where a reader sees it.
"""

from __future__ import annotations

import json
import math
import random
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import fields, replace
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest

from seatruth.arrays import Array
from seatruth.costs.base import Ability, Cost
from seatruth.errors import BadInput
from seatruth.optimizers import Budget, Chain, Coordinates, Evaluator, Optimizer, Outcome, Problem, Stop, minimise
from seatruth.testing.problems import Known, Wrapped, known_problems

NAMES = tuple(known.name for known in known_problems())


class OptimizerConformance:
    """Checks that every optimizer must pass; see the module for how to inherit them.

    `evaluations` is the budget a problem; `tolerance` the part of the start's excess cost over the minimum that may be
    left after it, `tolerances` the same for single problems by name; `skip` names problems outside the solver's reach
    with the reason.
    """

    evaluations: ClassVar[int] = 20_000
    tolerance: ClassVar[float] = 1e-8
    tolerances: ClassVar[Mapping[str, float]] = {}
    skip: ClassVar[Mapping[str, str]] = {}

    @pytest.fixture
    def optimizer(self) -> Optimizer:
        """The optimizer under test; every inheriting class gives its own."""
        pytest.fail(f"{type(self).__name__} needs a fixture `optimizer`", pytrace=False)

    @pytest.mark.parametrize("name", NAMES)
    def test_reaches_the_minimum(self, optimizer: Optimizer, name: str) -> None:
        if name in self.skip:
            pytest.skip(self.skip[name])
        known = next(k for k in known_problems() if k.name == name)
        self._need(optimizer, known.cost)
        outcome = minimise(known.cost, optimizer, budget=Budget(self.evaluations), seed=1)
        start = float(known.cost.values(known.cost.start[None])[0])
        left = (outcome.value - known.value) / (start - known.value)
        assert outcome.code in ("converged", "budget", "stall"), outcome.reason
        assert left <= self.tolerances.get(name, self.tolerance), f"{left:.2e} of the excess is left: {outcome}"
        assert outcome.value == pytest.approx(float(known.cost.values(outcome.x[None])[0]), rel=1e-12)

    def test_same_seed_same_bytes(self, optimizer: Optimizer) -> None:
        known = self._known(optimizer)
        first, second = (self._run(optimizer, known.cost, seed=7) for _ in range(2))
        assert first.same_as(second)

    def test_other_workers_do_not_matter(self, optimizer: Optimizer) -> None:
        known = self._known(optimizer)
        alone = [self._run(optimizer, known.cost, seed=seed) for seed in range(4)]
        with ThreadPoolExecutor(4) as pool:
            together = list(pool.map(lambda seed: self._run(optimizer, known.cost, seed=seed), range(4)))
        assert all(a.same_as(b) for a, b in zip(alone, together))

    def test_touches_no_global_generator(self, optimizer: Optimizer) -> None:
        known = self._known(optimizer)
        first = self._run(optimizer, known.cost)
        np.random.seed(123)  # noqa: NPY002 - the global generator is what must not matter
        random.seed(123)
        before, plain = np.random.get_state(legacy=False), random.getstate()  # noqa: NPY002
        second = self._run(optimizer, known.cost)
        after = np.random.get_state(legacy=False)  # noqa: NPY002
        assert first.same_as(second), "it draws from a global generator"
        assert isinstance(before, dict)
        assert isinstance(after, dict)
        assert np.array_equal(before["state"]["key"], after["state"]["key"])
        assert before["state"]["pos"] == after["state"]["pos"]
        assert plain == random.getstate()

    def test_stays_within_the_bounds(self, optimizer: Optimizer) -> None:
        known = self._known(optimizer, "at_bound")
        low, high = known.cost.bounds
        seen: list[Array] = []
        outcome = self._run(optimizer, Wrapped(known.cost, lambda x: seen.append(np.atleast_2d(x).copy())))
        tried = np.vstack([*seen, outcome.x])
        assert (tried >= low).all()
        assert (tried <= high).all()

    @pytest.mark.parametrize("evaluations", [1, 7, 60, 333])
    def test_keeps_to_its_budget(self, optimizer: Optimizer, evaluations: int) -> None:
        known = self._known(optimizer)
        spent = 0

        def count(x: Array) -> None:
            nonlocal spent
            spent += len(np.atleast_2d(x))

        outcome = minimise(Wrapped(known.cost, count), optimizer, budget=Budget(evaluations), seed=2)
        assert spent <= outcome.evaluations <= evaluations

    def test_changes_nothing_that_it_is_given(self, optimizer: Optimizer) -> None:
        known = self._known(optimizer)
        before, parameters = optimizer.describe(), known.cost.parameters

        def spoil(x: Array) -> None:
            held.append((x, x.copy()))

        held: list[tuple[Array, Array]] = []
        self._run(optimizer, Wrapped(known.cost, spoil))
        assert all(np.array_equal(now, then) for now, then in held), "candidates were changed after their evaluation"
        assert optimizer.describe() == before
        assert known.cost.parameters == parameters

    def test_lets_the_stop_through(self, optimizer: Optimizer) -> None:
        known = self._known(optimizer)
        evaluator = Evaluator(known.cost, Coordinates(known.cost.parameters), Budget(seconds=1e-9))
        with pytest.raises(Stop) as stop:
            optimizer.run(Problem(evaluator), np.random.default_rng(0))
        assert stop.value.code == "deadline"

    def test_keeps_the_best_when_interrupted(self, optimizer: Optimizer) -> None:
        known = self._known(optimizer)
        outcome = self._run(optimizer, Wrapped(known.cost, _interrupt_at(3)))
        assert outcome.code in ("interrupted", "converged")  # a closed form may need fewer calls than that
        assert math.isfinite(outcome.value)

    @pytest.mark.parametrize("call", [1, 2, 5, 23])
    def test_resumes_with_the_same_result(self, optimizer: Optimizer, tmp_path: Path, call: int) -> None:
        known = self._known(optimizer)
        whole = self._run(optimizer, known.cost)
        file = tmp_path / "run.checkpoint"
        self._run(optimizer, Wrapped(known.cost, _interrupt_at(call)), checkpoint=file)
        with open(file, "ab") as stream:
            stream.write(b"strR half a record, as a kill leaves it")
        calls: list[Array] = []
        resumed = self._run(optimizer, Wrapped(known.cost, calls.append), checkpoint=file)
        again = self._run(optimizer, Wrapped(known.cost, calls.append), checkpoint=file)
        assert whole.same_as(resumed)
        assert whole.same_as(again)

    def test_survives_a_cost_that_always_diverges(self, optimizer: Optimizer) -> None:
        known = self._known(optimizer)
        outcome = self._run(optimizer, _Diverging(known.cost))
        assert outcome.code == "failed"
        assert outcome.reason
        assert np.allclose(outcome.x, known.cost.start) or "regression" in optimizer.needs
        assert outcome.diverged > 0

    def test_is_refused_a_cost_that_gives_too_little(self, optimizer: Optimizer) -> None:
        known = self._known(optimizer)
        for need in sorted(optimizer.needs):
            less = Wrapped(known.cost, lambda x: None, gives=known.cost.gives - {need})
            with pytest.raises(BadInput, match=need):
                minimise(less, optimizer, seed=0)

    def test_describes_itself(self, optimizer: Optimizer) -> None:
        assert optimizer.name.isidentifier()
        assert optimizer.title
        assert optimizer.needs
        assert json.loads(json.dumps(optimizer.describe()))["name"] == optimizer.name
        if not isinstance(optimizer, Chain):
            assert replace(optimizer) == optimizer
            undocumented = [field.name for field in fields(optimizer) if not field.metadata.get("doc")]
            assert not undocumented, f"options without a word on what they do: {undocumented}"

    def _known(self, optimizer: Optimizer, name: str = "") -> Known:
        """A problem that the optimizer can solve: the named one if it can, else the first."""
        fit = [known for known in known_problems() if optimizer.needs <= known.cost.gives]
        assert fit, f"no test problem gives {sorted(optimizer.needs)}"
        order = (name, "rosenbrock", "linear_regression")
        return next(known for wanted in order for known in fit if known.name == wanted)

    def _run(self, optimizer: Optimizer, cost: Cost, seed: int = 3, checkpoint: Path | None = None) -> Outcome:
        """A short run."""
        return minimise(cost, optimizer, budget=Budget(700), seed=seed, checkpoint=checkpoint)

    @staticmethod
    def _need(optimizer: Optimizer, cost: Cost) -> None:
        missing: frozenset[Ability] = optimizer.needs - cost.gives
        if missing:
            pytest.skip(f"needs {', '.join(sorted(missing))}, which this problem does not give")


class _Diverging(Wrapped):
    """A cost that is infinite everywhere."""

    def __init__(self, inner: Cost) -> None:
        super().__init__(inner, lambda x: None)

    def values(self, X: Array) -> Array:
        return np.full(len(X), np.inf)

    def residuals(self, x: Array) -> Array:
        return np.full_like(self.inner.residuals(x), np.inf)

    def residuals_of(self, X: Array) -> Array:
        return np.full_like(self.inner.residuals_of(X), np.inf)


def _interrupt_at(call: int) -> Callable[[Array], None]:
    """Raises KeyboardInterrupt at this call of the cost."""
    calls = 0

    def before(x: Array) -> None:
        nonlocal calls
        calls += 1
        if calls == call:
            raise KeyboardInterrupt

    return before
