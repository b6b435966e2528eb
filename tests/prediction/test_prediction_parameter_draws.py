"""Draws have the covariance that they claim, stay inside bounds, and split it between trials and priors."""

from __future__ import annotations

import dataclasses

import numpy as np
import pandas as pd
import pytest
from known_ship import FREE, fitted, study

from seatruth import RegressionOptions, Trials, identify
from seatruth.errors import BadInput
from seatruth.prediction.parameter_draws import parameter_draws


def test_draws_have_the_two_parts_of_the_covariance() -> None:
    made, estimate = fitted()
    drawn = parameter_draws(made, estimate, 4000, 1, 1)
    whole = drawn.trials + drawn.priors
    assert drawn.X.shape == (4000, len(FREE))
    assert np.sqrt(np.diag(whole)) == pytest.approx(drawn.X.std(axis=0), rel=0.12)
    # Without lack of fit, the whole is the covariance of the estimate; the bounds as priors hardly count.
    stated = estimate.covariance.loc[list(drawn.names), list(drawn.names)].to_numpy()
    factor = max(1.0, drawn.lack_of_fit)
    assert np.diag(drawn.trials / factor + drawn.priors) == pytest.approx(np.diag(stated), rel=0.02)
    assert drawn.moved == 0.0
    again = parameter_draws(made, estimate, 4000, 1, 1)
    assert np.array_equal(again.X, drawn.X)


def test_a_direction_that_the_trials_do_not_hold_has_its_prior() -> None:
    made, estimate = fitted()
    names = [p.name for p in made.free]
    loose = made.replace(noise={name: 1e4 * sd for name, sd in made.noise.items()})
    drawn = parameter_draws(loose, estimate, 200, 0, 1)
    for k, name in enumerate(names):
        assert np.sqrt(drawn.priors[k, k]) == pytest.approx(FREE[name], rel=0.05)
        assert drawn.trials[k, k] < 0.05 * drawn.priors[k, k]


def test_bounds_are_kept_and_take_the_place_of_priors() -> None:
    made = study(priors=False, noise={"x": 50.0, "y": 50.0, "psi": 3.0, "u": 10.0, "v": 10.0, "r": 3.0})
    estimate = identify(study(priors=False), threads=1)
    drawn = parameter_draws(made, estimate, 300, 0, 1)
    for k, parameter in enumerate(made.free):
        assert drawn.X[:, k].min() >= parameter.min
        assert drawn.X[:, k].max() <= parameter.max
    spread = {p.name: drawn.X[:, k].std() / (p.max - p.min) for k, p in enumerate(made.free)}
    assert max(spread.values()) > 0.1
    assert drawn.fixed_by_nothing == ()


def test_a_regression_has_draws_as_well() -> None:
    made = study(cost=RegressionOptions(), noise=dict.fromkeys(("x", "y", "psi", "u", "v", "r"), 1e-4))
    drawn = parameter_draws(made, identify(made, threads=1), 100, 0, 1)
    assert np.isfinite(drawn.X).all()
    assert (drawn.X.std(axis=0) > 0).all()


def test_one_trial_shows_no_lack_of_fit() -> None:
    made, _ = fitted()
    one = made.replace(trials=Trials([made.trials[0]]))
    assert np.isnan(parameter_draws(one, identify(one, threads=1), 60, 0, 1).lack_of_fit)


def test_trials_that_contradict_each_other_widen_the_draws() -> None:
    """The second trial is of another ship; whatever is fitted, the two pull the parameters apart."""
    made = study()
    other = study({"N_r": -0.060, "Y_v": -0.40}, seed=5)
    torn = made.replace(trials=Trials([made.trials[0], dataclasses.replace(other.trials[1], name="other")]))
    drawn = parameter_draws(torn, identify(torn, threads=1), 60, 0, 1)
    agreed = parameter_draws(*fitted(), 60, 0, 1)
    assert drawn.lack_of_fit > 3 * agreed.lack_of_fit


def test_an_estimate_of_another_study_is_refused() -> None:
    made, estimate = fitted()
    fewer = tuple(p.replace(vary=False, prior=None) if p.name == "N_v" else p for p in made.parameters)
    with pytest.raises(BadInput, match="another study: it has a 'N_v'"):
        parameter_draws(made.replace(parameters=fewer), estimate, 60, 0, 1)
    broken = dataclasses.replace(estimate, parameters=estimate.parameters.drop(index="N_v"))
    with pytest.raises(BadInput, match="no 'N_v'"):
        parameter_draws(made, broken, 60, 0, 1)
    wild = estimate.parameters.copy()
    wild["value"] = pd.Series([9.0] * len(wild), index=wild.index)
    with pytest.raises(BadInput, match="diverges"):
        parameter_draws(made, dataclasses.replace(estimate, parameters=wild), 60, 0, 1)
