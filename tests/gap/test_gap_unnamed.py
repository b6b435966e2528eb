"""What is said where something unnamed acts: alone, beside a named effect, or not at all but a sensor's drift."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seatruth.gap.diagnose import _held
from seatruth.gap.fit import fit
from seatruth.gap.probability import FORM, UNKNOWN, UNNAMED, Candidate, Verdict, candidates, verdict
from seatruth.gap.problem import Linear
from seatruth.gap.sentences import sentence


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


def search_with(evidence: dict[tuple[str, ...], float]) -> Any:
    """A search whose effects have these log-evidences; each shows on these trials."""
    names = sorted({name for key in evidence for name in key})
    one = SimpleNamespace(columns={name: [k] for k, name in enumerate(names)}, information=np.eye(9), sd=np.ones(9))
    return SimpleNamespace(
        problem=SimpleNamespace(effects=names),
        fits=dict.fromkeys(evidence),
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
    best = likeliest({("wind",): 2.0}, probes_at((), 80.0), probes_at(("wind",), 78.0))
    assert best.effects == (UNKNOWN,)
    assert best.probability > 0.9


def test_a_named_effect_is_kept_beside_something_unnamed_that_is_far_less_without_it() -> None:
    best = likeliest({("wind",): 300.0}, probes_at((), 250.0), probes_at(("wind",), 120.0))
    assert best.effects == ("wind",)
    assert best.beside == pytest.approx(best.probability, abs=0.01)
    assert verdict([best], [], 5).beside


def test_a_named_effect_that_gains_next_to_nothing_beside_it_is_not() -> None:
    best = likeliest({("wind",): 130.0}, probes_at((), 350.0), probes_at(("wind",), 250.0))
    assert best.effects == (UNKNOWN,)


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


@pytest.mark.parametrize(("closure", "kind"), [(-0.4, "unknown"), (0.7, "effects"), (float("nan"), "effects")])
def test_effects_beside_something_unnamed_must_help_on_trials_left_out(closure: float, kind: str) -> None:
    judged = Verdict("effects", ("wind",), (), 0.9, beside=True)
    answers = [Candidate(("wind",), 0.9, 50.0, 0.85), Candidate((UNKNOWN,), 0.1, 40.0)]
    held = _held(judged, {"closure": {"value": closure}}, answers)
    assert held.kind == kind
    if kind == "unknown":
        assert held.probability == pytest.approx(0.95)
    plain = Verdict("effects", ("wind",), (), 0.9)
    assert _held(plain, {"closure": {"value": closure}}, answers) is plain


def test_the_sentence_says_so() -> None:
    row = {"name": "wind", "title": "steady wind", "in_words": "2 m/s", "parameters": []}
    said = {"kind": "effects", "effects": ["wind"], "set": [], "probability": 0.9, "beside": True, "powerless": []}
    text = sentence(said, [row], {}, None, {"equation": "yaw"})
    assert "Beside that acts something that is not in the library, most like a force in yaw." in text
    assert "Beside" not in sentence({**said, "beside": False}, [row], {}, None, {"equation": "yaw"})
