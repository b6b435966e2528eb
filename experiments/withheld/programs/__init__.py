"""Diagnosing programs: the library's own, and simple ones to compare with. Each sees a study file and nothing else."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from withheld.programs import classifier, discrepancy, kinematics, linear, orthogonal, simple

BASELINES: dict[str, Callable[[Path], dict[str, Any]]] = {
    "rmse": simple.channel_rule,
    "bic": linear.refit_bic,
    "white": linear.white_unprojected,
    "sindy": discrepancy.sindy,
    "classifier": classifier.classifier,
    "orthogonal": orthogonal.orthogonal,
    "prior": simple.prior_only,
    "kinematics": kinematics.kinematics,
}
"""Name -> program: study file -> verdict."""
