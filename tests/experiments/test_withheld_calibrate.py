"""The constants of the decision: found again from made tables of hypotheses, and judged on cases left out."""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

sys.path.append(str(Path(__file__).resolve().parents[2] / "experiments"))

from withheld import calibrate as module
from withheld.calibrate import (
    Constants,
    as_settings,
    calibrate,
    cross_validated,
    fit,
    log_score,
    posterior,
    table,
    threshold,
)
from withheld.seal import digest_file, note
from withheld.verdicts import verdict

from seatruth.diagnosis import Settings
from seatruth.diagnosis.other_forms import ACTS, with_other_forms
from seatruth.diagnosis.posterior import log_prior
from seatruth.diagnosis.verdict import Hypothesis
from seatruth.effects import available
from seatruth.errors import BadInput

ANSWERS: list[tuple[list[str], bool]] = [
    ([], False),
    ([], True),
    (["wind"], False),
    (["wind"], True),
    (["bank"], False),
]


def _rows(evidence: list[float]) -> list[dict[str, Any]]:
    return [
        {"effects": effects, "discrepancy": discrepancy, "log_evidence": value, "log_prior": 0.0}
        for (effects, discrepancy), value in zip(ANSWERS, evidence, strict=True)
    ]


def _drawn(count: int, temperature: float, seed: int) -> list[tuple[dict[str, Any], dict[str, Any]]]:
    """Cases whose truths are drawn from the posterior at this temperature."""
    rng, found = np.random.default_rng(seed), []
    for k in range(count):
        evidence = rng.normal(0.0, 6.0, len(ANSWERS))
        weight = np.exp(evidence / temperature - np.max(evidence / temperature))
        effects, discrepancy = ANSWERS[int(rng.choice(len(ANSWERS), p=weight / weight.sum()))]
        names = effects or (["unknown"] if discrepancy else [])
        kind = "single" if effects else "outside" if names else "none"
        truth = {"case": f"c{k:03d}", "kind": kind, "effects": names}
        found.append((truth, {**verdict(truth["case"], [([], 1.0)]), "hypotheses": _rows(evidence.tolist())}))
    return found


def test_answers_add_up_over_discrepancy_except_where_no_effect_is_named() -> None:
    truth = {"case": "a", "kind": "single", "effects": ["wind"]}
    case = table(truth, {"hypotheses": _rows([0.0, 1.0, 2.0, 3.0, -math.inf])})
    chance = posterior(case, Constants())
    assert chance.sum() == pytest.approx(1.0)
    weight = np.exp([0.0, 1.0, 2.0, 3.0])
    assert math.exp(log_score(case, Constants())) == pytest.approx(weight[2:].sum() / weight.sum(), abs=1e-5)
    colder = posterior(case, Constants(temperature=0.5))
    assert colder.max() > chance.max()
    assert posterior(case, Constants(log_odds=-50.0))[~case.named].max() == pytest.approx(1 / (1 + math.exp(2.0)))


def test_nothing_is_right_too_where_only_another_form_acts() -> None:
    case = table({"case": "a", "kind": "form", "effects": []}, {"hypotheses": _rows([0.0, 0.0, -9.0, -9.0, -9.0])})
    assert int(case.right.sum()) == 1
    unknown = table(
        {"case": "a", "kind": "form", "effects": ["unknown"]}, {"hypotheses": _rows([0.0, 0.0, -9.0, -9.0, -9.0])}
    )
    assert math.exp(log_score(unknown, Constants())) == pytest.approx(1.0, abs=1e-3)


def test_a_temperature_is_found_again_and_holds_on_cases_left_out() -> None:
    cases = [table(truth, own) for truth, own in _drawn(80, 3.0, 1)]
    constants = fit(cases)
    assert constants.temperature == pytest.approx(3.0, rel=0.35)
    left_out = cross_validated(cases, 0)
    before = np.mean([log_score(case, Constants()) for case in cases])
    after = np.mean([log_score(case, constants) for case in cases])
    assert before < np.mean(left_out) <= after + 0.02


def test_a_temperature_that_is_kept_stays() -> None:
    cases = [table(truth, own) for truth, own in _drawn(30, 3.0, 2)]
    constants = fit(cases, (1.5, 0.02))
    assert (constants.temperature, constants.model_form) == (1.5, 0.02)
    before, after = (np.mean([log_score(case, one) for case in cases]) for one in (Constants(1.5, 0.02), constants))
    assert after >= before


def test_the_same_seed_gives_the_same_folds() -> None:
    cases = [table(truth, own) for truth, own in _drawn(10, 2.0, 4)]
    assert cross_validated(cases, 3) == cross_validated(cases, 3)


def test_what_grows_with_what_is_explained_widens_the_answer() -> None:
    truth = {"case": "a", "kind": "single", "effects": ["wind"]}
    case = table(truth, {"hypotheses": _rows([0.0, 20.0, 300.0, 310.0, 290.0])})
    assert case.explained == pytest.approx(290.0)
    flat, wide = (posterior(case, Constants(model_form=slope)).max() for slope in (0.0, 0.03))
    assert flat > wide
    assert wide == pytest.approx(posterior(case, Constants(temperature=1.0 + 0.03 * 290.0)).max())


def test_the_settings_give_the_same_probabilities_as_the_constants() -> None:
    """Priors of each kind of answer, with discrepancy and without, up to one factor."""
    constants = Constants(2.0, 0.01, log_odds=-0.4, occam=1.5, none=0.2, two=-1.0, more=0.3)
    before = Settings()
    after = Settings(**as_settings(constants, before))
    shifts = []
    for count, kind in enumerate((constants.none, 0.0, constants.two, constants.more)):
        for on in (False, True):
            shift = kind + on * (constants.log_odds - constants.occam * (count > 0))
            shifts.append(log_prior(count, on, 9, after) - log_prior(count, on, 9, before) - shift)
    assert shifts == pytest.approx([shifts[0]] * len(shifts))


def test_the_threshold_leaves_few_wrong_ones_above_it() -> None:
    answers = [(0.99, True)] * 60 + [(0.9, False)] + [(0.8, True)] * 10 + [(0.7, False)] * 5
    assert threshold(answers) == 0.8
    assert threshold([(0.9, False)]) == 1.0


def test_the_step_writes_constants_with_the_hash_of_their_cases(tmp_path: Path) -> None:
    place = tmp_path / "verdicts" / "seatruth"
    for folder in (tmp_path / "public", tmp_path / "sealed", place):
        folder.mkdir(parents=True)
    seal, hashes = {}, {}
    for truth, own in _drawn(12, 2.0, 3):
        name = truth["case"]
        (tmp_path / "sealed" / f"{name}.json").write_text(json.dumps(truth))
        (place / f"{name}.json").write_text(json.dumps(own))
        seal[name] = digest_file(tmp_path / "sealed" / f"{name}.json")
        hashes[name] = digest_file(place / f"{name}.json")
    (tmp_path / "sealed" / "_set.json").write_text(json.dumps({"set": "dev", "cases": 12, "seed": 7}))
    (tmp_path / "public" / "seal.json").write_text(json.dumps({"set": "dev", "sealed": seal}))
    (place / "manifest.json").write_text(json.dumps({"verdicts": hashes}))
    note(tmp_path, "diagnose", "end", {"manifest": digest_file(place / "manifest.json")})
    found = calibrate([tmp_path])
    assert json.loads((tmp_path / "calibration.json").read_text()) == found
    assert found["cases"] == 12
    assert found["sets"] == [{"set": "dev", "seed": 7, "diagnosed": found["commit"], "hash": found["sets"][0]["hash"]}]
    assert len(found["sets"][0]["hash"]) == 64
    assert found["log_score"]["fitted"] >= found["log_score"]["as_diagnosed"] - 1e-9
    assert calibrate([tmp_path]) == found
    (tmp_path / "sealed" / "_set.json").write_text(json.dumps({"set": "test", "cases": 12, "seed": 7}))
    with pytest.raises(BadInput, match="once it is opened"):
        module.calibrate([tmp_path])
    note(tmp_path, "score", "end", {})
    assert calibrate([tmp_path, tmp_path])["cases"] == 24


def test_a_twin_has_the_evidence_of_the_fit_that_stands_for_it() -> None:
    """Terms of another form share their probability as the diagnosis has it, whatever the temperature."""
    plain = [
        Hypothesis(("cross_flow",), True, 40.0, -2.0, 0.0, settled=True),
        Hypothesis(("current",), True, 36.0, -2.0, 0.0, settled=True),
        Hypothesis((), True, 30.0, -1.0, 0.0, settled=True),
        Hypothesis((), False, 0.0, -1.0, 0.0, settled=True),
    ]
    truth = {"case": "a", "kind": "single", "effects": ["cross_flow"]}
    constants = Constants(2.0, 0.05, 0.5, 6.0, log_odds=0.3, occam=0.2)

    def of(rows: list[Hypothesis]) -> dict[str, float]:
        case = table(truth, {"hypotheses": [vars(row) for row in rows]})
        named = ["none", "cross_flow", "current", "unknown"]
        return dict(zip(named, posterior(case, constants).tolist(), strict=True))

    before, after = of(plain), of(with_other_forms(plain, available()))
    assert after["cross_flow"] == pytest.approx(ACTS * before["cross_flow"])
    assert after["unknown"] == pytest.approx(before["unknown"] + (1.0 - ACTS) * before["cross_flow"])
    assert (after["current"], after["none"]) == pytest.approx((before["current"], before["none"]))
