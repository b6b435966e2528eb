"""What is said where something unnamed acts: alone, beside a named effect, or not at all but a sensor's drift."""

from __future__ import annotations

import importlib
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from seatruth.diagnosis.discrepancy.random_force import DiscrepantFloor, discrepant
from seatruth.diagnosis.noise import Series, white_floor

from seatruth.diagnosis.fit import fit
from seatruth.diagnosis.pipeline import _helping
from seatruth.diagnosis.posterior import (
    FORM,
    UNKNOWN,
    UNNAMED,
    Candidate,
    Verdict,
    beside_unnamed,
    candidates,
    handicap,
    unnamed,
    verdict,
)
from seatruth.diagnosis.problem import Linear
from seatruth.diagnosis.sentences import sentence

diagnosing = importlib.import_module("seatruth.diagnosis.pipeline")  # the package has a function of this name


class Valley:
    """Errors of a valley that bends like Rosenbrock's, and hold little along its floor: x = (2, 4) at the bottom."""

    def __init__(self) -> None:
        self.size, self.rows = 2, 2
        self.mean, self.sd = np.zeros(2), np.full(2, 100.0)
        self.start = np.zeros(2)
        self.low, self.high = np.full(2, -np.inf), np.full(2, np.inf)
        self.linearised = 0

    def active(self, effects: Any) -> np.ndarray:
        return np.arange(2)

    def whitened(self, x: np.ndarray, floor: Any, active: Any, without: int | None = None) -> np.ndarray:
        return np.array([30.0 * (x[1] - x[0] ** 2), 2.0 * (x[0] - 2.0)])

    def linear(self, x: np.ndarray, floor: Any, active: Any, without: int | None = None) -> Linear:
        self.linearised += 1
        slopes = np.array([[-60.0 * x[0], 30.0], [2.0, 0.0]])
        return Linear(x, self.whitened(x, floor, active), slopes)


@pytest.mark.parametrize("start", [(-1.0, 1.0), (5.0, 25.0), (0.0, 0.0)])
def test_a_fit_follows_a_valley_that_bends(start: tuple[float, float]) -> None:
    problem: Any = Valley()
    found = fit(problem, (), None, np.array(start), settled_at=1e-6)  # type: ignore[arg-type]
    assert found.settled
    assert found.x == pytest.approx([2.0, 4.0], abs=1e-2)
    assert problem.linearised <= 26


def search_with(evidence: dict[tuple[str, ...], float], beside: int = 0) -> Any:
    """A search whose effects have these log-evidences; each shows on these trials."""
    names = sorted({name for key in evidence for name in key})
    one = SimpleNamespace(columns={name: [k] for k, name in enumerate(names)}, information=np.eye(9), sd=np.ones(9))
    return SimpleNamespace(
        problem=SimpleNamespace(effects=names),
        fits=dict.fromkeys(evidence),
        beside=beside,
        screens={(): SimpleNamespace(**{**vars(one), "columns": {n: np.array([k]) for k, n in enumerate(names)}})},
        evidence=lambda key: {(): 0.0, **evidence}.get(tuple(sorted(key)), -np.inf),
    )


def probes_at(key: tuple[str, ...], force: float, sensor: float = -5.0) -> Any:
    return SimpleNamespace(
        at=SimpleNamespace(effects=key), average=lambda *kinds: sensor if kinds == ("sensor",) else force
    )


def likeliest(evidence: dict[tuple[str, ...], float], *probes: Any) -> Candidate:
    found = candidates(search_with(evidence), probes)
    assert sum(c.probability for c in found) == pytest.approx(1.0)
    return found[0]


def test_a_force_without_a_name_is_said_to_be_one() -> None:
    found = candidates(search_with({("wind",): 2.0}), [probes_at((), 80.0), probes_at(("wind",), 78.0)])
    assert found[0].effects == (UNKNOWN,)
    assert unnamed(found) > 0.99


def test_a_named_effect_is_kept_beside_something_unnamed_that_is_far_less_without_it() -> None:
    best = likeliest({("wind",): 300.0}, probes_at((), 250.0), probes_at(("wind",), 120.0))
    assert best.effects == ("wind",)
    assert best.beside == pytest.approx(best.probability, abs=0.01)
    assert verdict([best], [], 5).beside


def test_what_an_inexact_form_leaves_is_no_second_cause() -> None:
    strong = 4000.0
    left = FORM * strong
    best = likeliest(
        {("wind",): strong, ("trim",): 1.0, ("trim", "wind"): strong + 0.8 * left},
        probes_at((), 3500.0),
        probes_at(("wind",), left + UNNAMED),
    )
    assert best.effects == ("wind",)
    assert best.beside < 0.5 * best.probability


def test_a_sensor_that_drifts_speaks_for_no_cause() -> None:
    best = likeliest({("wind",): 1.0}, probes_at((), 30.0, sensor=60.0))
    assert best.effects == ()


def searched(courses: tuple[float, ...] = (0.0, 2.0, 4.0, 1.0)) -> Any:
    """A search of effects of which the wind keeps its direction on earth; trials steer these courses."""
    effects = {
        "trim": SimpleNamespace(family="loading", needs_states=("q",)),
        "wind": SimpleNamespace(family="environment", needs_states=("u", "psi")),
    }
    trials = [SimpleNamespace(outputs={"psi": np.full(3, course)}) for course in courses]
    return SimpleNamespace(problem=SimpleNamespace(trials=trials, effects=effects))


@pytest.mark.parametrize(("lasts", "kind", "chance"), [((), "unknown", 1.0), (("wind",), "effects", 0.9)])
def test_effects_beside_something_unnamed_must_help_on_trials_left_out(
    monkeypatch: pytest.MonkeyPatch, lasts: tuple[str, ...], kind: str, chance: float
) -> None:
    monkeypatch.setattr(diagnosing, "lasting", lambda found, effects: tuple(name for name in effects if name in lasts))
    judged = Verdict("effects", ("trim", "wind"), (), 0.8, beside=True)
    answers = [
        Candidate(("trim", "wind"), 0.8, 50.0, 0.8),
        Candidate(("wind",), 0.1, 45.0, 0.05),
        Candidate((UNKNOWN,), 0.1, 40.0),
    ]
    held, left = _helping(judged, searched(), answers)
    assert sum(c.probability for c in left) == pytest.approx(1.0)
    assert not any(set(c.effects) & ({"trim", "wind"} - set(lasts)) for c in left)
    assert (held.kind, held.effects, held.probability) == (kind, lasts, pytest.approx(chance))
    plain = Verdict("effects", ("wind",), (), 0.9)
    assert _helping(plain, searched(), answers) == (plain, answers)
    doubtful = [Candidate(("trim", "wind"), 0.4, 50.0, 0.3), Candidate(("wind",), 0.15, 45.0), Candidate((), 0.45, 0.0)]
    assert _helping(judged, searched(), doubtful)[0].kind == "underpowered"


def test_on_one_course_nothing_that_keeps_its_direction_on_earth_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(diagnosing, "lasting", lambda found, effects: effects)
    judged = Verdict("effects", ("trim", "wind"), (), 0.9, beside=True)
    answers = [Candidate(("trim", "wind"), 0.9, 50.0, 0.9), Candidate((UNKNOWN,), 0.1, 40.0)]
    held, left = _helping(judged, searched((0.0, 0.1, 0.2, 0.1)), answers)
    assert held.effects == ("trim",)
    assert not any("wind" in c.effects for c in left)
    assert _helping(judged, searched(), answers)[0].effects == ("trim", "wind")


def test_what_all_likely_answers_have_in_common_is_named_beside_something_unnamed() -> None:
    answers = [
        Candidate(("trim", "wind"), 0.4, 50.0, 0.4),
        Candidate(("current", "wind"), 0.35, 49.0, 0.35),
        Candidate((UNKNOWN,), 0.25, 40.0),
    ]
    said = verdict(answers, [], 5)
    assert (said.kind, said.effects, said.beside) == ("effects", ("wind",), True)
    assert said.probability == pytest.approx(0.75)


def test_the_sentence_says_so() -> None:
    row = {"name": "wind", "title": "steady wind", "in_words": "2 m/s", "parameters": []}
    said = {"kind": "effects", "effects": ["wind"], "set": [], "probability": 0.9, "beside": True, "powerless": []}
    text = sentence(said, [row], {}, None, {"equation": "yaw"})
    assert text.startswith("A part of the gap comes from steady wind")
    assert "Beside that acts something that is not in the library, most like a force in yaw." in text
    assert "Beside" not in sentence({**said, "beside": False}, [row], {}, None, {"equation": "yaw"})


def probed(size: float, seed: int = 0) -> Any:
    """Two trials of two equations: smooth pushes with independent sizes at knots, in white noise; one coefficient."""
    rng = np.random.default_rng(seed)
    n, knots = 200, 10
    t = np.linspace(0.0, 1.0, n)
    hats = np.maximum(0.0, 1.0 - np.abs(t[:, None] * (knots - 1) - np.arange(knots)))
    series = [Series(f"t{k}", "y", np.arange(k * n, (k + 1) * n), t, 0.1) for k in range(2)]
    blocks = {}
    for label, shape in (("sway", np.ones(n)), ("yaw", np.cos(40.0 * t))):
        push = 30.0 * hats * shape[:, None]
        blocks[label] = np.block([[push, np.zeros_like(push)], [np.zeros_like(push), push]])
    errors = rng.normal(size=2 * n) + blocks["sway"] @ (size * rng.normal(size=2 * knots))
    slopes = np.tile(t, 2)[:, None]
    places = [SimpleNamespace(label=label, state=label) for label in blocks]
    at = SimpleNamespace(
        linear=SimpleNamespace(slopes=slopes, errors=errors), active=np.array([0]), x=np.zeros(1), effects=()
    )
    problem = SimpleNamespace(
        sd=np.ones(1), mean=np.zeros(1), trial_of=np.repeat([0, 1], n), trials=[None, None], rows=2 * n
    )
    scales = {label: np.ones(2 * knots) for label in blocks}
    floor = white_floor(series, {"y": 1.0})
    return SimpleNamespace(
        model=SimpleNamespace(places=places), screens=blocks, blocks=blocks, scales=scales, at=at, problem=problem,
        floor=floor,
    )  # fmt: skip


def test_missing_forces_are_sized_where_they_act_and_whitened_away() -> None:
    probes = probed(0.3)
    floor = discrepant(probes)
    assert isinstance(floor, DiscrepantFloor)
    sizes = dict(floor.sizes)
    assert 0.1 <= sizes["sway"] <= 1.0
    assert sizes["yaw"] <= 0.01
    errors = probes.at.linear.errors
    assert float(np.mean(errors**2)) > 5.0
    assert float(np.mean(floor.whiten(errors) ** 2)) == pytest.approx(1.0, abs=0.15)


def test_whitening_by_missing_forces_is_the_inverse_root_of_their_covariance() -> None:
    probes = probed(0.3)
    floor = discrepant(probes)
    assert floor is not None
    B = np.concatenate([probes.blocks[label] * dict(floor.sizes)[label] for label in probes.blocks], axis=1)
    covariance = np.eye(len(B)) + B @ B.T
    x = np.random.default_rng(1).normal(size=(len(B), 2))
    found = floor.whiten(x)
    assert found.T @ found == pytest.approx(x.T @ np.linalg.solve(covariance, x), rel=1e-8)
    assert floor.whiten(x[:, 0]) == pytest.approx(found[:, 0])


def test_where_noise_is_all_there_are_no_missing_forces() -> None:
    assert sum(discrepant(probed(0.0, seed)) is None for seed in range(10)) >= 8


def test_what_acts_beside_something_unnamed_is_shared_out_anew() -> None:
    first = [Candidate(("wind",), 0.5, 100.0, 0.45), Candidate((UNKNOWN,), 0.4, 90.0), Candidate((), 0.1, 0.0)]
    besides = [Candidate(("current",), 0.7, 20.0), Candidate((), 0.3, 0.0)]
    found = {c.effects: c for c in beside_unnamed(first, besides, unnamed(first))}
    assert sum(c.probability for c in found.values()) == pytest.approx(1.0)
    assert unnamed(first) == pytest.approx(0.85)
    assert found[("current",)].probability == pytest.approx(0.85 * 0.7)
    assert found[("current",)].beside == pytest.approx(0.85 * 0.7)
    assert found[(UNKNOWN,)].probability == pytest.approx(0.85 * 0.3)
    assert found[("wind",)].probability == pytest.approx(0.05)
    astray = {c.effects: c.probability for c in beside_unnamed(first, besides, 1.0)}
    assert astray[("current",)] == pytest.approx(0.7)
    assert astray[("wind",)] == 0.0


def test_beside_something_unnamed_a_named_effect_is_a_second_cause() -> None:
    evidence = {(): 0.0, ("wind",): 4.0, ("current",): 0.0}
    alone, beside = (candidates(search_with(evidence, number), [])[0] for number in (0, 1))
    assert alone.effects == ("wind",)
    assert beside.effects == ()
    assert beside.probability > 0.5


def test_a_set_of_effects_must_earn_its_handicap() -> None:
    found = search_with({(): 0.0, ("wind",): 0.0, ("trim",): 0.0, ("trim", "wind"): 0.0})
    least = handicap(found)
    assert least(()) == 0.0
    assert 0.0 < least(("wind",)) < least(("trim", "wind"))
    even = search_with({(): 0.0, ("trim",): -50.0, ("wind",): least(("wind",))})
    best, second = candidates(even, [])[:2]
    assert best.probability == pytest.approx(second.probability, rel=0.01)
