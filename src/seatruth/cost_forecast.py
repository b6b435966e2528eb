"""What a search with an expensive simulator will cost, said before it begins."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from seatruth.costs.options import TrajectoryOptions
from seatruth.costs.registry import cost_of
from seatruth.diagnosis.few_runs import expected_evaluations
from seatruth.diagnosis.preconditions import usable_effects
from seatruth.diagnosis.settings import Settings
from seatruth.effects import Effect
from seatruth.models.black_box import BlackBox
from seatruth.models.isolated import isolated_in
from seatruth.optimizers.registry import as_optimizer
from seatruth.simulate import simulator, thread_count
from seatruth.study import Study

_PER_PARAMETER: Mapping[str, int] = MappingProxyType({"least_squares": 12, "newton": 12, "secant": 5})
"""Evaluations over K + 1 that a search of K parameters takes from a fair start, as experiments/one_vehicle_four_ways.py
measures. Newton is not among them: by experiments/standard_comparison.py it takes about as many as least_squares. Other
solvers take their budget."""


_TOLD = 0.3
"""seatruth's own part of the time of an evaluation over the simulator's from which it is told. Chosen here [S]."""
_OWN = 5e-6
"""s that a diagnosis takes of its own for each evaluation and each value on record. [S] Of a boat with 9,775 values it
took 0.05 s an evaluation without ports and 0.085 s with them, so that a run of 18 ms is the smaller part."""


@dataclass(frozen=True)
class Forecast:
    """About how many evaluations a search takes, and how long.

    `what` is the search; `evaluation_s` s of wall time that one simulation of all trials takes in one process;
    `expected` evaluations, `most` that the budget allows (None for no limit); `processes` that simulate at once;
    `fair_start`: the search may take several times as long from a poor start; `own_s` s that seatruth itself takes
    for each evaluation, in one process.

    Example:
        >>> from seatruth import Forecast
        >>> print(Forecast("identify", evaluation_s=0.5, expected=40, most=200, processes=2))
        identify takes about 40 evaluations of the simulator (0.5 s each, 2 processes): 10 s.
    """

    what: str
    evaluation_s: float
    expected: int
    most: int | None
    processes: int
    fair_start: bool = False
    own_s: float = 0.0

    @property
    def seconds(self) -> float:
        """Wall time of the expected evaluations, s."""
        return (self.evaluation_s / self.processes + self.own_s) * self.expected

    def __str__(self) -> str:
        number = f"about {self.expected} evaluations"
        if self.most is not None and self.most <= self.expected:
            number = f"its budget of {self.most} evaluations"
        each = f"{self.evaluation_s:.2g} s each" + (f", {self.processes} processes" if self.processes > 1 else "")
        each += f"; {self.own_s:.1g} s of seatruth's own" if self.own_s > _TOLD * self.evaluation_s else ""
        poor = ", from a poor start several times as long" if self.fair_start else ""
        return f"{self.what} takes {number} of the simulator ({each}): {_duration(self.seconds)}{poor}."


def forecast(
    study: Study,
    effects: Sequence[Effect | str] | None = None,
    *,
    evaluations: int | None = None,
    threads: int | None = None,
) -> tuple[Forecast, ...]:
    """What `identify` and `diagnose` will cost; empty where equations are simulated, which is quick.

    Args:
        study: a study whose model is a simulator (an FMU, an `IsolatedBlackBox`, a `BlackBox`). One run of each of its
            trials is made, to time it.
        effects: the effects of the diagnosis, as for `diagnose`.
        evaluations: the budget of the diagnosis; None takes the study's.
        threads: processes that simulate at once, None for all processors.

    Returns:
        The forecasts of `identify` and of `diagnose`.

    Raises:
        BadInput: no effect can act on the model, or the study cannot be simulated.

    Example:
        >>> import seatruth.sample
        >>> from seatruth import forecast
        >>> forecast(seatruth.sample.load("study.toml"))
        ()
    """
    if not isinstance(study.model, BlackBox) or not isinstance(study.cost, TrajectoryOptions):
        return ()
    evaluations = study.diagnosis_budget if evaluations is None else evaluations
    seconds = _seconds(study)
    # A single candidate keeps one process a trial busy, and a Jacobian all; searches are made of both. [S]
    most_at_once = max(1, min(thread_count(threads), 2 * len(study.trials)))
    processes = 1 if isolated_in(study.model) is None else most_at_once
    K = len(cost_of(study, threads=1).parameters) if study.free else 0
    solver = as_optimizer(study.optimizer)
    # A trial left out is one that costs nothing, so that all together cost as much as one search less than trials.
    searches = study.starts + (len(study.trials) - 1 if study.output.cross_validate else 0)
    most = None if study.budget.evaluations is None else study.budget.evaluations * searches
    usual = _PER_PARAMETER.get(solver.name)
    expected = (K + 1) * usual * searches if usual is not None else most or 0
    fair = usual is not None and (most is None or expected < most)
    first = Forecast("identify", seconds, min(expected, most or expected), most, processes, fair_start=fair)
    chosen, _ = usable_effects(study, effects)
    wanted = expected_evaluations(study, chosen, Settings())
    wanted = wanted if evaluations is None else min(wanted, evaluations)
    # From runs that miss their trials by a turn, fits take as many more steps as a search does.
    fair = evaluations is None or wanted < evaluations
    own = _OWN * sum(int(np.isfinite(values).sum()) for trial in study.trials for values in trial.outputs.values())
    return first, Forecast("diagnose", seconds, wanted, evaluations, processes, fair_start=fair, own_s=own)


def _seconds(study: Study) -> float:
    """Wall time of one simulation of all trials in one process, s; NaN where no run was timed."""
    box = isolated_in(study.model)
    free = [parameter.name for parameter in study.free][:1]
    values: Mapping[str, Any] = study.space.nominal()
    sim = simulator(study.model, list(study.trials), free=free, values=values, threads=1)
    theta = np.array([[values[name] for name in free]])
    if box is None:
        # Beside the start values, at which the search makes a run of its own that would else be one that is kept.
        theta *= 1.0 + _BESIDE
        began = time.perf_counter()
        sim.outputs(theta, sim.initial_states)
        return time.perf_counter() - began
    with box.anew():
        sim.outputs(theta, sim.initial_states)  # starts the process, and says so where nothing can be simulated
        runs, seconds = box.counts.simulated, box.counts.wall_s
        sim.outputs(theta, sim.initial_states)
    made = box.counts.simulated - runs
    return (box.counts.wall_s - seconds) / made * len(study.trials) if made else math.nan


_BESIDE = 1e-9
"""Relative change of a value that makes a run another one. Chosen here [S]."""


def _duration(seconds: float) -> str:
    if not math.isfinite(seconds):
        return "its time is not known, as its runs were kept"
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"
