"""The figures of the report, each a function of an Estimate that gives a matplotlib Figure (a notebook shows it)."""

from seatruth.report.figures.estimates import correlation, parameters, profile, sensitivity
from seatruth.report.figures.posterior import chains, corner
from seatruth.report.figures.quality import cross_validation, fit, history
from seatruth.report.figures.runs import autocorrelation, traces, tracks
from seatruth.report.figures.starts import waterfall
from seatruth.report.figures.tables import measured_against_computed

__all__ = [
    "autocorrelation",
    "chains",
    "corner",
    "correlation",
    "cross_validation",
    "fit",
    "history",
    "measured_against_computed",
    "parameters",
    "profile",
    "sensitivity",
    "traces",
    "tracks",
    "waterfall",
]
