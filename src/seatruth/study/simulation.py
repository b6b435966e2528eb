"""Open-loop simulation of trials with the parameters of a problem, as tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from seatruth.arrays import Array
from seatruth.costs.options import FormulaOptions, as_trajectory
from seatruth.costs.parameter_space import ParameterSpace
from seatruth.costs.problem import EstimationProblem
from seatruth.errors import BadInput, nearest
from seatruth.models.formula import Formula
from seatruth.trials.trial import Trial


def simulated(
    problem: EstimationProblem,
    values: Mapping[str, float],
    trials: Sequence[Trial],
    first_states: Mapping[str, float],
    threads: int | None,
) -> dict[str, pd.DataFrame]:
    """Outputs of each trial, by the trial's name; see `Study.simulate`.

    `first_states` are initial states by "TRIAL: STATE"; others come from the first valid samples.
    """
    called = [trial.name for trial in trials]
    twice = sorted({name for name in called if called.count(name) > 1})
    if twice:
        raise BadInput(f"two trials are called {twice[0]!r}", where="simulate", do="Give each its own name.")
    if not called:
        return {}
    used = _values(problem, values)
    model = problem.model
    if isinstance(problem.cost, FormulaOptions) and isinstance(model, Formula):
        return {trial.name: _table(problem, trial, model.run(trial, used, None)) for trial in trials}
    # The engine takes half a second to import, and a study file is read without it.
    from seatruth.simulate import simulator

    options = as_trajectory(problem.cost)
    engine = simulator(model, trials, (), used, options.hold, options.max_step, threads)
    x0 = engine.initial_states.copy()
    for row, trial in enumerate(trials):
        for column, state in enumerate(model.states):
            x0[row, column] = first_states.get(f"{trial.name}: {state.name}", x0[row, column])
    names = [state.name for state in model.states]
    for name, (leader, sign) in model.follows.items():  # their initial value moves with that of another state
        follower, other = names.index(name), names.index(leader)
        x0[:, follower] += sign * (x0[:, other] - engine.initial_states[:, other])
    y = engine.outputs(np.zeros((1, 0)), x0).y[0]
    return {trial.name: _table(problem, trial, y[rows]) for trial, rows in zip(trials, engine.rows, strict=True)}


def _values(problem: EstimationProblem, values: Mapping[str, float]) -> dict[str, float]:
    """All parameters of the model by name, those with an expression included."""
    where = f"study {problem.name!r}"
    known = {parameter.name: parameter for parameter in problem.parameters}
    for name in values:
        if name not in known:
            raise BadInput(
                f"model {problem.model.name!r} has no parameter {name!r}", where=where, do=nearest(name, known)
            )
        if known[name].expr is not None:
            raise BadInput(
                f"{name!r} is set by the expression {known[name].expr!r}",
                where=where,
                do="Set the parameters in that expression instead.",
            )
    changed = [
        parameter.replace(value=float(values[parameter.name]), vary=False) if parameter.name in values else parameter
        for parameter in problem.parameters
    ]
    return ParameterSpace(changed).nominal()


def _table(problem: EstimationProblem, trial: Trial, y: Array) -> pd.DataFrame:
    """Outputs (n, D) as a table over time."""
    outputs = problem.model.outputs
    index = pd.Index(np.asarray(trial.t), name="t")
    frame = pd.DataFrame(np.asarray(y), index=index, columns=[channel.name for channel in outputs])
    frame.attrs["units"] = {channel.name: channel.unit for channel in outputs}
    return frame
