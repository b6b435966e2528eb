"""The posterior: exact where it is known, inside the bounds, the same bytes for a seed, honest about a short chain."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from known_glide import study as glide

import seatruth.uncertainty.posterior as sampling
from seatruth import BadInput, Estimate, Parameter, identify
from seatruth.models.parameter import Prior
from seatruth.statistics.posterior_sample import Posterior
from seatruth.study import Study, formula_study

pytest.importorskip("emcee")
NOISE = 0.05
X = np.linspace(0.0, 1.0, 40)
Y = 1.0 + 2.0 * X + NOISE * np.cos(40.0 * X)


def line(*, prior: Prior | None = None, noise: Any = NOISE, **bounds: Any) -> Study:
    free = [Parameter("a", 0.5, vary=True, prior=prior), Parameter("b", 2.5, vary=True, **bounds)]
    return formula_study("y = a + b*x", pd.DataFrame({"x": X, "y": Y}), free, noise=noise, name="line")


def sampled(study: Study, **options: Any) -> Posterior:
    found = identify(study, threads=1, **{"posterior": True, "seed": 1, **options}).posterior
    assert found is not None
    return found


@pytest.mark.parametrize("prior", [None, Prior(0.9, 0.01)])
def test_of_a_linear_problem_it_is_the_exact_one(prior: Prior | None) -> None:
    found = sampled(line(prior=prior))
    A, y = np.stack([np.ones_like(X), X], axis=1), Y
    precision, right = A.T @ A / NOISE**2, A.T @ y / NOISE**2
    if prior is not None:
        precision[0, 0] += prior.sd**-2
        right[0] += prior.mean / prior.sd**2
    covariance = np.linalg.inv(precision)
    mean, sd = covariance @ right, np.sqrt(np.diag(covariance))
    draws = found.draws.to_numpy()
    effective = found.summary["effective_samples"].to_numpy()
    assert found.long_enough
    assert (np.abs(found.summary["mean"] - mean) < 4.0 * sd / np.sqrt(effective)).all()
    np.testing.assert_allclose(found.summary["sd"], sd, rtol=4.0 / np.sqrt(2.0 * effective.min()))
    exact = covariance[0, 1] / sd.prod()
    assert np.corrcoef(draws.T)[0, 1] == pytest.approx(exact, abs=4.0 * (1.0 - exact**2) / np.sqrt(effective.min()))
    np.testing.assert_allclose(found.summary["lower"], mean - 1.96 * sd, atol=0.15 * sd.max())
    np.testing.assert_allclose(found.summary["upper"], mean + 1.96 * sd, atol=0.15 * sd.max())


def test_a_noise_that_is_estimated_widens_it_to_student_s_t() -> None:
    """The likelihood with the best noise inserted is that with the noise integrated out under Jeffreys' prior."""
    found = sampled(line(noise="estimate"))
    A = np.stack([np.ones_like(X), X], axis=1)
    best = np.linalg.lstsq(A, Y, rcond=None)
    degrees = len(X) - 2
    scale = float(best[1][0]) / degrees
    sd = np.sqrt(np.diag(np.linalg.inv(A.T @ A)) * scale * degrees / (degrees - 2))
    np.testing.assert_allclose(found.summary["sd"], sd, rtol=0.06)


def test_it_stays_within_the_bounds_and_piles_up_at_them() -> None:
    found = sampled(line(min=2.05, max=3.0))  # the best is near 2.0
    draws = found.draws["b"]
    assert draws.between(2.05, 3.0).all()
    assert draws.quantile(0.5) < 2.08
    assert found.summary.loc["b", "lower"] < 2.053


def test_same_seed_same_bytes_whatever_the_workers(tmp_path: Path) -> None:
    plan: dict[str, Any] = {"posterior": True, "posterior_steps": 250, "seed": 3}
    first = identify(glide(), threads=1, workers=1, **plan)
    second = identify(glide(), threads=2, workers=3, **plan)
    assert first.posterior is not None
    assert second.posterior is not None
    pd.testing.assert_frame_equal(first.posterior.chain, second.posterior.chain, check_exact=True)
    pd.testing.assert_frame_equal(first.traces, second.traces, check_exact=True)
    other = identify(glide(), threads=1, **{**plan, "seed": 4}).posterior
    assert other is not None
    assert not other.chain.equals(first.posterior.chain)
    first.save(tmp_path / "saved")
    again = Estimate.load(tmp_path / "saved")
    assert again.posterior is not None
    pd.testing.assert_frame_equal(again.posterior.chain, first.posterior.chain, check_exact=True)
    pd.testing.assert_frame_equal(again.posterior.summary, first.posterior.summary, check_exact=True)
    assert (again.posterior.steps, again.posterior.burn_in) == (250, first.posterior.burn_in)
    assert again.ensemble == first.ensemble
    identify(glide(), threads=1, seed=3).save(tmp_path / "saved")
    assert not list((tmp_path / "saved").glob("posterior*"))
    assert Estimate.load(tmp_path / "saved").posterior is None


def test_an_interrupted_sample_goes_on_to_the_same_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plan: dict[str, Any] = {"posterior_steps": 350}
    whole = sampled(line(), **plan)
    plain, blocks = sampling._stored, list[int]()

    def stored(sampler: Any) -> Any:
        blocks.append(1)
        if len(blocks) == 3:
            raise KeyboardInterrupt
        return plain(sampler)

    with monkeypatch.context() as patch:
        patch.setattr(sampling, "_stored", stored)
        cut = identify(line(), threads=1, seed=1, posterior=True, checkpoint=tmp_path / "run", **plan)
    assert cut.outcome["code"] == "interrupted"
    assert cut.posterior is None
    events: list[Any] = []
    again = sampled(line(), checkpoint=tmp_path / "run", progress=events.append, **plan)
    pd.testing.assert_frame_equal(again.chain, whole.chain, check_exact=True)
    shown = [event for event in events if event.stage == "Posterior" and event.done]
    assert shown[0].done > 200  # the first two blocks were not sampled again
    assert shown[-1].done == 350


def test_a_chain_that_is_too_short_says_so() -> None:
    found = identify(line(), threads=1, posterior=True, posterior_steps=60)
    assert found.posterior is not None
    assert not found.posterior.long_enough
    said = [finding for finding in found.findings if finding.code == "posterior-short"]
    assert len(said) == 1
    assert "60 steps" in said[0].message
    tiny = identify(line(), threads=1, posterior=True, posterior_steps=1)
    assert any(finding.code == "posterior-short" for finding in tiny.findings)


def test_a_direction_that_nothing_limits_has_no_posterior() -> None:
    table = pd.DataFrame({"x": X, "y": Y})
    free = [Parameter(name, 1.0, vary=True) for name in ("a", "b")]
    made = formula_study("y = (a + b)*x", table, free, noise=NOISE, name="sum")
    found = identify(made, threads=1, posterior=True)
    assert found.posterior is None
    assert any("nothing limits a and b" in finding.message for finding in found.findings)
    limited = made.replace(parameters=[one.replace(min=-50.0, max=50.0) for one in free])
    assert not [one for one in identify(limited, threads=1, posterior=True).findings if one.where == "posterior"]


def test_a_single_parameter_that_a_bound_holds() -> None:
    table = pd.DataFrame({"x": X, "y": 2.0 * X})
    made = formula_study("y = b*x", table, [Parameter("b", 1.0, max=1.9, vary=True)], noise=NOISE, name="held")
    found = sampled(made)
    assert found.draws["b"].max() <= 1.9
    assert found.summary.loc["b", "median"] == pytest.approx(1.88, abs=0.02)


def test_residuals_that_are_not_white_are_named() -> None:
    steps = pd.DataFrame({"mean": [0.0], "autocorrelation_time": [1.0]}, index=["a"])
    apart = steps.assign(autocorrelation_time=np.inf)
    drifting = sampling.posterior_findings(Posterior(pd.DataFrame(), apart, 32, 1000, 10, 0.3), 1.1)
    assert [finding.code for finding in drifting] == ["posterior-drifts"]
    long = Posterior(pd.DataFrame(), steps, 32, 1000, 10, 0.3)
    assert sampling.posterior_findings(long, 1.1) == []
    assert [finding.code for finding in sampling.posterior_findings(long, 3.0)] == ["posterior-narrow"]


def test_without_emcee_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "emcee", None)
    with pytest.raises(BadInput, match=r'pip install "seatruth\[posterior\]"'):
        identify(line(), posterior=True)
    assert identify(line(), threads=1).posterior is None


def test_emcee_is_loaded_only_when_it_is_asked_for() -> None:
    code = "import sys, seatruth.identification, seatruth.cli; sys.exit('emcee' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@pytest.mark.parametrize("steps", [0, -3, 2.5, True, 10**9])
def test_steps_that_are_none_are_refused(steps: Any) -> None:
    with pytest.raises(BadInput, match="steps are not possible"):
        identify(line(), posterior=True, posterior_steps=steps)
