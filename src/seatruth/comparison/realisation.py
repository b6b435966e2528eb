"""Problems as a worker holds them: clean records, realisations of noise on them, and their costs."""

from __future__ import annotations

import math
from collections import OrderedDict
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from seatruth.arrays import Array
from seatruth.comparison.noise import Noise, realise
from seatruth.comparison.spec import Problem, Run, stream
from seatruth.costs.options import FormulaOptions, TrajectoryOptions, as_trajectory, of_kind
from seatruth.costs.problem import EstimationProblem
from seatruth.costs.registry import cost_of
from seatruth.costs.study_cost import StudyCost
from seatruth.errors import BadInput
from seatruth.optimizers import Coordinates
from seatruth.study import Study
from seatruth.trials.trial import Trial, Trials

_TRIES = 200
"""Random starts drawn until one keeps the constraints."""
_KEPT = 6
"""Costs that a worker keeps: the runs of one instance follow each other."""


@dataclass(frozen=True)
class Setting:
    """What of a comparison decides its realisations besides the problem."""

    seed: int
    base_level: float


@dataclass(frozen=True)
class Bench:
    """One problem, ready to be realised."""

    problem: Problem
    setting: Setting

    @property
    def study(self) -> Study:
        return self.problem.study

    @cached_property
    def truth(self) -> dict[str, float] | None:
        return None if self.problem.truth is None else dict(self.problem.truth)

    @cached_property
    def clean(self) -> Trials:
        """The fitted trials without added noise: simulated at the truth, or as recorded."""
        return self._simulated(self.study.trials)

    @cached_property
    def held_out(self) -> Trials:
        """The trials held out, without added noise: what predictions are compared with."""
        return self._simulated(self.study.holdout)

    @cached_property
    def ranges(self) -> dict[str, float]:
        """Largest less smallest clean value of each channel over all fitted trials; its size where it never changes."""
        found: dict[str, float] = {}
        for kind in ("inputs", "outputs"):
            for name in dict.fromkeys(name for trial in self.clean for name in getattr(trial, kind)):
                parts = [getattr(trial, kind)[name] for trial in self.clean if name in getattr(trial, kind)]
                values = np.concatenate(parts)
                values = values[np.isfinite(values)]
                width = float(np.ptp(values)) if values.size else 0.0
                size = float(np.abs(values).max()) if values.size else 0.0
                found[name] = width if width > 1e-9 * size else size or 1.0
        return found

    def deviations(self, noise: Noise) -> dict[str, float]:
        """Standard deviation of the added noise by channel (inputs and outputs)."""
        return {name: noise.level * width for name, width in self.ranges.items()}

    def realised(self, cost: str, noise: Noise, seed: int) -> Study:
        """The study of one realisation, with its start, in this kind of cost."""
        place = (self.setting.seed, self.problem.name, noise.describe(), seed)
        options = self.study.cost
        # The first samples carry noise as well where the initial state is estimated, and in a table.
        first = isinstance(options, FormulaOptions) or (
            isinstance(options, TrajectoryOptions) and options.initial == "free"
        )
        sd = self.deviations(noise)
        rngs = np.random.default_rng(stream("noise", *place)).spawn(len(self.clean))
        trials = [realise(noise, trial, sd, sd, rng, first=first) for trial, rng in zip(self.clean, rngs)]
        changes: dict[str, Any] = {"cost": of_kind(options, cost), "trials": Trials(trials), "holdout": self.held_out}
        changes["noise"] = self._weights(noise)
        study = self.study.replace(**changes)
        if self.problem.start == "random":
            return self._started(study, np.random.default_rng(stream("start", *place)))
        return study

    def _weights(self, noise: Noise) -> dict[str, Any]:
        """What the study says of the noise of each output."""
        outputs = [channel.name for channel in self.study.model.outputs]
        added = self.deviations(noise)
        if self.truth is not None:
            level = noise.level or self.setting.base_level
            return {name: level * self.ranges[name] for name in outputs if name in self.ranges}
        found: dict[str, Any] = {}
        for name in outputs:
            stated = self.study.noise.get(name, "estimate")
            found[name] = stated if stated == "estimate" else math.hypot(float(stated), added.get(name, 0.0))
        return found

    def _started(self, study: Study, rng: np.random.Generator) -> Study:
        coordinates, space = Coordinates(study.free), study.space
        for _ in range(_TRIES):
            x = coordinates.x_of(coordinates.sample(rng, 1)[0])
            if bool(space.feasible(x[None])[0]):
                return study.replace(parameters=with_values(study, dict(zip((q.name for q in study.free), x.tolist()))))
        raise BadInput(
            f"none of {_TRIES} random starts keeps the constraints",
            where=f"problem {self.problem.name!r}",
            do='Give start regions, or set start = "study".',
        )

    def _simulated(self, trials: Trials) -> Trials:
        """These trials with outputs simulated at the truth wherever they were recorded; as they are without a truth."""
        if self.truth is None or not len(trials):
            return trials
        options = self.study.cost
        if not isinstance(options, FormulaOptions):
            kept = as_trajectory(options)
            options = TrajectoryOptions(hold=kept.hold, max_step=kept.max_step)
        study = self.study.with_trials(trials).replace(
            parameters=with_values(self.study, self.truth),
            noise=dict.fromkeys((channel.name for channel in self.study.model.outputs), 1.0),
            cost=options,
        )
        cost = cost_of(study, threads=1)
        names = [channel.name for channel in study.model.outputs]
        return Trials([_made(trial, names, y, self.problem.name) for trial, y in zip(trials, cost.predict(cost.start))])


class Costs:
    """The costs of the latest instances, so that the solvers of one share it."""

    def __init__(self) -> None:
        self._kept: OrderedDict[str, StudyCost] = OrderedDict()

    def of(self, bench: Bench, run: Run, kind: str | None = None) -> StudyCost:
        """The cost of a run's realisation, or another kind of cost of the same realisation."""
        wanted = kind or run.cost
        key = f"{run.instance} {wanted}"
        if key not in self._kept:
            cost = cost_of(bench.realised(wanted, run.noise, run.seed), threads=1)
            self._kept[key] = cost
            while len(self._kept) > _KEPT:
                self._kept.popitem(last=False)
        self._kept.move_to_end(key)
        return self._kept[key]


def with_values(study: EstimationProblem, values: dict[str, float]) -> tuple[Any, ...]:
    """The study's parameters with these values."""
    return tuple(
        parameter.replace(value=values[parameter.name]) if parameter.name in values else parameter
        for parameter in study.parameters
    )


def _made(trial: Trial, names: list[str], y: Array, problem: str) -> Trial:
    if not np.isfinite(y).all():
        raise BadInput(
            f"trial {trial.name!r} cannot be simulated at the truth: it diverges", where=f"problem {problem!r}"
        )
    outputs = {
        name: np.where(np.isfinite(trial.outputs[name]), y[:, k], math.nan)
        for k, name in enumerate(names)
        if name in trial.outputs
    }
    return replace(trial, outputs=outputs, synthetic=True)
