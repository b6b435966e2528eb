"""A-priori identifiability: the best standard errors that these trials allow, from the Fisher information."""

from __future__ import annotations

import numpy as np
import pandas as pd

from seatruth.arrays import Array
from seatruth.costs.formula import FormulaCost
from seatruth.costs.problem import EstimationProblem
from seatruth.costs.registry import cost_of
from seatruth.costs.study_cost import StudyCost
from seatruth.errors import BadInput
from seatruth.text import listed
from seatruth.uncertainty.covariance import covariance
from seatruth.uncertainty.identifiability import identifiability, strongly_correlated, verdict
from seatruth.uncertainty.structural_identifiability import unidentifiable_directions

KEEP_FROM_ZERO = (
    "Keep it from zero, as (x * x + 1e-9) ** 0.3 for abs(x) ** 0.6, or on one side of an `if`, or begin elsewhere "
    "(`initial_state`) where a run begins at rest, as with atan2(w, u)."
)
"""What to do where a model's runs have no derivatives."""


def prior_identifiability(study: EstimationProblem, threads: int | None = None) -> pd.DataFrame:
    """Cramer-Rao bound of each free parameter at its start value, before any fit.

    The bound takes the noise as white, so the errors of a real fit are larger. Its size is the stated one; where the
    study estimates the noise, it is the residuals' at the start values.

    Args:
        study: The study.
        threads: Threads of a simulation; None for all processors.

    Returns:
        Index parameter; columns value, crlb (both in its unit), verdict. `frame.attrs["reasons"]` lists in sentences
        what no trial of this kind tells apart: which scales or sums of parameters cancel, priors or not, and why those
        are not identifiable that trade off. `frame.attrs["fault"]` says where the model has no derivatives, for want of
        which nothing is known; it is empty where it has them.

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
            else f"As they are read, {_inputs(study)}: check units and signs (`seatruth simulate` shows where it "
            "diverges), or start from other values.",
        )
    cost.reweight(x)
    jacobian = cost.jacobian(x)
    fault = _without_derivatives(cost, jacobian)
    if fault:
        jacobian = np.zeros_like(jacobian)
    uncertainty = covariance(cost.residuals(x), jacobian, cost.residual_blocks, white=True)
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
    lost = set(frame.index[frame["verdict"] == "not identifiable"])
    frame.attrs |= {"reasons": [] if fault else _reasons(cost, x, lost), "fault": fault}
    return frame


def _without_derivatives(cost: StudyCost, jacobian: Array) -> str:
    """A sentence on where the first run that has no derivatives (N, K) loses them; empty where all have them.

    Of a glider whose speed is recorded on dives alone, climbs began at rest, where atan2(w, u) has none: all
    parameters were "not identifiable".
    """
    lost = [
        (float(group.t[bad][0]), group.trial)
        for group in cost.residual_blocks
        if group.kind == "data" and (bad := ~np.isfinite(jacobian[group.rows]).all(axis=1)).any()
    ]
    if not lost:
        return ""
    first, trial = min(lost)
    return (
        f"From t = {first:g} s on the model's run of {trial!r} has no derivatives, so that nothing can be said of what "
        f"the trials move: a power of zero, or a division by it. {KEEP_FROM_ZERO}"
    )


def _inputs(study: EstimationProblem) -> str:
    """The range of each input over all trials, in words, angles in degrees."""
    ranges = []
    for channel in study.model.inputs:
        parts = [trial.inputs[channel.name] for trial in study.trials if channel.name in trial.inputs]
        values = np.concatenate(parts) if parts else np.empty(0)
        values = values[np.isfinite(values)]
        if values.size:
            scale, unit = (np.degrees(1.0), "deg") if channel.unit == "rad" else (1.0, channel.unit)
            ends = f"{scale * values.min():.3g} to {scale * values.max():.3g}"
            ranges.append(f"{channel.name} goes from {ends}{'' if unit == '1' else f' {unit}'}")
    return listed(ranges)


def _reasons(cost: StudyCost, x: Array, lost: set[str]) -> list[str]:
    """Sentences on what cancels exactly, though priors may hold it, and on further directions that lose parameters."""
    exact = unidentifiable_directions(cost, x)
    said = [str(entry["sentence"]) for entry in exact]
    if not lost:
        return said
    columns = [k for k, parameter in enumerate(cost.parameters) if parameter.name not in cost.nuisances]
    rows = np.concatenate([group.rows for group in cost.residual_blocks if group.kind == "data"])
    steps = np.array([entry["step"][columns] for entry in exact]).reshape(len(exact), len(columns))
    jacobian = np.nan_to_num(cost.jacobian(x)[rows])
    # A change that free initial states can make up for says nothing about the parameters.
    basis = np.linalg.qr(jacobian[:, [cost.names.index(name) for name in cost.nuisances]])[0]
    data = (jacobian - basis @ (basis.T @ jacobian))[:, columns]
    weak = identifiability(data, [cost.parameters[k] for k in columns], known_directions=steps)["weak"]
    return [*said, *(str(entry["sentence"]) for entry in weak if lost & set(entry["combination"]))]
