"""Words on what trials can and cannot tell: verdicts, combinations, sensitivities, previews."""

from __future__ import annotations

import math
from typing import Any, Literal

import numpy as np
import pytest

from seatruth.costs import cost_of
from seatruth.costs.options import TrajectoryOptions
from seatruth.costs.study_cost import ResidualBlock
from seatruth.models import load_model
from seatruth.models.parameter import Parameter, Prior
from seatruth.simulate import simulator
from seatruth.study import Study
from seatruth.trials.trial import Trial, Trials
from seatruth.uncertainty import (
    correlated_pairs,
    covariance,
    identifiability,
    prior_identifiability,
    sensitivity,
    strongly_correlated,
    verdict,
)
from seatruth.uncertainty.covariance import on_bound


def three() -> list[Parameter]:
    return [Parameter(name, 1.0, "1", -1.0, 3.0, vary=True) for name in ("a", "b", "c")]


def test_a_combination_that_is_not_seen_is_named() -> None:
    rng = np.random.default_rng(1)
    u, v = rng.normal(size=(2, 500))
    found = identifiability(np.column_stack([u, u + 1e-9 * v, v]), three())
    (weak,) = found["weak"]
    assert set(weak["combination"]) == {"a", "b"}
    assert weak["combination"]["a"] * weak["combination"]["b"] == pytest.approx(-1.0, rel=1e-3)
    assert "a and b trade off" in weak["sentence"] or "b and a trade off" in weak["sentence"]
    assert "do not determine" in weak["sentence"]
    assert found["condition"] > 1e8


def test_what_cancels_is_lost_however_little_of_it_takes_part() -> None:
    """Of a scale that cancels, an inertia that hardly moves the outputs is as undetermined as the rest."""
    rng = np.random.default_rng(4)
    J = rng.standard_normal((200, 3))
    J[:, 2] = 1e-3 * rng.standard_normal(200)
    # A fourth column, which the first two and a little of the third make up for.
    J = np.column_stack([J, -J @ np.array([1.0, 2.0, 3.0])])
    rows = ResidualBlock("data", "run", "r", np.arange(200), np.arange(200.0), np.arange(200))
    found = covariance(rng.standard_normal(200), np.column_stack([J, rng.standard_normal(200)]), [rows])
    assert found.unidentifiable.tolist() == [True, True, True, True, False]
    assert np.isfinite(found.stderr[4])


def test_what_cancels_is_named_however_little_of_its_range_it_takes() -> None:
    """A common factor of drag, thrust and mass: the mass within its bounds makes up for a small part of the others."""
    rng = np.random.default_rng(1)
    u, v = rng.normal(size=(2, 500))
    (weak,) = identifiability(np.column_stack([30.0 * u, -30.0 * u + v, v]), three())["weak"]
    assert set(weak["combination"]) == {"a", "b", "c"}
    (weak,) = identifiability(np.column_stack([30.0 * u, -u, v]), three())["weak"]
    assert set(weak["combination"]) == {"a", "b"}
    assert abs(weak["combination"]["a"]) == pytest.approx(1.0 / 30.0)
    assert "do not determine" in weak["sentence"]


def test_a_parameter_that_is_hardly_seen_is_named_alone() -> None:
    rng = np.random.default_rng(1)
    u, v, w = rng.normal(size=(3, 500))
    (weak,) = identifiability(np.column_stack([u, v, 0.01 * w]), three())["weak"]
    assert set(weak["combination"]) == {"c"}
    assert weak["ratio"] == pytest.approx(1.0 / (0.01 * np.linalg.norm(w) * 2.0), rel=0.05)
    assert identifiability(np.column_stack([u, v, w]), three())["weak"] == []


def test_fewer_samples_than_parameters() -> None:
    found = identifiability(np.ones((1, 3)), three())
    assert len(found["singular_values"]) == 3
    assert math.isinf(found["condition"])
    assert len(found["weak"]) == 2
    assert identifiability(np.zeros((5, 0)), [])["weak"] == []


def test_estimates_that_move_together_are_named() -> None:
    rng = np.random.default_rng(2)
    u, v, w = 100.0 * rng.normal(size=(3, 500))
    jacobian = np.column_stack([u, u + 0.1 * v, w])
    groups = [ResidualBlock("data", "run", "y", np.arange(500), np.arange(500) * 1.0, np.arange(500))]
    found = covariance(rng.normal(size=500), jacobian, groups)
    assert strongly_correlated(found).tolist() == [True, True, False]
    (pair,) = correlated_pairs(found, three())
    assert pair["combination"] == {"a": 1.0, "b": 1.0}
    assert "correlated by -0.99" in pair["sentence"]


@pytest.mark.parametrize(
    ("stderr", "changes", "said"),
    [
        (0.01, {}, "identified"),
        (0.8, {}, "weak"),
        (0.01, {"correlated": True}, "identified"),
        (0.2, {"correlated": True}, "weak"),
        (5.0, {}, "not identifiable"),
        (math.inf, {}, "not identifiable"),
        (0.01, {"unidentifiable": True}, "not identifiable"),
        (0.01, {"at_bound": True}, "at bound"),
        (0.01, {"doubted": True}, "doubtful"),
        (0.8, {"doubted": True}, "doubtful"),
        (5.0, {"doubted": True}, "not identifiable"),
        (0.095, {"prior": Prior(1.0, 0.1)}, "from prior"),
        (0.095, {"prior": Prior(0.4, 0.1)}, "weak"),  # the data moved it six deviations
        (0.095, {"prior": Prior(0.4, 0.1), "doubted": True}, "doubtful"),
        (0.02, {"prior": Prior(1.0, 0.1)}, "identified"),
    ],
)
def test_verdicts(stderr: float, changes: dict[str, Any], said: str) -> None:
    parameter = Parameter("a", 1.0, "1", -1.0, 3.0, vary=True, prior=changes.pop("prior", None))
    flags = {"at_bound": False, "unidentifiable": False, "correlated": False, **changes}
    assert verdict(parameter, 1.0, stderr, **flags) == said


@pytest.fixture(scope="module")
def diving() -> Study:
    """The underwater vehicle's published zigzag from rest: 5 deg of fin, reversed on pitch, thrust 120 N."""
    from seatruth.manoeuvres import PitchZigzag, run_manoeuvre

    model = load_model("diving_plane")
    zigzag = PitchZigzag(math.radians(5.0), math.radians(5.0))
    trial = run_manoeuvre(model, zigzag, dt=0.5, first_state={"z": 100.0}, rudder_rate=math.radians(2.5), limit=120.0)
    return Study("zigzag", model, Trials([trial]), noise=dict.fromkeys(("u", "w", "q", "theta"), 1e-3))


def test_sensitivities_are_the_published_kind(diving: Study) -> None:
    """The order that the reference plant's zigzag gives: planes and damping first, quadratic pitch terms last."""
    names = ["Z_ds", "Z_q", "M_ds", "Z_w", "M_q", "Z_aw", "M_aw", "M_qaq", "M_waw"]
    free = tuple(p.replace(vary=p.name in names) for p in diving.model.parameters)
    cost = cost_of(diving.replace(parameters=free), threads=1)
    found = sensitivity(cost, cost.start)
    order = found[["w", "q", "theta"]].max(axis=1)
    assert list(order.index) == [p.name for p in cost.parameters]
    assert order[["Z_ds", "Z_q", "M_ds", "Z_w", "M_q"]].min() > 0.3
    assert order[["M_aw", "M_qaq", "M_waw"]].max() < 0.1


def test_a_preview_says_what_trials_can_move() -> None:
    model = load_model("mmg")
    t = np.arange(0.0, 60.0, 0.5)
    straight = {"delta": np.zeros(t.size), "n": np.full(t.size, 10.0)}
    turning = {"delta": 0.35 * np.sign(np.sin(t / 5.0)), "n": np.full(t.size, 10.0)}
    verdicts = {}
    for name, inputs in (("straight", straight), ("turning", turning)):
        bare = Trial(name, t, inputs, {}, synthetic=True)
        start = np.array([[1.1, 0.0, 0.0, 0.0, 0.0, 0.0]])
        y = simulator(model, [bare]).outputs(np.zeros((1, 0)), start).y[0]
        outputs = {c.name: y[:, k] for k, c in enumerate(model.outputs)}
        trial = Trial(name, t, inputs, outputs, synthetic=True)
        free = tuple(p.replace(vary=p.name in ("Y_v", "N_r", "R_0")) for p in model.parameters)
        noise = {"x": 0.1, "y": 0.1, "psi": 0.002, "u": 0.01, "v": 0.01, "r": 0.001}
        study = Study(name, model, Trials([trial]), parameters=free, noise=noise)
        verdicts[name] = prior_identifiability(study, threads=1)
    assert verdicts["straight"].loc["R_0", "verdict"] == "identified"
    assert set(verdicts["straight"].loc[["Y_v", "N_r"], "verdict"]) == {"not identifiable"}
    assert set(verdicts["turning"]["verdict"]) == {"identified"}
    assert verdicts["turning"].attrs["reasons"] == []
    reasons = " ".join(verdicts["straight"].attrs["reasons"])
    assert "Y_v" in reasons
    assert "N_r" in reasons


@pytest.mark.parametrize("initial", ["fixed", "free"])
def test_a_preview_names_the_scale_that_cancels(initial: Literal["fixed", "free"]) -> None:
    """Drag, thrust and mass of the forward channel have a common factor that no run of it can tell."""
    from seatruth.manoeuvres import SpeedSteps, run_manoeuvre

    model = load_model("torpedo_forward")
    trial = run_manoeuvre(model, SpeedSteps((15.0, 9.0, 16.5), 5.0), dt=0.25, first_state={"u": 1.5}, limit=15.0)
    free = tuple(p.replace(vary=p.name in ("C_x0", "k_1", "k_2", "m", "lambda_11")) for p in model.parameters)
    cost = TrajectoryOptions(initial=initial)
    frame = prior_identifiability(Study("f", model, Trials([trial]), parameters=free, noise={"u": 0.01}, cost=cost))
    assert "not identifiable" in set(frame["verdict"])
    assert any("C_x0" in reason and "k_1" in reason for reason in frame.attrs["reasons"])


def test_what_is_weak_is_said_in_a_sentence() -> None:
    """Of two columns one hardly moves the outputs: known to 100 % or 20 times of its range, or not at all."""
    parameters = [Parameter(name, 0.5, min=0.0, max=1.0, vary=True) for name in "ab"]
    said = [identifiability(np.diag([1e6, slope]), parameters)["weak"][0]["sentence"] for slope in (2.0, 0.05, 1e-12)]
    assert said[0] == "These trials alone leave b uncertain by 100 % of what its prior or bounds do."
    assert said[1] == "These trials alone leave b uncertain by 40 times what its prior or bounds do."
    assert said[2] == "These trials do not determine b."


@pytest.mark.parametrize(
    ("value", "known", "shown"),
    [
        (2.1e-36, {"value": 2.5, "min": 0.0, "max": 10.0}, 0.0),
        (2.1e-36, {"value": 0.0, "min": 0.0, "prior": Prior(0.0, 0.2)}, 0.0),
        (10.0 - 1e-14, {"value": 2.5, "min": 0.0, "max": 10.0}, 10.0),
        (2.1e-36, {"value": 3e-36, "min": 0.0}, 2.1e-36),
        (2.1e-36, {"value": 2.5}, 2.1e-36),
        (1e-8, {"value": 2.5, "min": 0.0, "max": 10.0}, 1e-8),
    ],
)
def test_what_misses_a_bound_by_rounding_is_on_it(value: float, known: dict[str, Any], shown: float) -> None:
    assert on_bound(value, Parameter("C_Da", unit="1", **known)) == shown
