"""Standard deviations of the priors of all shared unknowns."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from seatruth.arrays import Array, Indices
from seatruth.diagnosis.settings import Settings
from seatruth.effects import Effect


def magnitude_columns(effect: Effect, columns: Indices) -> Indices:
    """Those of the columns of an effect's parameters that are its magnitudes."""
    return np.array([k for k, q in zip(columns, effect.parameters) if q.name not in effect.shape_priors], dtype=np.intp)


def prior_deviations(
    stated: Array, effects: Mapping[str, Effect], columns: Mapping[str, Indices], settings: Settings
) -> tuple[Array, Array]:
    """Deviations (S,) of what is believed of the shared unknowns, and of the priors with which they are fitted.

    `stated` (S,) has typical magnitudes. The two differ where a search begins again with `wider` priors.
    """
    believed = stated.copy()
    for name, effect in effects.items():
        believed[magnitude_columns(effect, columns[name])] *= settings.prior_width**effect.power
    fitted = believed.copy()
    for name, factor in settings.wider:
        if name in effects:
            fitted[magnitude_columns(effects[name], columns[name])] *= factor
    return believed, fitted
