"""The gap of three models: as it was declared, with its coefficients refitted, and with the effects of the answer."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cached_property

import numpy as np
import pandas as pd

from seatruth.arrays import Array, Flags
from seatruth.diagnosis.fit import Fit, without_discrepancy
from seatruth.diagnosis.hypotheses import Key, Search
from seatruth.diagnosis.hypothesis_fits import ensure, without_forces
from seatruth.diagnosis.posterior import SENSOR
from seatruth.diagnosis.prediction_errors import Simulated, moved
from seatruth.diagnosis.problem import Point, Problem
from seatruth.diagnosis.reported_sizes import with_reported_sizes
from seatruth.diagnosis.sensor_channels import sensor_channels
from seatruth.effects.causes import is_within
from seatruth.effects.each_trial import follows_each_trial
from seatruth.effects.rate_limits import RateLimit
from seatruth.models.base import whole_name

_MOST = 0.5
"""Part of all that can be explained from which an effect is not small, whatever the runs' misfit says. [S] On two
vehicles of another form effects that acted explained 0.57 to 0.69 of it, others 0.26 at most."""
_MISSED = 4.0
"""Mean squared error over the noise variance from which a channel is missed: twice the noise. [S]"""
_REFITS = 10
"""Gauss-Newton steps for initial states at most; two where they enter almost linearly."""
_NO_NEARER = 0.01
"""Part by which a step must shorten the distance for another one. [S]"""
_PARTS = (1.0, 0.3, 0.1, 0.03)
"""Parts of such a step that are tried, the longest first. [S] Of a crew boat of 110 s a whole one made runs diverge."""


def misfit(problem: Problem, deviation: Array, point: Point, rows: Flags | None = None) -> float:
    """Sum of squared errors over the noise variance; inf where a run diverges.

    `deviation` (C,) is that of each channel; `rows` (N,) are the errors that count, all by default.
    """
    errors = problem.errors(point) / deviation[problem.channel_of]
    if not np.isfinite(errors).all():
        return math.inf
    counted = errors if rows is None else errors[rows]
    return float(counted @ counted)


def refit_initial_states(problem: Problem, point: Point, deviation: Array) -> Point:
    """The point with the initial state of each trial refitted, everything else held; the point where it diverges.

    Of each step the longest part is taken that brings the trial nearer to its record: long runs bend.
    """
    count, precision = len(problem.initial_names), 1.0 / problem.initial_sd**2
    weight = 1.0 / deviation[problem.channel_of]

    def distances(at: Point, errors: Array) -> Array:
        with np.errstate(over="ignore", invalid="ignore"):  # of runs that diverge
            squares = np.bincount(problem.trial_of, (errors * weight) ** 2, len(problem.trials))
        return np.asarray(squares + ((problem.initial_mean - at.initial) ** 2 * precision).sum(axis=1))

    for _ in range(_REFITS):
        now = problem.linearize(point, (), discrepancy=False)
        if not np.isfinite(now.errors).all():
            return point
        step = np.zeros_like(point.initial)
        for trial in range(len(problem.trials)):
            here = problem.trial_of == trial
            slopes = now.local[here, :count] * weight[here, None]
            right = precision * (problem.initial_mean[trial] - point.initial[trial])
            right -= slopes.T @ (now.errors[here] * weight[here])
            step[trial] = np.linalg.solve(slopes.T @ slopes + np.diag(precision), right)
        initial, before = point.initial.copy(), distances(point, now.errors)
        reached, stays = before.copy(), np.ones(len(problem.trials), dtype=np.bool_)
        for part in _PARTS:
            tried = replace(point, initial=np.where(stays[:, None], point.initial + part * step, initial))
            found = distances(tried, problem.errors(tried))
            nearer = stays & (found < before)
            initial[nearer], reached[nearer] = tried.initial[nearer], found[nearer]
            stays &= ~nearer
            if not stays.any():
                break
        point = replace(point, initial=initial)
        if not reached.sum() < (1.0 - _NO_NEARER) * before.sum():
            break
    return point


class Gap:
    """What is left between the three models and the trials.

    `deviation` (C,) is that of the noise, `shown` are the effects of the answer, sized beside those of `beside`.
    """

    def __init__(self, search: Search, deviation: Array, shown: Key, beside: Key = ()) -> None:
        self.search, self.problem, self.deviation, self.key = search, search.problem, deviation, shown
        self.beside = beside

    @cached_property
    def shown(self) -> Fit:
        """The fit that stands for the answer."""
        found = self.search.best(self.key)
        return found if found is not None else self.search.null

    @cached_property
    def points(self) -> dict[str, Point]:
        """The declared model, the refitted one, and that with the effects of the answer: all without discrepancy."""
        problem = self.problem
        plain = without_forces(self.search, ())
        named = self._simulated if self.key else plain
        return {
            "before": refit_initial_states(problem, problem.start, self.deviation),
            "refit": without_discrepancy(problem, plain.point),
            "effects": without_discrepancy(problem, named.point),
        }

    @cached_property
    def misfits(self) -> dict[str, float]:
        """Sum of squared errors of each over the noise variance; inf where a run diverges."""
        return {name: misfit(self.problem, self.deviation, point) for name, point in self.points.items()}

    @cached_property
    def _simulated(self) -> Fit:
        return with_reported_sizes(self.search, self.key, self._reported)

    @cached_property
    def _reported(self) -> Fit | None:
        """The fit whose sizes of the answer's effects are reported."""
        return self.search.beside(self.key, self.beside)

    @cached_property
    def _named(self) -> Simulated:
        return Simulated.of(self.problem, self._simulated)

    def moved_by(self, name: str) -> float:
        """What an effect of the answer moves the trials by: root mean square in deviations of the noise."""
        return math.sqrt(float(np.mean(moved(self.problem, self._named, name, self.deviation) ** 2)))

    def part_moved(self, name: str) -> float:
        """What an effect of the answer moves the trials by over what runs with the answer miss, both in squares."""
        return self.moved_by(name) ** 2 * self.problem.count / self.misfits["effects"]

    def typical_sizes(self, name: str) -> float:
        """How large an effect of the answer is: of its magnitudes the most over a typical one of such a vehicle."""
        effect, at = self.problem.effects[name], (self._reported or self.shown).point.shared
        typical = effect.priors(self.problem.study.model)
        magnitudes = [(k, q.name) for k, q in zip(self.problem.columns[name], effect.parameters, strict=True)]
        sizes = (abs(float(at[k]) - effect.null[q]) / typical[q].sd for k, q in magnitudes if q in effect.magnitudes)
        return max(sizes, default=math.inf)

    def steps_late(self, name: str) -> float:
        """How late a rate limit of the answer makes what is recorded, in sampling steps; inf of another effect."""
        effect, at = self.problem.effects[name], (self._reported or self.shown).point.shared
        if not isinstance(effect, RateLimit):
            return math.inf
        study = self.problem.study
        return effect.steps_late(study.model, list(study.trials), float(at[self.problem.columns[name][0]]))

    @property
    def strays(self) -> bool:
        """Whether runs stray from their records, with the answer's effects or without: their misfit says little."""
        return max(self.misfits["refit"], self.misfits["effects"]) > self.problem.settings.stray * self.problem.count

    def share(self, name: str) -> float:
        """Part of the gap that an effect of the answer closes: of the misfit of whole runs, or of the evidence.

        Runs that stray from their records have no misfit that means anything; there it is the part of the evidence.
        So it is where a fit without forces takes the drift of positions for slow noise: an effect may then explain
        most of what can be explained, though whole runs come no nearer. And an error of a sensor may close much of
        what that sensor shows, and any effect most of one channel, and little beside another channel that the model
        misses by far: of a vehicle that dives, in a current, the speed, beside the depth.
        """
        rest = tuple(n for n in self.key if n != name)
        plain, named = self.misfits["refit"], self.misfits["effects"]
        if self.strays:
            return self._share_of_evidence(name, rest)
        without, near = (self.search.fits.get((key, False)) for key in (rest, self.key))
        if without is None and near is not None:
            without = ensure(self.search, rest, near)
        gap = plain - self.problem.count
        if without is None or gap <= 0.0:
            return math.nan
        left = misfit(self.problem, self.deviation, without_discrepancy(self.problem, without.point))
        closed = float(np.clip((left - named) / gap, 0.0, 1.0))
        if closed < self.problem.settings.small_share:
            explained = self._explained_without_forces(rest)
            most = max(explained, self._closed_in_a_channel(rest))
            return most if most > _MOST else max(closed, self.closed_in_its_sensor(name))
        return closed

    def is_of_evidence(self, name: str) -> bool:
        """Whether the share of an effect is that of the evidence, and not about what the misfit of whole runs tells."""
        plain, named = self.misfits["refit"], self.misfits["effects"]
        if not self.strays:
            return False
        closed = (plain - named) / (plain - self.problem.count) if math.isfinite(plain) else math.nan
        return len(self.key) > 1 or not abs(closed - self.share(name)) < self.problem.settings.small_share

    def closed_in_its_sensor(self, name: str) -> float:
        """Part of the misfit of the channels of its sensors that an error of these closes; zero of another effect.

        NaN where runs diverge, or miss no more of these channels than their noise.
        """
        problem = self.problem
        if not is_within(problem.effects[name].cause, SENSOR):
            return 0.0
        rows = np.isin(problem.channel_of, sensor_channels(problem, name))
        rest = without_forces(self.search, tuple(n for n in self.key if n != name)).point
        points = without_discrepancy(problem, rest), self.points["effects"], self.points["refit"]
        left, named, plain = (misfit(problem, self.deviation, point, rows) for point in points)
        gap = plain - float(rows.sum())
        return float(np.clip((left - named) / gap, 0.0, 1.0)) if 0.0 < gap < math.inf else math.nan

    def _closed_in_a_channel(self, rest: Key) -> float:
        """The most that the answer closes of a channel that the refitted model misses, beyond its effects `rest`.

        Zero where it misses none, and of runs that diverge.
        """
        problem, most = self.problem, 0.0
        without = without_discrepancy(problem, without_forces(self.search, rest).point)
        for channel in range(len(problem.outputs)):
            rows = problem.channel_of == channel
            points = without, self.points["effects"], self.points["refit"]
            left, named, plain = (misfit(problem, self.deviation, point, rows) for point in points)
            if _MISSED * rows.sum() < plain < math.inf and math.isfinite(left + named):
                most = max(most, (left - named) / (plain - float(rows.sum())))
        return min(most, 1.0)

    def _explained_without_forces(self, rest: Key) -> float:
        """What the answer explains of the evidence beyond its other effects `rest`, over all that can be explained.

        Without forces, from the model alone to the leader, whatever that is.
        """
        fits = self.search.fits
        named, without, none = fits.get((self.key, False)), fits.get((rest, False)), fits.get(((), False))
        if named is None or without is None or none is None:
            return 0.0
        whole = self.search.leader.evidence - none.evidence
        return (named.evidence - without.evidence) / whole if whole > 0.0 else 0.0

    def traces(self) -> pd.DataFrame:
        """Time histories: trial, t, channel, measured, and what each of the models gives."""
        problem = self.problem
        simulated = {name: problem.simulate(point) for name, point in self.points.items()}
        frames = []
        for number, trial in enumerate(problem.trials):
            name = whole_name(trial.name) if problem.settings.sections > 1 else trial.name
            for c, channel in enumerate(problem.outputs):
                measured = np.asarray(trial.outputs.get(channel, np.full(len(trial), math.nan)))
                columns = {name: y[number][:, c] for name, y in simulated.items()}
                frames.append(
                    pd.DataFrame({"trial": name, "t": trial.t, "channel": channel, "measured": measured, **columns})
                )
        return pd.concat(frames, ignore_index=True)

    def _share_of_evidence(self, name: str, rest: Key) -> float:
        """Part of the evidence of the answer over none that is lost without one effect.

        One with a phase of its own in each trial finds a band in what any model leaves: beside forces that the model
        lacks, it is measured by what they explain as well.
        """
        at = self.shown
        without, none = ensure(self.search, rest, at), self.search.fits.get(((), at.discrepancy))
        if follows_each_trial(self.problem.effects[name]):
            none = self.search.fits.get(((), False), none)
        if without is None or none is None or at.evidence <= none.evidence:
            return math.nan
        return float(np.clip((at.evidence - without.evidence) / (at.evidence - none.evidence), 0.0, 1.0))
