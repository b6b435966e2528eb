"""A-priori identifiability: the best standard errors that these trials allow, from the Fisher information."""

from __future__ import annotations

import numpy as np
import pandas as pd

from seatruth.costs.formula import FormulaCost
from seatruth.costs.problem import EstimationProblem
from seatruth.costs.registry import cost_of
from seatruth.errors import BadInput
from seatruth.uncertainty.covariance import covariance
from seatruth.uncertainty.identifiability import strongly_correlated, verdict


def prior_identifiability(study: EstimationProblem, threads: int | None = None) -> pd.DataFrame:
    """Cramer-Rao bound of each free parameter at its start value, before any fit.

    The bound takes the noise as white, so the errors of a real fit are larger. Its size is the stated one; where the
    study estimates the noise, it is the residuals' at the start values.

    Args:
        study: The study.
        threads: Threads of a simulation; None for all processors.

    Returns:
        Index parameter; columns value, crlb (both in its unit), verdict.

    Raises:
        BadInput: The model cannot be simulated at its start values.
    """
    cost = cost_of(study, threads=threads)
    x = cost.start
    if isinstance(cost, FormulaCost):
        cost.require_values()
    if not np.isfinite(cost.residuals(x)).all():
        raise BadInput(
            "the formula has no finite value at its start values"
            if study.cost.kind == "formula"
            else "the model diverges on these trials at its start values",
            where=f"study {study.name!r}",
            do="Start from other values."
            if study.cost.kind == "formula"
            else "Check units and signs (`seatruth simulate` shows where), or start from other values.",
        )
    cost.reweight(x)
    uncertainty = covariance(cost.residuals(x), cost.jacobian(x), cost.residual_blocks, white=True)
    correlated = strongly_correlated(uncertainty)
    rows = {}
    for k, parameter in enumerate(cost.parameters):
        if parameter.name not in cost.nuisances:
            bound = float(uncertainty.crlb[k])
            unidentifiable = bool(uncertainty.unidentifiable[k])
            word = verdict(parameter, float(x[k]), bound, False, unidentifiable, bool(correlated[k]))
            rows[parameter.name] = (float(x[k]), bound, word)
    frame = pd.DataFrame.from_dict(rows, orient="index", columns=["value", "crlb", "verdict"])
    frame.index.name = "parameter"
    return frame
