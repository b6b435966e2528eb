"""Fits and evidence on a linear problem, where everything is known in closed form, and what follows from evidence."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.special import logsumexp
from scipy.stats import multivariate_normal

from seatruth.diagnosis.evidence import SCALES
from seatruth.diagnosis.fit import effect_screen, fit
from seatruth.diagnosis.hypotheses import Search
from seatruth.diagnosis.posterior import (
    APART,
    SURE,
    TEMPERATURE,
    Candidate,
    apart,
    candidates,
    detectable,
    inclusion,
    lambda_of,
    powerless,
    verdict,
)
from seatruth.diagnosis.problem import Linear

SD = np.array([0.5, 2.0, 1.0, 1.5, 0.7])
MEAN = np.array([0.2, 0.0, 0.0, 0.0, 0.0])


class LinearProblem:
    """e = y - A x with unit noise: one coefficient (column 0), effects "a" (1, 2), "b" (3), "c" (4)."""

    def __init__(self, A: np.ndarray, y: np.ndarray) -> None:
        self.A, self.y = A, y
        self.size, self.rows = A.shape[1], len(y)
        self.mean, self.sd, self.start = MEAN, SD, MEAN.copy()
        self.low, self.high = np.full(self.size, -np.inf), np.full(self.size, np.inf)
        self.effects: dict[str, Any] = {
            name: SimpleNamespace(parameters=[SimpleNamespace(name=f"q{k}") for k in range(n)])
            for name, n in (("a", 2), ("b", 1), ("c", 1))
        }
        self.columns = {"a": np.array([1, 2]), "b": np.array([3]), "c": np.array([4])}
        self.nuisance = np.array([0])

    def active(self, effects: Sequence[str]) -> np.ndarray:
        return np.sort(np.concatenate([self.nuisance, *(self.columns[name] for name in effects)]))

    def whitened(self, x: np.ndarray, floor: Any, active: np.ndarray, without: int | None = None) -> np.ndarray:
        return self.y - self.A @ x

    def linear(self, x: np.ndarray, floor: Any, active: np.ndarray, without: int | None = None) -> Linear:
        return Linear(x, self.whitened(x, floor, active), -self.A[:, active])

    def whole(self, x: np.ndarray, floor: Any) -> np.ndarray:
        return -self.A


def problem(seed: int = 0, x: Sequence[float] = (0.4, 1.0, -0.5, 0.0, 0.0), twins: bool = False) -> Any:
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(60, 5)) * np.array([3.0, 1.0, 1.0, 1.0, 1.0])
    A[:, 1] += 0.5 * A[:, 0]
    if twins:
        A[:, 4] = 2.0 * A[:, 3] + 0.01 * rng.normal(size=60)
    return LinearProblem(A, A @ np.array(x) + rng.normal(size=60))


def searched(found: Any, hypotheses: Sequence[tuple[str, ...]]) -> Search:
    search = Search(found, None)  # a linear problem needs no floor
    for key in ((), *hypotheses):
        search.fits[key] = fit(found, key, None, found.start)
    search.screens[()] = effect_screen(search.base, found, None)
    return search


@pytest.mark.parametrize("effects", [(), ("a",), ("b",), ("a", "c"), ("a", "b", "c")])
def test_evidence_is_the_marginal_likelihood(effects: tuple[str, ...]) -> None:
    """Up to the constant of the noise: log N(y; A mean, I + A P A'), averaged over the scales of the effects."""
    p = problem()
    got = fit(p, effects, None, p.start)
    free = p.active(effects)
    found = []
    for scales in itertools.product(SCALES, repeat=len(effects)):
        sd = SD.copy()
        for name, scale in zip(effects, scales):
            sd[p.columns[name]] *= scale
        covariance = np.eye(p.rows) + p.A[:, free] @ np.diag(sd[free] ** 2) @ p.A[:, free].T
        found.append(multivariate_normal(p.A @ MEAN, covariance).logpdf(p.y))
    exact = logsumexp(found) - np.log(len(found))
    assert got.evidence == pytest.approx(exact + 0.5 * p.rows * np.log(2 * np.pi), rel=1e-5)
    assert got.settled


def test_the_posterior_is_exact() -> None:
    p = problem()
    got = fit(p, ("a",), None, p.start + 5.0)
    free = p.active(("a",))
    precision = p.A[:, free].T @ p.A[:, free] + np.diag(1 / SD[free] ** 2)
    mean = np.linalg.solve(precision, p.A[:, free].T @ p.y + MEAN[free] / SD[free] ** 2)
    assert got.x[free] == pytest.approx(mean, abs=1e-3)  # it stops where the cost falls by less than 0.01
    assert got.x[3:] == pytest.approx(MEAN[3:])
    assert got.stderr(p)[free] == pytest.approx(np.sqrt(np.diag(np.linalg.inv(precision))), rel=1e-8)
    assert got.stderr(p)[3:] == pytest.approx(0.0)


def test_the_screen_foretells_the_evidence_of_a_linear_problem() -> None:
    p = problem()
    search = searched(p, [("a",), ("b",), ("a", "b")])
    for key in (("a",), ("b",), ("a", "b")):
        fitted = search.fits[key].evidence - search.base.evidence
        assert search.screens[()].evidence(*key) == pytest.approx(fitted, abs=1e-3)
        assert search.evidence(key) == pytest.approx(fitted)


def test_a_bound_is_kept() -> None:
    p = problem()
    p.high[1] = 0.3
    assert fit(p, ("a",), None, p.start).x[1] == pytest.approx(0.3)


def test_a_start_that_diverges_is_left_for_that_of_the_problem() -> None:
    p = problem()
    plain = p.whitened

    def diverging(x: np.ndarray, floor: Any, active: np.ndarray, without: int | None = None) -> np.ndarray:
        return np.full(p.rows, np.inf) if x[1] > 50 else plain(x, floor, active)

    p.whitened = diverging
    got = fit(p, ("a",), None, p.start + 100.0)
    assert np.isfinite(got.cost)
    assert abs(got.x[1] - 1.0) < 1.0


def test_the_cause_that_acts_is_the_likeliest_and_chances_add_up() -> None:
    p = problem()
    found = candidates(searched(p, [("a",), ("b",), ("c",), ("a", "b")]), [])
    assert found[0].effects == ("a",)
    assert sum(c.probability for c in found) == pytest.approx(1.0)
    assert [c.probability for c in found] == sorted((c.probability for c in found), reverse=True)
    acts = inclusion(found, ["a", "b", "c"])
    assert acts["a"] > 0.99
    assert acts["a"] <= 1.0 + 1e-12
    assert acts["b"] < 0.2


def test_without_a_gap_no_effect_is_the_likeliest() -> None:
    worst = []
    for seed in range(30):
        found = candidates(searched(problem(seed, (0.3, 0, 0, 0, 0)), [("a",), ("b",), ("c",)]), [])
        worst.append(max(c.probability for c in found if c.effects))
        assert verdict(found, [], 3).kind != "effects" or worst[-1] > SURE
    assert np.mean(np.array(worst) > SURE) < 0.1


def test_evidence_counts_by_its_temperature() -> None:
    p = problem()
    search = searched(p, [("a",), ("b",)])
    warm, cold = (candidates(search, [], temperature) for temperature in (TEMPERATURE, 1.0))

    def odds(found: list[Candidate]) -> float:
        chance = {c.effects: c.probability for c in found}
        return float(np.log(chance[("a",)] / chance[("b",)]))

    difference = search.evidence(("a",)) - search.evidence(("b",))
    assert odds(warm) == pytest.approx(difference / TEMPERATURE)
    assert odds(cold) == pytest.approx(difference)


def test_twins_cannot_be_told_apart_and_are_reported_as_a_set() -> None:
    p = problem(x=(0.3, 0, 0, 1.2, 0), twins=True)
    search = searched(p, [("a",), ("b",), ("c",)])
    assert apart(search, "b", "c") < APART
    assert apart(search, "b", "a") > APART
    said = verdict(candidates(search, []), [], 3)
    assert said.kind == "inseparable"
    assert set(said.together) == {"b", "c"}


def test_lambda_is_the_square_of_the_z_score() -> None:
    p = problem(x=(0.3, 0, 0, 1.2, 0))
    search = searched(p, [("b",)])
    at = search.fits[("b",)]
    column, coefficient = p.A[:, 3], p.A[:, 0]
    held = coefficient @ coefficient + 1 / SD[0] ** 2
    left = column @ column - (column @ coefficient) ** 2 / held
    assert lambda_of(search, p, "b") == pytest.approx(at.x[3] ** 2 * left)


def test_what_is_detectable_is_detected_four_times_in_five() -> None:
    """In a two-sided test at 5 % with everything else projected out."""
    p = problem()
    least = detectable(searched(p, []))["b"]["q0"]
    column, coefficient = p.A[:, 3], p.A[:, 0]
    free = column - coefficient * (coefficient @ column) / (coefficient @ coefficient + 1 / SD[0] ** 2)
    rng = np.random.default_rng(1)
    y = least * column + rng.normal(size=(4000, p.rows))
    scores = y @ free / np.sqrt(free @ free)
    assert np.mean(np.abs(scores) > 1.96) == pytest.approx(0.8, abs=0.03)


def test_powerless_are_effects_whose_usual_size_would_not_show() -> None:
    p = problem()
    p.A[:, 4] *= 1e-3
    search = searched(p, [])
    assert powerless(search, detectable(search)) == ["c"]


def chances(*pairs: tuple[tuple[str, ...], float]) -> list[Candidate]:
    return sorted((Candidate(key, p, 0.0) for key, p in pairs), key=lambda c: -c.probability)


@pytest.mark.parametrize(
    ("found", "weak", "kind"),
    [
        (chances(((), 0.7), (("a",), 0.3)), [], "no_gap"),
        (chances(((), 0.7), (("a",), 0.3)), ["a", "b"], "underpowered"),
        (chances((("a",), 0.9), ((), 0.1)), [], "effects"),
        (chances((("a", "b"), 0.9), ((), 0.1)), [], "effects"),
        (chances((("unknown",), 0.8), (("a",), 0.2)), [], "unknown"),
        (chances((("a",), 0.45), (("b",), 0.45), ((), 0.1)), [], "inseparable"),
        (chances((("a",), 0.4), ((), 0.35), (("unknown",), 0.25)), [], "underpowered"),
    ],
)
def test_verdicts(found: list[Candidate], weak: list[str], kind: str) -> None:
    said = verdict(found, weak, 3)
    assert said.kind == kind
    assert 0.0 <= said.probability <= 1.0
    if kind == "effects":
        assert said.effects == found[0].effects
    if kind == "inseparable":
        assert set(said.together) == {"a", "b"}
