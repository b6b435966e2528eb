"""A ship that is unstable on its course is fitted from pieces of its trials, where fits of whole ones run away."""

from __future__ import annotations

import numpy as np
import pytest
import small_case as small
from seatruth.diagnosis.noise import white_floor

from seatruth.costs.options import TrajectoryOptions
from seatruth.diagnosis.fit import fit
from seatruth.diagnosis.hypotheses import floor_of
from seatruth.diagnosis.initial_guess import STRAYED, from_pieces
from seatruth.diagnosis.problem import GapProblem
from seatruth.effects import load_effects
from seatruth.models import load_model
from seatruth.models.parameter import Prior
from seatruth.study import Study
from seatruth.trials.trial import Trial, Trials

SHIP = small.SHIP.replace("(p.K * i.delta - s.r) / p.T", "(p.K * i.delta + s.r - 4000.0 * s.r**3) / p.T").replace(
    "class Nomoto", "class Unstable"
)
NOISE = {"r": 2e-4, "psi": 2e-3}


def steered(rng: np.random.Generator, lag: float) -> Trial:
    """The ship held on a winding course by an autopilot: replayed in the open loop it leaves it."""
    t, K, T, parts = np.arange(0.0, 100.0, 1.0), 0.12, 8.5, 20
    r = psi = 0.0
    rows = []
    for time in t:
        delta = float(np.clip(1.5 * (0.3 * np.sin(time / 30.0 + lag) - psi) - 15.0 * r, -0.3, 0.3))
        rows.append((delta, r, psi))
        for _ in range(parts):
            half = r + 0.5 / parts * (K * delta + r - 4000.0 * r**3) / T
            r, psi = r + 1.0 / parts * (K * delta + half - 4000.0 * half**3) / T, psi + half / parts
    deltas, rates, headings = np.array(rows).T
    noisy = {
        "r": rates + NOISE["r"] * rng.normal(size=t.size),
        "psi": headings + NOISE["psi"] * rng.normal(size=t.size),
    }
    return Trial(f"run_{lag:g}", t, {"delta": deltas}, noisy, synthetic=True)


@pytest.fixture(scope="module")
def problem(tmp_path_factory: pytest.TempPathFactory) -> GapProblem:
    folder = tmp_path_factory.mktemp("unstable")
    (folder / "ship.py").write_text(SHIP)
    model = load_model("ship.py:Unstable", folder)
    rng = np.random.default_rng(4)
    runs = [steered(rng, 0.3 * k) for k in range(3)]
    parameters = tuple(p.replace(prior=Prior(p.value, 0.2 * p.value)) for p in model.parameters)
    study = Study(
        name="unstable",
        model=model,
        trials=Trials(runs),
        parameters=parameters,
        noise=dict(NOISE),
        cost=TrajectoryOptions(hold="zoh"),
    )
    return GapProblem(study, load_effects(small.EFFECTS), threads=1)


def test_pieces_bring_the_coefficients_near_where_whole_trials_stray(problem: GapProblem) -> None:
    floor = white_floor(problem.series, NOISE)
    strayed = fit(problem, (), floor, problem.start)
    assert strayed.misfit > STRAYED * problem.rows  # or this test would show nothing
    x = from_pieces(problem, NOISE)
    assert x is not None
    near = dict(zip(problem.names, x.tolist()))
    assert near["K"] == pytest.approx(0.12, rel=0.15)
    assert near["T"] == pytest.approx(8.5, rel=0.15)
    assert fit(problem, (), floor, x).misfit < 1.2 * problem.rows


def test_the_noise_of_an_unstable_ship_is_that_of_its_sensors(problem: GapProblem) -> None:
    floor, _, plain = floor_of(problem, lambda text: None)
    assert floor.sd == pytest.approx(NOISE, rel=0.15)
    assert plain.misfit < 1.2 * problem.rows
