"""The studies of the real ships: they load, check cleanly, and a quick fit predicts a run left out."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatruth import Study, Trial, Trials, identify, load_study
from seatruth.costs.options import as_trajectory
from seatruth.trials import check_trials

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "experiments" / "real_ships"
STUDIES = sorted(path.stem for path in FOLDER.glob("*.toml"))
DATA = ROOT.parent / "shared" / "data"
real = pytest.mark.skipif(not DATA.is_dir(), reason="the real trials (../shared/data) are not on this machine")


def _module(name: str) -> Any:
    spec = importlib.util.spec_from_file_location(f"real_ships_{name}", FOLDER / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


predict = _module("predict")
prior_widths = _module("prior_widths")
figures = _module("figures_with_intervals")


def _run(seconds: float, rate: float = 10.0) -> Trial:
    t = np.arange(0.0, seconds, 1 / rate)
    zero = np.zeros_like(t)
    outputs = {"x": 2.0 * t, "y": zero, "psi": zero, "u": zero + 2.0, "v": zero, "r": zero}
    return Trial(name="straight", t=t, inputs={"delta": zero, "n": zero + 10.0}, outputs=outputs)


def test_windows_follow_one_another_and_short_ends_are_left_out() -> None:
    assert [round(piece.duration, 1) for piece in predict.windows(_run(240.0))] == [99.9, 99.9]
    assert [round(piece.duration, 1) for piece in predict.windows(_run(260.0))] == [99.9, 99.9, 59.9]
    assert [round(piece.duration, 1) for piece in predict.windows(_run(30.0))] == [29.9]


def test_channels_that_agree_integrate_to_each_other() -> None:
    run = _run(50.0)
    assert max(predict.rmse([run], [predict.integrated(run)]).values()) < 1e-9


def test_a_figure_without_an_interval_is_shown_without_one() -> None:
    """A stage that is read back has None where a figure has no number: an unstable ship's turn, for one."""
    row = {"manoeuvre": "turn", "figure": "advance", "title": "advance", "unit": "m", "value": 3.0, "held_by": ""}
    row |= {"lower": None, "upper": None, "prior_share": None, "trial": "a", "measured": 3.1, "predicted": 3.0}
    found = {"planned": [row], "measured": [row], "lack_of_fit": 1.0, "model_error": 0.0, "conditions": {"speed": 0.3}}
    assert "3 m | nan to nan" in figures.text("ship", found, {"fitted": ["a"]})
    assert figures.coverage(found, {"fitted": ["a"]}).empty


@real
def test_priors_are_narrowed_and_every_fitted_run_is_predicted_from_the_others() -> None:
    study: Study = load_study(FOLDER / "kvlcc2_hsva.toml")
    narrow = prior_widths.narrowed(study, 0.5)
    for wide, tight in zip(study.parameters, narrow.parameters):
        assert (wide.prior is None) == (tight.prior is None)
        if wide.prior is not None:
            assert tight.prior.sd == pytest.approx(0.5 * wide.prior.sd)
            assert tight.prior.mean == wide.prior.mean
    free = ("R_0", "N_v")
    fixed = [p if p.name in free else p.replace(vary=False, prior=None) for p in study.parameters]
    few = study.replace(trials=study.trials.only(["Z_10_05", "Z_20_05"]), parameters=tuple(fixed))
    found = prior_widths.errors_left_out(few, 1.0, 0, 2)
    assert len(found) == 2
    assert np.isfinite(found).all()


@real
@pytest.mark.parametrize("name", STUDIES)
def test_studies_load_and_their_trials_have_no_errors(name: str) -> None:
    study = load_study(FOLDER / f"{name}.toml")
    assert len(study.trials) >= 2
    assert len(study.holdout) >= 2
    assert not {trial.name for trial in study.trials} & {trial.name for trial in study.holdout}
    assert all(p.prior is not None for p in study.free)
    assert not [f for f in check_trials((*study.trials, *study.holdout), study.model) if f.severity == "error"]


@real
def test_a_quick_fit_predicts_a_run_left_out_better_than_the_published_coefficients() -> None:
    study: Study = load_study(FOLDER / "kvlcc2_hsva.toml")
    free = ("R_0", "Y_v", "Y_r", "N_v", "N_r", "rudder_offset_angle")
    fixed = [p if p.name in free else p.replace(vary=False, prior=None) for p in study.parameters]
    quick = study.replace(
        trials=study.trials.only(["Z_10_05", "Z_20_05"]),
        holdout=Trials([]),
        parameters=tuple(fixed),
        cost=as_trajectory(study.cost).replace(initial="fixed", initial_sd={}),
    )
    estimate = identify(quick, threads=2)
    published = {p.name: p.value for p in study.parameters}
    pieces = predict.windows(study.holdout["Z_15_05"])
    before, after = (
        predict.rmse(pieces, predict.simulated(study, values, pieces, 2))
        for values in (published, published | estimate.values)
    )
    assert after["u"] < 0.5 * before["u"]
    assert all(after[name] < before[name] for name in ("v", "r", "psi", "x", "y"))
