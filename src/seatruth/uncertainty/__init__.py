"""Uncertainty of an estimate: standard errors, bounds, identifiability, profiles, cross-validation."""

from __future__ import annotations

from seatruth.statistics.autoregressive import (
    AutoregressiveModel,
    fit_autoregressive,
    lag_one_autocorrelation,
)
from seatruth.uncertainty.covariance import Covariance, covariance
from seatruth.uncertainty.cross_validation import leave_one_out
from seatruth.uncertainty.identifiability import (
    correlated_pairs,
    identifiability,
    plausible_range,
    strongly_correlated,
    verdict,
)
from seatruth.uncertainty.model_comparison import ModelComparison, compare_models, held_out_errors, repeated_folds
from seatruth.uncertainty.prediction import Prediction, prediction_intervals
from seatruth.uncertainty.prior_identifiability import prior_identifiability
from seatruth.uncertainty.profile import profiles
from seatruth.uncertainty.sensitivity import sensitivity
from seatruth.uncertainty.structural_identifiability import unidentifiable_directions

__all__ = [
    "AutoregressiveModel",
    "Covariance",
    "ModelComparison",
    "Prediction",
    "compare_models",
    "correlated_pairs",
    "covariance",
    "fit_autoregressive",
    "held_out_errors",
    "identifiability",
    "lag_one_autocorrelation",
    "leave_one_out",
    "plausible_range",
    "prediction_intervals",
    "prior_identifiability",
    "profiles",
    "repeated_folds",
    "sensitivity",
    "strongly_correlated",
    "unidentifiable_directions",
    "verdict",
]
