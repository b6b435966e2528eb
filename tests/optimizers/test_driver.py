"""The driver: counts, limits, failures, coordinates, history."""

from __future__ import annotations

import _thread
import itertools
import math
import threading
import time
from typing import Any

import numpy as np
import pytest

from seatruth.arrays import Array
from seatruth.errors import BadInput, SeatruthWarning
from seatruth.optimizers import Budget, Chain, Problem, Stop, from_callable, make, minimise
from seatruth.progress import ProgressEvent
from seatruth.testing.problems import Wrapped, ellipsoid, known_problems, rosenbrock


def solver(function: Any, needs: Any = ("values",)) -> Any:
    return from_callable(function, needs=needs, name="test_solver")


def random_search(problem: Problem, rng: np.random.Generator) -> str:
    while True:
        problem.values(problem.sample(rng, 50))


class TestCounts:
    def test_a_population_counts_its_size_and_a_jacobian_its_columns(self) -> None:
        known = ellipsoid("e", 5, 10.0)

        def run(problem: Problem, rng: np.random.Generator) -> str:
            problem.values(problem.sample(rng, 17))
            problem.value(problem.start)
            problem.residuals(problem.start)
            problem.jacobian(problem.start)
            return "done"

        outcome = minimise(known.cost, solver(run, ("residuals", "derivatives")))
        assert outcome.evaluations == 17 + 1 + 1 + 5
        assert (outcome.code, outcome.reason) == ("converged", "done")

    def test_a_solver_sees_what_it_has_spent_and_what_the_cost_gives(self) -> None:
        known = ellipsoid("e", 3, 10.0)
        seen: list[Any] = []

        def run(problem: Problem, rng: np.random.Generator) -> str:
            problem.values(problem.sample(rng, 17))
            seen.append((problem.names, problem.evaluations, problem.remaining))
            seen.append(problem.gives >= {"values", "residuals", "derivatives"})
            Z = problem.sample(rng, 4)
            np.testing.assert_allclose(problem.z_of(problem.x_of(Z)), Z)
            return "done"

        minimise(known.cost, solver(run), budget=Budget(100))
        assert seen == [(known.cost.names, 17, 83), True]

    def test_a_budget_within_a_population_evaluates_only_what_it_covers(self) -> None:
        seen: list[int] = []
        cost = Wrapped(rosenbrock().cost, lambda X: seen.append(len(X)))
        outcome = minimise(cost, solver(random_search), budget=Budget(120))
        assert seen == [50, 50, 20]
        assert (outcome.evaluations, outcome.code) == (120, "budget")

    def test_candidates_outside_are_moved_to_the_bound_and_counted(self) -> None:
        known = known_problems()[1]

        def run(problem: Problem, rng: np.random.Generator) -> str:
            values = problem.values(np.array([[2.0, 0.5], [1.0, 0.5], [-7.0, 9.0], [0.1, 0.2]]))
            assert values[0] == values[1]
            return "done"

        assert minimise(known.cost, solver(run)).clipped == 2

    def test_candidates_that_are_no_numbers_cost_inf_and_never_reach_the_cost(self) -> None:
        def check(X: Array) -> None:
            assert np.isfinite(X).all()

        def run(problem: Problem, rng: np.random.Generator) -> str:
            values = problem.values(np.array([[np.nan, 0.5], [0.5, 0.5], [np.nan, np.nan]]))
            assert list(np.isinf(values)) == [True, False, True]
            assert np.isinf(problem.residuals(np.array([np.nan, 0.0]))).all()
            return "done"

        outcome = minimise(Wrapped(rosenbrock().cost, check), solver(run))
        assert (outcome.evaluations, outcome.diverged) == (4, 3)

    def test_values_that_are_no_numbers_count_as_diverged(self) -> None:
        known = rosenbrock()

        class Broken(Wrapped):
            def values(self, X: Array) -> Array:
                return np.where(np.arange(len(X)) % 3 == 0, np.nan, np.where(np.arange(len(X)) % 3 == 1, -np.inf, 1.0))

        def run(problem: Problem, rng: np.random.Generator) -> str:
            problem.values(problem.sample(rng, 9))
            return ""

        outcome = minimise(Broken(known.cost, lambda x: None), solver(run))
        assert (outcome.diverged, outcome.value) == (6, 1.0)


class TestLimits:
    def test_stall(self) -> None:
        budget = Budget(evaluations=None, stall=500, tolerance=0.01)
        outcome = minimise(ellipsoid("e", 2, 1.0, low=-1, high=1).cost, solver(random_search), budget=budget)
        assert outcome.code == "stall"
        last = outcome.history.iloc[-1]
        before = outcome.history[outcome.history.evaluations <= outcome.evaluations - 500].best.iloc[-1]
        assert last.best >= before * 0.99

    def test_target(self) -> None:
        outcome = minimise(rosenbrock().cost, "differential_swarm", budget=Budget(target=1e-3))
        assert outcome.code == "target"
        assert outcome.value <= 1e-3
        assert outcome.evaluations < 20_000

    def test_deadline(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """On a clock that moves 0.1 s at each look, 2 s end after 20 looks; each batch of 50 takes at least one."""
        looks = itertools.count()
        monkeypatch.setattr(time, "perf_counter", lambda: 0.1 * next(looks))
        outcome = minimise(rosenbrock().cost, solver(random_search), budget=Budget(evaluations=None, seconds=2.0))
        assert outcome.code == "deadline"
        assert 0 < outcome.evaluations <= 20 * 50

    @pytest.mark.parametrize(
        "wrong",
        [
            {"evaluations": 0},
            {"evaluations": 2.5},
            {"seconds": -1.0},
            {"evaluations": None},
            {"tolerance": -1.0},
            {"target": math.nan},
            {"stall": True},
        ],
    )
    def test_a_budget_that_makes_no_sense_is_refused(self, wrong: dict[str, Any]) -> None:
        with pytest.raises(BadInput):
            Budget(**wrong)

    def test_a_solver_that_swallows_the_stop_is_told_again(self) -> None:
        def run(problem: Problem, rng: np.random.Generator) -> str:
            for _ in range(10):
                try:
                    problem.values(problem.sample(rng, 50))
                except BaseException:
                    continue
            return "finished after all"

        outcome = minimise(rosenbrock().cost, solver(run), budget=Budget(70))
        assert (outcome.code, outcome.evaluations) == ("budget", 70)

    def test_a_solver_that_answers_the_stop_with_an_error(self) -> None:
        def run(problem: Problem, rng: np.random.Generator) -> str:
            try:
                random_search(problem, rng)
            except Stop:
                raise RuntimeError("not my day") from None
            return ""

        assert minimise(rosenbrock().cost, solver(run), budget=Budget(70)).code == "budget"


class TestFailures:
    def test_a_solver_that_raises_fails_and_keeps_its_best(self) -> None:
        def run(problem: Problem, rng: np.random.Generator) -> str:
            problem.values(problem.sample(rng, 50))
            raise ZeroDivisionError("division by zero")

        outcome = minimise(rosenbrock().cost, solver(run))
        assert outcome.code == "failed"
        assert "test_solver" in outcome.reason
        assert "ZeroDivisionError: division by zero" in outcome.reason
        assert math.isfinite(outcome.value)
        assert "test_driver.py" in outcome.notes[0]

    def test_a_cost_that_raises_is_named(self) -> None:
        calls = 0

        def fail(x: Array) -> None:
            nonlocal calls
            calls += 1
            if calls == 3:
                raise ValueError("no such trial")

        outcome = minimise(Wrapped(rosenbrock().cost, fail), solver(random_search))
        assert outcome.code == "failed"
        assert "cost Wrapped" in outcome.reason
        assert "no such trial" in outcome.reason
        assert outcome.evaluations == 100

    def test_a_cost_of_which_nothing_can_be_evaluated_says_so(self) -> None:
        class Never(Wrapped):
            def values(self, X: Array) -> Array:
                return np.full(len(X), np.nan)

        outcome = minimise(Never(rosenbrock().cost, lambda x: None), "differential_swarm", budget=Budget(200))
        assert outcome.code == "failed"
        assert "none of the 200 candidates" in outcome.reason
        assert np.allclose(outcome.x, [-1.2, 1.0])

    def test_residuals_whose_square_is_no_number_have_diverged(self) -> None:
        seen: list[Any] = []

        def run(problem: Problem, rng: np.random.Generator) -> str:
            seen.append(problem.residuals(problem.start))
            return "done"

        class Far(Wrapped):
            def residuals(self, x: Array) -> Array:
                return np.array([1e200, 1.0])

        outcome = minimise(Far(rosenbrock().cost, lambda x: None), solver(run, ("residuals",)), budget=Budget(9))
        assert np.isinf(seen[0]).all()
        assert outcome.diverged == 1

    def test_a_budget_below_the_first_step_is_not_blamed_on_the_data(self) -> None:
        def run(problem: Problem, rng: np.random.Generator) -> str:
            problem.jacobian(problem.start)
            return "done"

        outcome = minimise(rosenbrock().cost, solver(run, ("residuals", "derivatives")), budget=Budget(1))
        assert (outcome.code, outcome.evaluations) == ("failed", 0)
        assert "no candidate was tried" in outcome.reason
        assert "larger budget" in outcome.reason

    def test_proposals_of_the_wrong_shape_are_named(self) -> None:
        def run(problem: Problem, rng: np.random.Generator) -> str:
            problem.value(problem.start)
            problem.values(np.zeros((3, 7)))
            return ""

        outcome = minimise(rosenbrock().cost, solver(run))
        assert "(3, 7)" in outcome.reason
        assert "(candidates, 2)" in outcome.reason

    def test_no_parameters_or_no_seed(self) -> None:
        cost = ellipsoid("e", 1, 1.0).cost
        with pytest.raises(BadInput, match="seed"):
            minimise(cost, seed=-1)
        cost.parameters = ()
        with pytest.raises(BadInput, match="no parameter varies"):
            minimise(cost)

    def test_a_cost_that_gives_too_little_names_the_optimizers_that_fit(self) -> None:
        less = Wrapped(rosenbrock().cost, lambda x: None, gives=frozenset({"values"}))
        with pytest.raises(BadInput, match=r"derivatives and residuals.*Optimizers that fit it: .*differential_swarm"):
            minimise(less, "least_squares")

    def test_a_real_interrupt_keeps_the_best(self) -> None:
        timer = threading.Timer(0.3, _thread.interrupt_main)
        timer.start()
        outcome = minimise(rosenbrock().cost, solver(random_search), budget=Budget(evaluations=None, seconds=20))
        assert outcome.code == "interrupted"
        assert math.isfinite(outcome.value)

    def test_a_progress_display_that_fails_does_not_end_the_run(self) -> None:
        def broken(*_: object) -> None:
            raise OSError("no terminal")

        with pytest.warns(SeatruthWarning, match="no terminal"):
            outcome = minimise(rosenbrock().cost, "differential_swarm", budget=Budget(500), progress=broken)
        assert outcome.evaluations == 500


class TestProgressAndHistory:
    def test_progress_ends_with_the_code(self) -> None:
        events: list[ProgressEvent] = []
        outcome = minimise(
            rosenbrock().cost,
            "differential_swarm",
            budget=Budget(5000),
            progress=events.append,
        )
        assert (events[-1].done, events[-1].total) == (outcome.evaluations, 5000)
        assert events[-1].message == outcome.code
        assert all(event.message == "" for event in events[:-1])

    def test_history_is_thinned_and_falls(self) -> None:
        def run(problem: Problem, rng: np.random.Generator) -> str:
            for _ in range(9000):
                problem.value(problem.sample(rng, 1)[0])
            return "done"

        outcome = minimise(rosenbrock().cost, solver(run))
        table = outcome.history
        assert 1000 <= len(table) <= 2001
        assert (table.best.diff().dropna() <= 0).all()
        assert table.evaluations.is_monotonic_increasing
        assert table.seconds.is_monotonic_increasing
        assert (table.evaluations.iloc[-1], table.best.iloc[-1]) == (outcome.evaluations, outcome.value)


class TestChain:
    def test_the_local_stage_starts_from_the_best_of_the_global_one(self) -> None:
        starts: list[float] = []

        def local(problem: Problem, rng: np.random.Generator) -> str:
            starts.append(problem.value(problem.start))
            assert starts[0] == problem.best_value
            return "polished"

        outcome = minimise(rosenbrock().cost, ["differential_swarm", solver(local)], budget=Budget(1000))
        assert outcome.code == "converged"
        assert "polished" in outcome.reason
        assert starts[0] == outcome.value
        assert outcome.evaluations == 751  # three quarters to the first, then one

    def test_a_stall_hands_over(self) -> None:
        chain = Chain((solver(random_search), make("least_squares")))
        outcome = minimise(rosenbrock().cost, chain, budget=Budget(evaluations=None, stall=400, tolerance=0.5))
        assert outcome.value < 1e-12
        assert "no improvement" in outcome.reason

    def test_the_whole_stays_within_the_budget(self) -> None:
        outcome = minimise(rosenbrock().cost, [solver(random_search)] * 3, budget=Budget(1000))
        assert (outcome.evaluations, outcome.code) == (1000, "budget")

    def test_one_stage_does_not_change_the_random_numbers_of_another(self) -> None:
        drawn: list[float] = []

        def greedy(n: int) -> Any:
            def run(problem: Problem, rng: np.random.Generator) -> str:
                problem.values(problem.sample(rng, n))
                return ""

            return solver(run)

        def last(problem: Problem, rng: np.random.Generator) -> str:
            drawn.append(rng.random())
            problem.value(problem.start)
            return ""

        for n in (1, 50):
            minimise(rosenbrock().cost, [greedy(n), solver(last)])
        assert drawn[0] == drawn[1]

    @pytest.mark.parametrize("shares", [(0.5, 0.2), (1.0,), (0.0,)])
    def test_shares_that_do_not_fit(self, shares: tuple[float, ...]) -> None:
        with pytest.raises(BadInput, match="shares"):
            Chain((make("nelder_mead"), make("newton")), shares)

    def test_empty_or_nested(self) -> None:
        with pytest.raises(BadInput):
            Chain(())
        with pytest.raises(BadInput):
            Chain((Chain((make("newton"),)),))
        with pytest.raises(BadInput):
            minimise(rosenbrock().cost, [])
