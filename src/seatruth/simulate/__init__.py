"""The engine: a population of candidates through all trials in one call.

    sim = simulator(model, trials, free=("Y_v", "N_v"), values=model.nominal())
    errors = sim.squared_errors(theta, sim.initial_states, weights)  # errors.sums (P, T, D)

Whatever runs the equations stands behind one protocol, `Simulator`. The compiled backend traces a model's equations
once, compiles them for vectors of candidates, keeps the code on disk, and runs it on as many threads as the process
may use; its result does not depend on their number. The reference backend runs the same steps in plain Python.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from seatruth.models.base import Model
from seatruth.models.black_box import BlackBox
from seatruth.simulate.base import Backend, Jacobian, Outputs, Simulator, SquaredErrors, check_backend
from seatruth.simulate.blackbox import BlackBoxSimulator
from seatruth.simulate.compiled import CompiledSimulator
from seatruth.simulate.compiler.program import fingerprint
from seatruth.simulate.meter import Meter, OutOfRuns
from seatruth.simulate.reference import ReferenceSimulator
from seatruth.simulate.rhs import evaluate_rhs, evaluate_rhs_jacobian
from seatruth.simulate.setup import set_up
from seatruth.simulate.threads import thread_count
from seatruth.trials.channel import Hold
from seatruth.trials.trial import Trial

__all__ = [
    "Backend",
    "BlackBoxSimulator",
    "Hold",
    "Jacobian",
    "Meter",
    "OutOfRuns",
    "Outputs",
    "Simulator",
    "SquaredErrors",
    "evaluate_rhs",
    "evaluate_rhs_jacobian",
    "fingerprint",
    "simulator",
    "thread_count",
]


def simulator(
    model: Model,
    trials: Sequence[Trial],
    free: Sequence[str] = (),
    values: Mapping[str, float] | None = None,
    hold: Hold = "foh",
    max_step: float | None = None,
    threads: int | None = None,
    backend: Backend = "compiled",
    meter: Meter | None = None,
) -> Simulator:
    """A model bound to trials, ready to run a population of candidates.

    Args:
        model: A Model of equations, or a BlackBox.
        trials: T trials that have the model's inputs.
        free: Names of the K parameters that each candidate sets.
        values: Values of the other parameters; the model's nominal ones where None.
        hold: Input between samples: "foh" (first-order hold, straight lines) or "zoh" (zero-order hold, constant).
        max_step: Longest Runge-Kutta step in s. None takes one step a sample, more in a gap.
        threads: Threads of the compiled backend; one for each processor where None.
        backend: "compiled", or "reference" (plain Python: thousands of times slower, derivatives by differences).
        meter: Counts the runs of a BlackBox, and ends them at its limit; it means nothing for equations.

    A BlackBox integrates by itself: `hold`, `max_step`, `threads` and `backend` do not change its numbers. One that
    runs in processes of its own (an FMU) has as many at once as there are threads.

    Returns:
        The simulator.

    Raises:
        BadInput: An unknown name, a missing value or input, a wrong option.

    Example:
        >>> import numpy as np
        >>> from seatruth import Trial, load_model, simulator
        >>> trial = Trial("run", np.arange(11) * 0.1, {"delta": np.zeros(11), "n": np.full(11, 10.0)}, {})
        >>> sim = simulator(load_model("mmg"), [trial])
        >>> sim.outputs(np.zeros((1, 0)), np.array([[1.0, 0.0, 0.0, 0.0, 0.0, 0.0]])).y.shape
        (1, 11, 6)
    """
    check_backend(backend)
    count = thread_count(threads)
    setup = set_up(model, trials, free, model.nominal() if values is None else dict(values))
    if isinstance(model, BlackBox):
        return BlackBoxSimulator(setup, model, count, meter)
    if backend == "reference":
        return ReferenceSimulator(setup, hold, max_step)
    return CompiledSimulator(setup, hold, max_step, count)
