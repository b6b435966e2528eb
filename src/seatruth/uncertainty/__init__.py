"""How sure an estimate is: standard errors, bounds, what cannot be told apart, profiles, trials left out."""

from __future__ import annotations

from seatruth.uncertainty.coloured import Colour, autocorrelation, colour_of
from seatruth.uncertainty.covariance import Covariance, covariance
from seatruth.uncertainty.degeneracy import degeneracies
from seatruth.uncertainty.identifiability import identifiability, scale_of, tied, trade_offs, verdict
from seatruth.uncertainty.leave_out import leave_one_out
from seatruth.uncertainty.prediction import Prediction, prediction_intervals
from seatruth.uncertainty.preview import excitation
from seatruth.uncertainty.profile import profiles
from seatruth.uncertainty.rivals import Preference, folds, left_out_errors, prefer
from seatruth.uncertainty.sensitivity import sensitivity

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
