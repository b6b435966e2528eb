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
    """A model on some trials, ready to run.

    `free` names the parameters that each candidate sets, `values` gives the others (the model's nominal ones where
    None). `hold` says what inputs do between samples: "foh" (first-order hold: straight lines) or "zoh" (zero-order
    hold: they keep the last sample's value, as orders do). `max_step` is the longest Runge-Kutta step in s; None takes
    one step a sample, more in a gap.
    `threads` is one a processor where None. Raises BadInput for an unknown name, a missing input, a wrong option.
    """
    given = model.nominal() if values is None else dict(values)
    count = thread_count(threads)
    if isinstance(model, BlackBox):
        return BlackBoxSimulator(model, trials, free, given, count)
    return CompiledSimulator(model, trials, free, given, hold, max_step, count)
