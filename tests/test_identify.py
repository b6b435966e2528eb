"""identify(): from a study to an estimate, whatever interrupts, repeats or goes wrong."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from known_glide import NOISE, TRUE, Glide, sailed, same, study
from nomoto_ship import begun, call

from seatruth import sample
from seatruth.commands.identify import _interval, show
from seatruth.costs.options import RegressionOptions
from seatruth.errors import BadInput
from seatruth.identification import identify
from seatruth.models.parameter import Prior
from seatruth.optimizers import Budget, from_callable
from seatruth.study import Study, load_study
from seatruth.trials.finding import Finding
from seatruth.trials.trial import Trial, Trials


def test_it_finds_what_was_put_in() -> None:
    found = identify(study(), threads=1)
    assert found.outcome["code"] == "converged"
    assert set(found.parameters["verdict"]) == {"identified"}
    for name, true in TRUE.items():
        row = found.parameters.loc[name]
        assert abs(row["value"] - true) < 4.0 * row["stderr"]
        assert row["stderr"] < 0.1 * true
        assert row["lower"] < row["value"] < row["upper"]
        assert row["stderr"] == pytest.approx(row["crlb"], rel=0.35)
    assert list(found.nuisances.index) == ["run 0: v", "run 0: s", "run 1: v", "run 1: s"]
    assert found.fit["ratio"].between(0.8, 1.3).all()
    assert set(found.fit.loc[found.fit["held_out"], "trial"]) == {"run 2"}
    assert (found.fit["rmse_start"] > found.fit["rmse"]).all()
    assert found.synthetic
    assert set(found.traces["trial"]) == {"run 0", "run 1", "run 2"}
    assert found.covariance.shape == (6, 6)
    assert found.provenance["study_hash"] == study().content_hash
    assert found.values == dict(found.parameters["value"])


def test_a_stated_noise_gives_way_to_the_misfit_where_that_is_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A diagnosis takes the data sheet's noise, a fit all that the model misses: one study file serves both."""
    monkeypatch.chdir(tmp_path)
    file = begun(tmp_path)
    file.write_text(file.read_text().replace("[noise]\n", '[noise]\nr = "5 deg/s"\n'))
    noise = []
    for options in ((), ("--estimate-noise",)):
        assert call("identify", "zigzag.toml", "--fresh", "-q", "--out", "out", *options) == 0
        fit = pd.read_parquet(tmp_path / "out" / "fit.parquet").set_index("channel")
        noise.append(float(fit.loc["r", "noise"]))
    assert noise[0] == pytest.approx(math.radians(5.0))
    assert noise[1] < 0.1 * noise[0]


@pytest.mark.slow
def test_intervals_hold_the_truth_as_often_as_they_say() -> None:
    """40 studies with noise of their own: 80 intervals of 95 %."""
    inside = 0
    for seed in range(40):
        found = identify(study(seed, holdout=Trials([])), threads=1).parameters
        inside += sum(found.loc[name, "lower"] < true < found.loc[name, "upper"] for name, true in TRUE.items())
    assert 70 <= inside <= 80


def test_noise_that_is_not_known_is_estimated() -> None:
    found = identify(study(noise={}), threads=1)
    assert found.cost["noise"]["v"]["sd"] == pytest.approx(0.02, rel=0.15)
    assert found.cost["noise"]["s"]["sd"] == pytest.approx(0.05, rel=0.15)
    known = identify(study(), threads=1)
    assert found.parameters["value"].to_numpy() == pytest.approx(known.parameters["value"].to_numpy(), rel=0.01)


@pytest.mark.parametrize("optimizer", ["least_squares", ["differential_swarm", "least_squares"]])
def test_same_seed_same_bytes_whatever_the_threads(optimizer: Any) -> None:
    budget = Budget(evaluations=1_500)
    runs = [
        identify(
            study(),
            optimizer,
            budget=budget,
            seed=3,
            threads=threads,
            workers=workers,
            profile=["a"],
            cross_validate=True,
        )
        for threads, workers in ((1, 1), (3, 2))
    ]
    same(*runs)
    assert runs[0].profile is not None
    assert runs[1].profile is not None
    pd.testing.assert_frame_equal(runs[0].profile["a"], runs[1].profile["a"], check_exact=True)
    pd.testing.assert_frame_equal(runs[0].cross_validation, runs[1].cross_validation, check_exact=True)


def test_profile_and_trials_left_out() -> None:
    found = identify(study(), threads=1, profile=["a", "b"], cross_validate=True)
    assert found.profile is not None
    assert found.cross_validation is not None
    for name in ("a", "b"):
        curve, row = found.profile[name], found.parameters.loc[name]
        low = curve["cost"].min()
        assert curve.loc[curve["cost"].idxmin(), "value"] == pytest.approx(row["value"], abs=0.5 * row["stderr"])
        # Near its minimum the profile is the parabola of the white-noise error.
        shift = (curve["value"] - row["value"]) / row["crlb"]
        inner = shift.abs() < 2.5
        assert (curve["cost"] - low)[inner].to_numpy() == pytest.approx(0.5 * shift[inner].to_numpy() ** 2, abs=0.25)
    left = found.cross_validation
    assert set(left["trial"]) == {"run 0", "run 1"}
    assert (left["rmse"] > 0.8 * left["rmse_fitted"]).all()
    assert (left["rmse"] < 3.0 * left["noise"]).all()


def test_a_model_that_diverges_everywhere_ends_in_words() -> None:
    class Exploding(Glide):
        name = "exploding"

        @staticmethod
        def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
            return (p.a + p.b + 1.0) * (1.0 + s.v * s.v) * 50.0, s.v

    found = identify(
        study().replace(model=Exploding()), "differential_swarm", budget=Budget(evaluations=200), threads=1
    )
    assert found.outcome["code"] == "failed"
    assert "diverged" in found.outcome["reason"]
    assert found.outcome["diverged"] > 0
    assert found.parameters["stderr"].isna().all()
    assert str(found)


def test_a_solver_that_raises_keeps_the_best_so_far(tmp_path: Path) -> None:
    def stumbling(problem: Any, rng: Any) -> str:
        problem.values(problem.population(rng, 20))
        raise RuntimeError("out of luck")

    found = identify(study(), from_callable(stumbling), threads=1)
    assert found.outcome["code"] == "failed"
    assert "out of luck" in found.outcome["reason"]
    assert math.isfinite(found.outcome["value"])
    assert any(finding.code == "not-at-minimum" for finding in found.findings)
    found.save(tmp_path)


def test_doubts_about_the_answer_are_printed_before_faults_of_the_data(capsys: pytest.CaptureFixture[str]) -> None:
    found = identify(study(), threads=1, budget=Budget(evaluations=9))
    faults = [Finding("warning", "stuck", "It stands still.", f"log {k}.csv") for k in range(9)]
    found.findings = [*faults, *found.findings]
    found.outcome = {**found.outcome, "code": "converged", "reason": "the steps no longer change"}
    show(found)
    printed = capsys.readouterr().out
    assert "converged: the steps no longer change, but short of a minimum" in " ".join(printed.split())
    assert "[not-at-minimum]" in printed
    assert "log 8.csv" not in printed


def test_what_cannot_be_started_is_said() -> None:
    with pytest.raises(BadInput, match="no profile"):
        identify(study(), profile=["m"])
    with pytest.raises(BadInput, match="workers"):
        identify(study(), workers=0)
    with pytest.raises(BadInput, match="at least two"):
        identify(study().replace(trials=Trials(sailed(1)[:1]), holdout=Trials([])), cross_validate=True)
    with pytest.raises(BadInput, match="Did you mean"):
        identify(study(), "least_square")
    with pytest.raises(BadInput, match="no parameter varies"):
        identify(study().replace(parameters=tuple(p.replace(vary=False) for p in Glide.parameters)))


def test_a_parameter_pressed_on_its_bound_is_said() -> None:
    bounded = (Glide.parameters[0].replace(min=0.7), *Glide.parameters[1:])
    row = identify(study(parameters=bounded), threads=1).parameters.loc["a"]
    assert (row["value"], row["verdict"], bool(row["at_bound"])) == (pytest.approx(0.7), "at bound", True)
    assert math.isnan(row["stderr"])


def test_a_prior_that_knows_more_than_the_data_is_said() -> None:
    told = (Glide.parameters[0].replace(prior=Prior(0.5, 1e-4)), *Glide.parameters[1:])
    row = identify(study(parameters=told), threads=1).parameters.loc["a"]
    assert (row["verdict"], row["prior_sd"]) == ("from prior", 1e-4)
    assert row["stderr"] == pytest.approx(1e-4, rel=0.05)


def coasting(**changes: Any) -> Study:
    """A study of a run without a push, where drag and mass times one factor are the same motion."""
    from seatruth.simulate import simulator

    t = np.arange(100) * 0.1
    bare = Trial("coasting", t, {"push": 0.0 * t}, {}, synthetic=True)
    y = simulator(Glide(), [bare]).outputs(np.zeros((1, 0)), np.array([[2.0, 0.0]])).y[0]
    noise = np.random.default_rng(1).normal(size=y.shape) * list(NOISE.values())
    outputs = {name: y[:, k] + noise[:, k] for k, name in enumerate(NOISE)}
    free = tuple(q.replace(vary=True, **changes.get(q.name, {})) for q in Glide.parameters)
    trials = Trials([Trial("coasting", t, bare.inputs, outputs)])
    return Study("coasting", Glide(), trials, parameters=free, noise=NOISE)


def test_parameters_that_trade_off_are_named() -> None:
    found = identify(coasting(), threads=1)
    (first, *_) = found.identifiability["weak"]
    assert first["sentence"].startswith("Scales cancel: a, b and m can be multiplied by one factor")
    assert first["combination"] == {"a": 1.0, "b": 1.0, "m": 1.0}
    assert set(found.parameters["verdict"]) <= {"not identifiable", "weak", "at bound"}


def test_a_scale_that_a_prior_holds_is_known_by_it() -> None:
    """A mass known to 1 % makes the drag known, which no such run shows; errors were infinite, as without the prior."""
    known = Glide.parameters[2].value
    found = identify(coasting(m={"prior": Prior(known, 0.01 * known)}), threads=1)
    table = found.parameters
    assert table.loc["m", ["value", "stderr"]].tolist() == pytest.approx([known, 0.01 * known], rel=0.1)
    assert table.loc["m", "verdict"] == "from prior"
    assert 0.01 < table.loc["b", "stderr"] / table.loc["b", "value"] < math.inf
    (first, *_) = found.identifiability["weak"]
    assert first["sentence"].endswith("No data of this kind determine that factor: priors alone do.")


def test_a_scale_that_ends_at_a_bound_is_as_free_as_before() -> None:
    """The bound holds one parameter, and the others then fit it alone: that says nothing of their values."""
    found = identify(coasting(b={"value": 1.1, "max": 1.1}), "newton", threads=1).parameters
    assert found["verdict"].to_dict() == {"a": "not identifiable", "b": "at bound", "m": "not identifiable"}
    assert found.loc[["a", "m"], "stderr"].tolist() == [math.inf, math.inf]


def test_coarse_steps_are_warned_of() -> None:
    every = slice(None, None, 4)
    coarse = [
        Trial(t.name, t.t[every], {"push": t.inputs["push"][every]}, {k: v[every] for k, v in t.outputs.items()})
        for t in sailed(1)
    ]
    found = identify(
        study(noise=dict.fromkeys("vs", 1e-5)).replace(trials=Trials(coarse), holdout=Trials([])), threads=1
    )
    assert any(finding.code == "coarse-steps" for finding in found.findings)
    assert found.discretisation["v"]["ratio"] > 0.3


def test_regression_cost_and_support_vectors() -> None:
    found = identify(study(cost=RegressionOptions(), noise={}), "ls_svm", threads=1)
    for name, true in TRUE.items():
        assert found.parameters.loc[name, "value"] == pytest.approx(true, rel=0.25)
    assert any(finding.code == "equation-error" for finding in found.findings)


def test_the_sample_study() -> None:
    found = identify(load_study(sample.FOLDER / sample.STUDY), threads=2)
    assert found.outcome["code"] == "converged"
    assert found.synthetic
    assert set(found.parameters["verdict"]) == {"identified"}
    fitted = found.fit[~found.fit["held_out"]]
    assert fitted["ratio"].between(0.85, 1.15).all()
    assert found.fit.loc[found.fit["held_out"], "ratio"].max() < 3.0


def test_the_ends_of_a_printed_interval_can_be_told_apart() -> None:
    assert _interval({"lower": 0.9999999, "upper": 1.0000001}) == "0.9999999 to 1.0000001"
    assert _interval({"lower": 0.02431428, "upper": 0.02435712}) == "0.0243143 to 0.0243571"
    assert _interval({"lower": -1.2, "upper": 3.4}) == "-1.2 to 3.4"
    assert _interval({"lower": float("nan"), "upper": float("nan")}) == ""
