"""Problems as a worker holds them: trials without added noise, realisations of the noise, and their costs."""

from __future__ import annotations

import math
from collections import OrderedDict
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from seatruth.arrays import Array
from seatruth.comparison.noise import Noise, realise
from seatruth.comparison.problem import Problem, Run, random_stream
from seatruth.costs.options import FormulaOptions, TrajectoryOptions, as_trajectory, of_kind
from seatruth.costs.problem import EstimationProblem
from seatruth.costs.registry import cost_of
from seatruth.costs.study_cost import StudyCost
from seatruth.errors import BadInput
from seatruth.optimizers import Coordinates
from seatruth.study import Study
from seatruth.trials.trial import Trial, Trials

_MAX_TRIES = 200
"""Random starts that are drawn until one satisfies the constraints.
Chosen here [S]: enough where 2 % of the region are feasible."""
_MAX_COSTS = 6
"""Costs that a worker keeps. The runs of one instance follow each other, and an instance has three costs at most."""


@dataclass(frozen=True)
class RealisationSettings:
    """What decides a realisation besides the problem.

    Attributes:
        seed: The comparison's seed.
        base_level: Noise level with which noiseless records are weighted.
    """

    seed: int
    base_level: float


@dataclass(frozen=True)
class NoisyProblem:
    """One problem from which realisations of the noise are drawn; the same arguments give the same realisation."""

    problem: Problem
    settings: RealisationSettings

    @property
    def study(self) -> Study:
        """The problem's study."""
        return self.problem.study

    @cached_property
    def truth(self) -> dict[str, float] | None:
        """True values of the free parameters; None where they are not known."""
        return None if self.problem.truth is None else dict(self.problem.truth)

    def simulate(self) -> None:
        """Simulates all trials now: an error in them is raised here, and no worker has to do it again."""
        _ = self.clean_trials, self.holdout

    @cached_property
    def clean_trials(self) -> Trials:
        """The fitted trials without added noise: simulated at the truth, or as recorded."""
        return self._simulated(self.study.trials)

    @cached_property
    def holdout(self) -> Trials:
        """The trials held out, without added noise: what predictions are compared with."""
        return self._simulated(self.study.holdout)

    @cached_property
    def ranges(self) -> dict[str, float]:
        """Largest less smallest clean value of each channel over all fitted trials; its size where it never changes."""
        ranges: dict[str, float] = {}
        for kind in ("inputs", "outputs"):
            for name in dict.fromkeys(name for trial in self.clean_trials for name in getattr(trial, kind)):
                parts = [getattr(trial, kind)[name] for trial in self.clean_trials if name in getattr(trial, kind)]
                values = np.concatenate(parts)
                values = values[np.isfinite(values)]
                width = float(np.ptp(values)) if values.size else 0.0
                size = float(np.abs(values).max()) if values.size else 0.0
                ranges[name] = width if width > 1e-9 * size else size or 1.0
        return ranges

    def deviations(self, noise: Noise) -> dict[str, float]:
        """Standard deviation of the added noise by channel (inputs and outputs)."""
        return {name: noise.level * width for name, width in self.ranges.items()}

    def realise(self, cost: str, noise: Noise, seed: int) -> Study:
        """The study of one realisation, with its start, in this kind of cost."""
        names = (self.settings.seed, self.problem.name, noise.describe(), seed)
        options = self.study.cost
        # The first samples carry noise as well where the initial state is estimated, and in a table.
        first = isinstance(options, FormulaOptions) or (
            isinstance(options, TrajectoryOptions) and options.initial == "free"
        )
        sd = self.deviations(noise)
        rngs = np.random.default_rng(random_stream("noise", *names)).spawn(len(self.clean_trials))
        trials = [realise(noise, trial, sd, sd, rng, first=first) for trial, rng in zip(self.clean_trials, rngs)]
        changes: dict[str, Any] = {"cost": of_kind(options, cost), "trials": Trials(trials), "holdout": self.holdout}
        changes["noise"] = self._weights(noise)
        study = self.study.replace(**changes)
        if self.problem.start == "random":
            return self._with_random_start(study, np.random.default_rng(random_stream("start", *names)))
        return study

    def _weights(self, noise: Noise) -> dict[str, Any]:
        """Standard deviation of each output's noise, as the study of a realisation states it."""
        outputs = [channel.name for channel in self.study.model.outputs]
        added = self.deviations(noise)
        if self.truth is not None:
            level = noise.level or self.settings.base_level
            return {name: level * self.ranges[name] for name in outputs if name in self.ranges}
        weights: dict[str, Any] = {}
        for name in outputs:
            stated = self.study.noise.get(name, "estimate")
            weights[name] = stated if stated == "estimate" else math.hypot(float(stated), added.get(name, 0.0))
        return weights

    def _with_random_start(self, study: Study, rng: np.random.Generator) -> Study:
        coordinates, space = Coordinates(study.free), study.space
        for _ in range(_MAX_TRIES):
            x = coordinates.x_of(coordinates.sample(rng, 1)[0])
            if bool(space.feasible(x[None])[0]):
                return study.replace(parameters=with_values(study, dict(zip((q.name for q in study.free), x.tolist()))))
        raise BadInput(
            f"none of {_MAX_TRIES} random starts satisfies the constraints",
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
        predicted = cost.predict(cost.start)
        return Trials([_with_outputs(trial, names, y, self.problem.name) for trial, y in zip(trials, predicted)])


class CostCache:
    """The costs of the latest instances, so that the solvers of an instance share them."""

    def __init__(self) -> None:
        self._kept: OrderedDict[str, StudyCost] = OrderedDict()

    def get(self, problem: NoisyProblem, run: Run, kind: str | None = None) -> StudyCost:
        """The cost of a run's realisation, or another kind of cost of the same realisation."""
        wanted = kind or run.cost
        key = f"{run.instance} {wanted}"
        if key not in self._kept:
            cost = cost_of(problem.realise(wanted, run.noise, run.seed), threads=1)
            self._kept[key] = cost
            while len(self._kept) > _MAX_COSTS:
                self._kept.popitem(last=False)
        self._kept.move_to_end(key)
        return self._kept[key]


def with_values(study: EstimationProblem, values: dict[str, float]) -> tuple[Any, ...]:
    """The study's parameters with these values."""
    return tuple(
        parameter.replace(value=values[parameter.name]) if parameter.name in values else parameter
        for parameter in study.parameters
    )


def _with_outputs(trial: Trial, names: list[str], y: Array, problem: str) -> Trial:
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
