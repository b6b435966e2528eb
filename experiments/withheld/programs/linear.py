"""Programs that compare effects one by one, to first order, with the noise taken as white."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from withheld.programs.common import Array, refitted, soft
from withheld.verdicts import verdict


def left(residuals: Array, columns: Array) -> Array:
    """What is left of residuals after the best combination of columns."""
    scale = np.linalg.norm(columns, axis=0)
    used = columns[:, scale > 0] / scale[scale > 0]
    if used.shape[1] == 0:
        return residuals
    return np.asarray(residuals - used @ np.linalg.lstsq(used, residuals, rcond=1e-10)[0])


def refit_bic(study: Path) -> dict[str, Any]:
    """Refits the coefficients together with one effect after the other and compares Bayesian information criteria.

    Each refit is one Gauss-Newton step from the refitted baseline. All samples count as independent.
    """
    found = refitted(study)
    base = left(found.residuals, found.nuisances)
    q, _ = np.linalg.qr(found.nuisances / np.maximum(np.linalg.norm(found.nuisances, axis=0), 1e-300))
    scores = {"": 0.0}
    for name, columns in found.signatures.items():
        rest = left(base, columns - q @ (q.T @ columns))
        gain = float(base @ base - rest @ rest)
        scores[name] = 0.5 * (gain - columns.shape[1] * math.log(found.data))
    return verdict(study.parent.name, soft(scores))


def white_unprojected(study: Path) -> dict[str, Any]:
    """Scores each effect's signature against the residuals of the nominal model: nothing refitted or projected out."""
    found = refitted(study, fit=False)
    data = slice(0, found.data)
    base = found.residuals[data]
    scores = {"": 0.0}
    for name, columns in found.signatures.items():
        rest = left(base, columns[data])
        scores[name] = 0.5 * float(base @ base - rest @ rest) - columns.shape[1]
    return verdict(study.parent.name, soft(scores))
