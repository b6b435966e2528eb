"""How sure an estimate is: standard errors, bounds, what cannot be told apart, profiles, trials left out."""

from __future__ import annotations

from seatruth.uncertainty.coloured import Colour, autocorrelation, colour_of
from seatruth.uncertainty.covariance import Covariance, covariance
from seatruth.uncertainty.identifiability import identifiability, scale_of, tied, trade_offs, verdict
from seatruth.uncertainty.leave_out import leave_one_out
from seatruth.uncertainty.preview import excitation
from seatruth.uncertainty.profile import profiles
from seatruth.uncertainty.sensitivity import sensitivity

__all__ = [
    "Colour",
    "Covariance",
    "autocorrelation",
    "colour_of",
    "covariance",
    "excitation",
    "identifiability",
    "leave_one_out",
    "profiles",
    "scale_of",
    "sensitivity",
    "tied",
    "trade_offs",
    "verdict",
]
