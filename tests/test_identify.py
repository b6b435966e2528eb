"""identify(): from a study to an estimate, whatever interrupts, repeats or goes wrong."""

from __future__ import annotations

import errno
import math
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import seatruth.analysis
from seatruth import sample
from seatruth.errors import BadInput, PluginError
from seatruth.estimate import NAME, Estimate
from seatruth.identification import Study, identify
from seatruth.models.base import Model
from seatruth.models.parameter import Parameter, Prior
from seatruth.optimizers import Budget, from_callable
from seatruth.study import load_study
from seatruth.trials.channel import Channel
from seatruth.trials.trial import Step, Trial, Trials


class Glide(Model):
    """dv/dt = (push - a v - b v|v|) / m: a known motion with two things to find."""

    name = "glide"
    title = "A body pushed through water"
    states = (Channel("v", "m/s"), Channel("s", "m"))
    inputs = (Channel("push", "N"),)
    outputs = states
    parameters = (
        Parameter("a", 0.8, "N s/m", 0.0, 4.0, vary=True, source="test"),
        Parameter("b", 1.2, "N s2/m2", 0.0, 6.0, vary=True, source="test"),
        Parameter("m", 2.0, "kg", 0.5, 9.0, source="test"),
    )

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return (i.push - p.a * s.v - p.b * s.v * abs(s.v)) / p.m, s.v


TRUE = {"a": 0.5, "b": 2.0}
NOISE = {"v": 0.02, "s": 0.05}


def sailed(seed: int, runs: int = 3, n: int = 150) -> list[Trial]:
    from seatruth.simulate import simulator

    rng = np.random.default_rng(seed)
    found = []
    for k in range(runs):
        t = np.arange(n) * 0.2
        push = 2.0 * np.sign(np.sin(0.5 * t + k)) + np.sin(0.2 * t)
        bare = Trial(f"run {k}", t, {"push": push}, {}, synthetic=True)
        values = {**Glide().nominal(), **TRUE}
        y = simulator(Glide(), [bare], values=values).outputs(np.zeros((1, 0)), np.zeros((1, 2))).y[0]
        outputs = {name: y[:, c] + rng.normal(size=n) * NOISE[name] for c, name in enumerate(("v", "s"))}
        found.append(Trial(f"run {k}", t, {"push": push}, outputs, synthetic=True))
    return found


def study(seed: int = 1, **changes: Any) -> Study:
    trials = sailed(seed)
    fields: dict[str, Any] = {"holdout": Trials(trials[2:]), "noise": NOISE, "initial": "free", **changes}
    return Study("glide", Glide(), Trials(trials[:2]), **fields)


def same(a: Estimate, b: Estimate) -> None:
    """Same bytes in everything but wall-clock times."""
    for name in ("parameters", "nuisances", "covariance", "sensitivity", "fit", "traces"):
        pd.testing.assert_frame_equal(getattr(a, name), getattr(b, name), check_exact=True)
    for name in ("optimizer", "cost", "identifiability", "discretisation", "seed"):
        assert getattr(a, name) == getattr(b, name), name
    timeless = [{k: v for k, v in e.outcome.items() if k != "wall_s"} for e in (a, b)]
    assert timeless[0] == timeless[1]
    assert list(a.history["best"]) == list(b.history["best"])


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


def test_saved_and_reloaded_exactly(tmp_path: Path) -> None:
    trials = [trial.with_step(Step("cut", {"start": 1.0, "list": (1, 2)}, "cut")) for trial in sailed(1)]
    found = identify(study().but(trials=Trials(trials)), threads=1, profile=["b"], cross_validate=True)
    found.parameters.loc["a", "stderr"] = math.inf
    again = Estimate.load(found.save(tmp_path / "result"))
    for name in ("parameters", "nuisances", "covariance", "correlation", "sensitivity", "fit", "history", "traces"):
        pd.testing.assert_frame_equal(getattr(found, name), getattr(again, name), check_exact=True)
    pd.testing.assert_frame_equal(found.cross_validation, again.cross_validation, check_exact=True)
    assert found.profile is not None
    assert again.profile is not None
    pd.testing.assert_frame_equal(found.profile["b"], again.profile["b"], check_exact=True)
    for name in ("study", "model", "optimizer", "cost", "seed", "synthetic", "channels", "identifiability", "outcome"):
        assert getattr(found, name) == getattr(again, name), name
    for name in ("discretisation", "steps", "findings", "provenance"):
        assert getattr(found, name) == getattr(again, name), name
    assert str(found) == str(again)
    assert found._repr_html_() == again._repr_html_()
    assert "SYNTHETIC" in str(found)


def test_a_result_that_cannot_be_written_leaves_the_one_before(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = identify(study(), threads=1, profile=["b"], cross_validate=True)
    folder = first.save(tmp_path / "result")
    stood = sorted(path.name for path in folder.iterdir())
    second = identify(study(seed=2), threads=1)
    plain, calls = os.fsync, [0]

    def full(handle: int) -> None:
        calls[0] += 1
        if calls[0] == 4:
            raise OSError(errno.ENOSPC, "No space left on device")
        plain(handle)

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        with pytest.raises(OSError, match="No space left") as problem:
            second.save(folder)
    assert str(folder) in str(problem.value.filename)
    assert sorted(path.name for path in folder.iterdir()) == stood
    assert Estimate.load(folder).values == first.values
    second.save(folder)
    assert Estimate.load(folder).values == second.values
    # Nothing of the first one is left to be taken for the second's.
    assert {"cross_validation.parquet", "profile_0.parquet"} & {path.name for path in folder.iterdir()} == set()


def test_a_damaged_result_is_said(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="there is no estimate"):
        Estimate.load(tmp_path)
    folder = identify(study(), threads=1).save(tmp_path / "result")
    table = folder / "parameters.parquet"
    whole = table.read_bytes()
    table.write_bytes(whole[:-20])
    with pytest.raises(BadInput, match="damaged"):
        Estimate.load(folder)
    table.write_bytes(whole)
    text = (folder / NAME).read_text()
    for broken, words in ((text[:100], "cannot be read"), ("[]", "no estimate"), ('{"format": 1}', "damaged")):
        (folder / NAME).write_text(broken)
        with pytest.raises(BadInput, match=words):
            Estimate.load(folder)


def stopping(after: int) -> Callable[..., Any]:
    """`values` of the cost, with Ctrl-C pressed in its n-th call."""
    from seatruth.costs.trajectory import TrajectoryCost

    plain, calls = TrajectoryCost.values, [0]

    def values(self: Any, X: Any) -> Any:
        calls[0] += 1
        if calls[0] == after:
            raise KeyboardInterrupt
        return plain(self, X)

    return values


def test_an_interrupted_search_goes_on_to_the_same_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from seatruth.costs.trajectory import TrajectoryCost

    plan: dict[str, Any] = {"budget": Budget(evaluations=1_000), "seed": 2, "threads": 1}
    whole = identify(study(), "differential_swarm", **plan)
    with monkeypatch.context() as patch:
        patch.setattr(TrajectoryCost, "values", stopping(6))
        cut = identify(study(), "differential_swarm", checkpoint=tmp_path / "run", **plan)
    assert cut.outcome["code"] == "interrupted"
    assert cut.outcome["evaluations"] < whole.outcome["evaluations"]
    assert np.isfinite(cut.parameters["value"]).all()
    again = identify(study(), "differential_swarm", checkpoint=tmp_path / "run", **plan)
    same(whole, again)


def test_an_interrupt_after_the_search_keeps_the_answer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = identify(study(), threads=1, cross_validate=True)
    with monkeypatch.context() as patch:
        patch.setattr(seatruth.analysis, "sensitivity", _interrupt)
        cut = identify(study(), threads=1, checkpoint=tmp_path / "run")
    assert cut.outcome["code"] == "interrupted"
    assert cut.values == whole.values
    assert np.isfinite(cut.parameters["stderr"]).all()
    assert len(cut.sensitivity) == 0
    cut.save(tmp_path / "cut")
    assert Estimate.load(tmp_path / "cut").values == whole.values
    with monkeypatch.context() as patch:
        patch.setattr("seatruth.identification.leave_one_out", _interrupt)
        cut = identify(study(), threads=1, checkpoint=tmp_path / "run", cross_validate=True)
    assert cut.outcome["code"] == "interrupted"
    assert cut.cross_validation is None
    again = identify(study(), threads=1, checkpoint=tmp_path / "run", cross_validate=True)
    same(whole, again)


@pytest.mark.parametrize("stage", ["profile", "trials left out"])
def test_an_interrupt_within_a_fit_after_the_search(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, stage: str
) -> None:
    """Ctrl-C reaches the driver of one of the many small fits: that fit is no finished piece, the others are."""
    from seatruth.costs.trajectory import TrajectoryCost

    plan: dict[str, Any] = {"threads": 1, "workers": 1}
    plan |= {"profile": ["b"]} if stage == "profile" else {"cross_validate": True}
    alone = study(holdout=Trials([]))
    whole = identify(alone, **plan)
    plain, costs = TrajectoryCost.residuals, list[Any]()

    def residuals(self: Any, x: Any) -> Any:
        if not any(self is cost for cost in costs):
            costs.append(self)
        # The search's, the first fit's (with trials left out also that of the prediction's start), then the second's.
        if len(costs) == (3 if stage == "profile" else 4):
            raise KeyboardInterrupt
        return plain(self, x)

    with monkeypatch.context() as patch:
        patch.setattr(TrajectoryCost, "residuals", residuals)
        cut = identify(alone, checkpoint=tmp_path / "run", **plan)
    assert cut.outcome["code"] == "interrupted"
    assert cut.values == whole.values
    assert cut.profile is None
    assert cut.cross_validation is None
    assert len((tmp_path / "run.pieces").read_text().splitlines()) == 2  # whose they are, and the one that was done
    again = identify(alone, checkpoint=tmp_path / "run", **plan)
    same(whole, again)
    if stage == "profile":
        assert whole.profile is not None
        assert again.profile is not None
        pd.testing.assert_frame_equal(whole.profile["b"], again.profile["b"], check_exact=True)
    else:
        pd.testing.assert_frame_equal(whole.cross_validation, again.cross_validation, check_exact=True)


def test_a_model_that_raises_after_the_search_costs_only_that_part(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: Any, **__: Any) -> Any:
        raise PluginError("its function raised ValueError: no such water")

    monkeypatch.setattr(seatruth.analysis, "sensitivity", broken)
    for name in ("leave_one_out", "profiles"):
        monkeypatch.setattr(f"seatruth.identification.{name}", broken)
    found = identify(study(), threads=1, profile=["a"], cross_validate=True)
    assert found.outcome["code"] == "converged"
    assert np.isfinite(found.parameters["stderr"]).all()
    assert found.discretisation
    assert (found.profile, found.cross_validation) == (None, None)
    said = [finding.message for finding in found.findings if finding.code == "part-missing"]
    assert len(said) == 3
    assert all("no such water" in sentence for sentence in said)


def _interrupt(*_: Any, **__: Any) -> Any:
    raise KeyboardInterrupt


def test_a_model_that_diverges_everywhere_ends_in_words() -> None:
    class Exploding(Glide):
        name = "exploding"

        @staticmethod
        def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
            return (p.a + p.b + 1.0) * (1.0 + s.v * s.v) * 50.0, s.v

    found = identify(study().but(model=Exploding()), "differential_swarm", budget=Budget(evaluations=200), threads=1)
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


def test_what_cannot_be_started_is_said() -> None:
    with pytest.raises(BadInput, match="no profile"):
        identify(study(), profile=["m"])
    with pytest.raises(BadInput, match="workers"):
        identify(study(), workers=0)
    with pytest.raises(BadInput, match="at least two"):
        identify(study().but(trials=Trials(sailed(1)[:1]), holdout=Trials([])), cross_validate=True)
    with pytest.raises(BadInput, match="Did you mean"):
        identify(study(), "least_square")
    with pytest.raises(BadInput, match="no parameter varies"):
        identify(study().but(parameters=tuple(p.but(vary=False) for p in Glide.parameters)))


def test_a_parameter_pressed_on_its_bound_is_said() -> None:
    bounded = (Glide.parameters[0].but(min=0.7), *Glide.parameters[1:])
    row = identify(study(parameters=bounded), threads=1).parameters.loc["a"]
    assert (row["value"], row["verdict"], bool(row["at_bound"])) == (pytest.approx(0.7), "at bound", True)
    assert math.isnan(row["stderr"])


def test_a_prior_that_knows_more_than_the_data_is_said() -> None:
    told = (Glide.parameters[0].but(prior=Prior(0.5, 1e-4)), *Glide.parameters[1:])
    row = identify(study(parameters=told), threads=1).parameters.loc["a"]
    assert (row["verdict"], row["prior_sd"]) == ("from prior", 1e-4)
    assert row["stderr"] == pytest.approx(1e-4, rel=0.05)


def test_parameters_that_trade_off_are_named() -> None:
    """Without a known push, drag and mass times one factor are the same motion."""
    from seatruth.simulate import simulator

    t = np.arange(100) * 0.1
    bare = Trial("coasting", t, {"push": 0.0 * t}, {}, synthetic=True)
    y = simulator(Glide(), [bare]).outputs(np.zeros((1, 0)), np.array([[2.0, 0.0]])).y[0]
    noise = np.random.default_rng(1).normal(size=y.shape) * list(NOISE.values())
    outputs = {name: y[:, k] + noise[:, k] for k, name in enumerate(NOISE)}
    free = tuple(parameter.but(vary=True) for parameter in Glide.parameters)
    coasting = Study(
        "coasting", Glide(), Trials([Trial("coasting", t, bare.inputs, outputs)]), parameters=free, noise=NOISE
    )
    found = identify(coasting, threads=1)
    (first, *_) = found.identifiability["weak"]
    assert "trade off" in first["sentence"]
    assert set(first["combination"]) == {"a", "b", "m"}
    assert set(found.parameters["verdict"]) <= {"not identifiable", "weak", "at bound"}


def test_coarse_steps_are_warned_of() -> None:
    every = slice(None, None, 4)
    coarse = [
        Trial(t.name, t.t[every], {"push": t.inputs["push"][every]}, {k: v[every] for k, v in t.outputs.items()})
        for t in sailed(1)
    ]
    found = identify(study(noise=dict.fromkeys("vs", 1e-5)).but(trials=Trials(coarse), holdout=Trials([])), threads=1)
    assert any(finding.code == "coarse-steps" for finding in found.findings)
    assert found.discretisation["v"]["ratio"] > 0.3


def test_regression_cost_and_support_vectors() -> None:
    found = identify(study(cost="regression", noise={}, initial="fixed"), "ls_svm", threads=1)
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
