"""The engine: a population of candidates through all trials in one compiled call.

    sim = simulator(model, trials, free=("Y_v", "N_v"), values=model.nominal())
    sums = sim.sums(theta, sim.first_states, weights)

A model's equations are traced once, compiled for vectors of candidates, kept on disk, and run by as many threads as
the process may use. The result does not depend on the number of threads.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from seatruth.models.base import Model
from seatruth.models.blackbox import BlackBox
from seatruth.simulate.blackbox import BlackBoxSimulator
from seatruth.simulate.compiler.program import fingerprint
from seatruth.simulate.engine import CompiledSimulator, Jacobian, Outputs, Simulator, Sums
from seatruth.simulate.grid import Hold
from seatruth.simulate.rates import evaluate_rhs, evaluate_rhs_jacobian
from seatruth.simulate.threads import thread_count
from seatruth.trials.trial import Trial

__all__ = [
    "Hold",
    "Jacobian",
    "Outputs",
    "Simulator",
    "Sums",
    "evaluate_rhs",
    "evaluate_rhs_jacobian",
    "fingerprint",
    "simulator",
]


def simulator(
    model: Model,
    trials: Sequence[Trial],
    free: Sequence[str] = (),
    values: Mapping[str, float] | None = None,
    hold: Hold = "foh",
    max_step: float | None = None,
    threads: int | None = None,
) -> Simulator:
    """A model bound to trials, ready to run a population of candidates.

    Args:
        model: a Model of equations, or a BlackBox.
        trials: T trials that have the model's inputs.
        free: names of the K parameters that each candidate sets.
        values: values of the other parameters; None takes the model's nominal ones.
        hold: input between samples: "foh" (first-order hold, straight lines) or "zoh" (zero-order hold, constant).
        max_step: longest Runge-Kutta step, s; None takes one step per sample, more in a gap.
        threads: None takes one per processor.

    Returns:
        The simulator.

    Raises:
        BadInput: a name is unknown, an input is missing, or an option is not possible.

    Example:
        >>> import numpy as np
        >>> from seatruth import Trial, load_model, simulator
        >>> trial = Trial("run", np.arange(11) * 0.1, {"delta": np.zeros(11), "n": np.full(11, 10.0)}, {})
        >>> sim = simulator(load_model("mmg"), [trial])
        >>> sim.outputs(np.zeros((1, 0)), np.array([[1.0, 0.0, 0.0, 0.0, 0.0, 0.0]])).y.shape
        (1, 11, 6)
    """
    given = model.nominal() if values is None else dict(values)
    count = thread_count(threads)
    if isinstance(model, BlackBox):
        return BlackBoxSimulator(model, trials, free, given, count)
    return CompiledSimulator(model, trials, free, given, hold, max_step, count)
