"""Before any fit: which parameters these trials can move at all."""

from __future__ import annotations

import numpy as np
import pandas as pd

from seatruth.costs.formula import FormulaCost
from seatruth.costs.problem import EstimationProblem
from seatruth.costs.registry import cost_of
from seatruth.errors import BadInput
from seatruth.uncertainty.covariance import covariance
from seatruth.uncertainty.identifiability import tied, verdict


def excitation(study: EstimationProblem, threads: int | None = None) -> pd.DataFrame:
    """Best possible standard error of each free parameter at its start value: index parameter; value, crlb, verdict.

    The bound takes the stated noise as white (where it is to be estimated: what the model leaves at its start values),
    so the errors of a real fit are larger. Raises BadInput where the model cannot be simulated at its start values.
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
    found = covariance(cost.residuals(x), cost.jacobian(x), cost.residual_blocks, white=True)
    related = tied(found)
    rows = {}
    for k, parameter in enumerate(cost.parameters):
        if parameter.name not in cost.nuisances:
            bound = float(found.crlb[k])
            said = verdict(parameter, float(x[k]), bound, False, bool(found.unseen[k]), bool(related[k]))
            rows[parameter.name] = (float(x[k]), bound, said)
    frame = pd.DataFrame.from_dict(rows, orient="index", columns=["value", "crlb", "verdict"])
    frame.index.name = "parameter"
    return frame
