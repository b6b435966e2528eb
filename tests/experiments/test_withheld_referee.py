"""The referee's lambda is the non-centrality that a refit shows; a case is the one that its plan asked for."""

from __future__ import annotations

import json
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).resolve().parents[2] / "experiments"))

from withheld.cases import FORM_KINDS, KINDS, Plan, draw, drawn_coefficients, drawn_noise
from withheld.generate import ASIDE, plans, sealed
from withheld.next_trial import pairs_after
from withheld.reality.families import families
from withheld.reality.manoeuvres import auv_trial
from withheld.reality.simulate import Present, make
from withheld.referee import left_over, signatures
from withheld.studies import log_text, study_text

AUV = families()["auv"]


def test_lambda_is_the_fall_of_chi_square_that_a_refit_shows() -> None:
    """Monte Carlo over noise and priors: the fall has mean lambda + 1 and variance 2 + 4 lambda."""
    rng = np.random.default_rng(5)
    coefficients, noise = drawn_coefficients(AUV, rng), drawn_noise(AUV, rng)
    trials = [auv_trial(name, AUV.time) for name in ("pitch_zigzag_15", "level_run", "plane_staircase")]
    records = make(AUV, trials, coefficients, (), noise, rng, True)
    one = AUV.mechanism("depth_scale")
    found = signatures(AUV, records, coefficients, noise, [("it", [Present(one, {"k": 0.01, "b": 0.0})])])
    size = found.coefficients
    strength = left_over(found.projected(), 0, [])
    stacked = np.concatenate(found.whitened)
    prior = np.hstack([np.eye(size), np.zeros((size, 1))])
    both = np.vstack([stacked, prior])
    falls = []
    for _ in range(400):
        # First states are projected out of the columns; the noise needs no projection to be compared with them.
        z = rng.standard_normal(len(stacked)) + stacked[:, size] + stacked[:, :size] @ rng.standard_normal(size)
        y = np.concatenate([z, np.zeros(size)])
        chi = [np.sum((y - c @ np.linalg.lstsq(c, y, rcond=None)[0]) ** 2) for c in (both[:, :size], both)]
        falls.append(chi[0] - chi[1])
    spread = np.sqrt((2 + 4 * strength) / len(falls))
    assert np.mean(falls) == pytest.approx(strength + 1, abs=4 * spread)
    assert np.var(falls) == pytest.approx(2 + 4 * strength, rel=0.4)


@pytest.mark.slow
def test_a_case_is_what_its_plan_wants_and_its_public_part_names_no_cause(tmp_path: Path) -> None:
    plan = Plan("auv", "single", ("speed_bias",), 2, 11)
    case = draw(plan)
    truth = sealed(case, "c001")
    assert 100 * 0.8 < truth["lambda"]["speed_bias"] < 400 * 1.2
    assert truth["stratum"] in ("100-400",)
    assert truth["effects"] == ["speed_bias"]
    off = [abs(case.coefficients[name] / value - 1) for name, value in AUV.coefficients.items()]
    assert min(off) >= 0.1 - 1e-9
    assert max(off) <= 0.2 + 1e-9
    assert all(0 < size < 3 for _, size in case.distractors)
    closed = [trial.closed for trial in case.trials]
    assert len(closed) // 2 - 1 <= sum(closed) <= len(closed) // 2 + 1
    text = study_text(case, "c001")
    tomllib.loads(text)
    public = text + "".join(log_text(AUV, record) for record in case.records)
    assert "speed_bias" not in public
    assert not any(key in public for key in ("lambda", "governor", "fouling", "distractor"))
    assert "SYNTHETIC" in public
    # The same plan gives the same case, and a suggested trial can be judged from what was sealed.
    assert json.dumps(sealed(draw(plan), "c001")) == json.dumps(truth)
    for k, record in enumerate(case.records):
        (tmp_path / f"trial_{k + 1}.csv").write_text(log_text(AUV, record))
    after = pairs_after(truth, tmp_path, "zigzag of delta_s")
    before = truth["pairs"]["speed_bias"]
    assert after["current_along"] > before["current_along"] * 0.99
    assert pairs_after(truth, tmp_path, "a manoeuvre of no menu") == {}


def test_plans_cover_kinds_and_keep_a_family_aside() -> None:
    dev, test = plans("dev", 60, 1), plans("test", 150, 2)
    assert {plan.family for plan in dev} == {"ship", "auv", "mariner", "tanker", "torpedo", "twin"}
    assert {plan.family for plan in test} == {plan.family for plan in dev} | set(ASIDE)
    for many in (test, plans("test", 300, 3)):
        assert 0.25 * len(many) <= sum(plan.family in ASIDE for plan in many) <= 0.35 * len(many)
        assert {(plan.family, plan.kind) for plan in many} >= {(name, kind) for name in ASIDE for kind in KINDS}
    assert {plan.kind for plan in dev} == set(KINDS)
    for many in (dev, test):
        assert 0.28 * len(many) <= sum(bool(plan.form) for plan in many) <= 0.38 * len(many)
        assert sum(plan.stated for plan in many) == len(many) // 2
    assert all(bool(plan.form) == (plan.kind in FORM_KINDS) for plan in test)
    assert plans("dev", 60, 1) == dev
    singles = [plan for plan in test if plan.kind == "single"]
    assert {plan.stratum for plan in singles} == {0, 1, 2, 3}
    assert all(plan.causes == () for plan in test if plan.kind in ("none", "form"))
