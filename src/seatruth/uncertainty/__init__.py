"""How sure an estimate is: standard errors, bounds, what cannot be told apart, profiles, trials left out."""

from __future__ import annotations

from seatruth.statistics.autoregressive import Colour, autocorrelation, colour_of
from seatruth.uncertainty.covariance import Covariance, covariance
from seatruth.uncertainty.cross_validation import leave_one_out
from seatruth.uncertainty.identifiability import identifiability, scale_of, tied, trade_offs, verdict
from seatruth.uncertainty.model_comparison import Preference, folds, left_out_errors, prefer
from seatruth.uncertainty.prediction import Prediction, prediction_intervals
from seatruth.uncertainty.prior_identifiability import excitation
from seatruth.uncertainty.profile import profiles
from seatruth.uncertainty.sensitivity import sensitivity
from seatruth.uncertainty.structural_identifiability import degeneracies

__all__ = [
    "Colour",
    "Covariance",
    "Prediction",
    "Preference",
    "autocorrelation",
    "colour_of",
    "covariance",
    "degeneracies",
    "excitation",
    "folds",
    "identifiability",
    "leave_one_out",
    "left_out_errors",
    "prediction_intervals",
    "prefer",
    "profiles",
    "scale_of",
    "sensitivity",
    "tied",
    "trade_offs",
    "verdict",
]
