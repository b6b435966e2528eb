"""Standard errors that are those of rounding, on a certified problem whose residuals are rounding."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from seatruth import Parameter, Study, identify
from seatruth.study import formula_study
from seatruth.uncertainty.rounding import rounded_finding


def lanczos1() -> Study:
    """NIST's Lanczos1: three exponentials to 13 digits, so that the residuals of the best fit are 1e-13."""
    x = np.round(np.arange(24) * 0.05, 2)
    exact = 0.0951 * np.exp(-x) + 0.8607 * np.exp(-3.0 * x) + 1.5576 * np.exp(-5.0 * x)
    table = pd.DataFrame({"x": x, "y": [float(f"{value:.12e}") for value in exact]})
    start = [0.5, 0.7, 3.6, 4.2, 4.0, 6.3]
    parameters = [Parameter(f"b{k + 1}", value, vary=True) for k, value in enumerate(start)]
    formula = "y = b1*exp(-b2*x) + b3*exp(-b4*x) + b5*exp(-b6*x)"
    return formula_study(formula, table, parameters, noise="estimate")


def test_standard_errors_that_are_those_of_rounding_say_so() -> None:
    """Certified errors are met to three digits here: rounding the data alone changes the sum of squares by 1e-3."""
    found = identify(lanczos1(), threads=1)
    assert found.parameters["value"].to_numpy() == pytest.approx([0.0951, 1.0, 0.8607, 3.0, 1.5576, 5.0], rel=1e-9)
    certified = [5.3347304234e-11, 2.7473038179e-10, 1.3576062225e-10, 3.3308253069e-10, 1.8815731448e-10]
    assert found.parameters["stderr"].to_numpy()[:5] == pytest.approx(certified, rel=5e-3)
    (finding,) = [finding for finding in found.findings if finding.code == "residuals-of-rounding"]
    assert finding.severity == "warning"
    assert "at most 3 right digits" in finding.message
    assert set(found.parameters["verdict"]) == {"identified"}


def test_noise_that_is_small_but_real_is_no_rounding() -> None:
    study = lanczos1()
    (trial,) = study.trials
    noisy = trial.outputs["y"] + 1e-9 * np.random.default_rng(0).normal(size=24)
    found = identify(replace(study, trials=[replace(trial, outputs={"y": noisy})]), threads=1)
    assert "residuals-of-rounding" not in {finding.code for finding in found.findings}


def test_what_rounding_makes_of_standard_errors_is_put_in_digits() -> None:
    assert rounded_finding({"u": 1e-6}) is None
    found = rounded_finding({"u": 1e-6, "v": 0.02, "r": 1.0})
    assert found is not None
    assert "v and r" in found.message
    assert "no right digit" in found.message
    one = rounded_finding({"v": 0.02})
    assert one is not None
    assert (one.channel, "at most 1 right digit " in one.message) == ("v", True)
