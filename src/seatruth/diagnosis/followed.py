"""Whether fits follow the trials: runs that go elsewhere say little of causes, and are cut into sections."""

from __future__ import annotations

import math

import numpy as np

from seatruth.diagnosis.fit import Fit
from seatruth.diagnosis.problem import Problem
from seatruth.diagnosis.sizes import Sizes, noise_shapes

_LOST = 1.0
"""rad by which runs without forces miss a heading, root mean square, from which they are cut. [S] Beyond, a force ahead
pushes elsewhere. Of a course-unstable craft 4.6; of a boat with its nozzle 2 deg off, found in whole runs, 0.6."""
_NOT_WHITE = 3.0
"""Fitted white noise over that of the record, or the stated one, from which it holds more than noise. [S]"""
_MISSED = 0.25
"""Noise over the standard deviation of a record, from which a fit does not follow it. [S] Of the catamaran 0.35 to 1 in
heading, turning rate and speed, where its fit came to a false end; of a ship on a pond, well fitted, 0.003 to 0.2."""


def follows(problem: Problem, fitted: Sizes, recorded: Sizes) -> bool:
    """Whether runs that forces hold follow the trials in more than half of the channels, and in every angle.

    They do not follow a channel whose noise was fitted at several times the white noise of its record, and at a part of
    what the trials do, or of a radian: there a fit that came to its end took the motion for noise. A vehicle whose
    heading is not followed goes elsewhere in the end, whatever its other channels show. In sections the angles alone
    count: of a small vehicle in a current its forces took speeds and positions for noise, and whole runs, to which the
    search went back, lost everything.
    """
    shapes, missed, seen = noise_shapes(problem.settings), 0, 0
    angles = {channel.name for channel in problem.model.outputs if channel.angle}
    for c, name in enumerate(problem.outputs):
        records = [np.asarray(trial.outputs[name]) for trial in problem.trials if name in trial.outputs]
        records = [record for record in records if np.isfinite(record).any()]
        if not records:  # a section may lie in a gap of the sensor
            continue
        motion = math.sqrt(float(np.mean([np.nanvar(record) for record in records])))
        noise = math.exp(fitted.white[c]) * math.sqrt(shapes[fitted.shape[c]].correlation(0.0))
        if not fitted.white[c] - recorded.white[c] > math.log(_NOT_WHITE):
            noise = 0.0
        if name in angles and motion > 1.0 and noise > _MISSED:
            return False
        seen += 1
        missed += noise > _MISSED * motion
    return problem.settings.sections > 1 or 2 * missed < seen


def loses_heading(problem: Problem, plain: Fit) -> bool:
    """Whether a fit without forces misses an angle by more than a radian: its runs then go elsewhere than the trials.

    Forces hold such runs, but what an effect changes of them is no longer what it would change near the trials.
    """
    errors = problem.errors(plain.point)
    angles = [c for c, channel in enumerate(problem.model.outputs) if channel.angle]
    missed = [errors[problem.channel_of == c] for c in angles]
    return any(len(one) > 0 and float(np.mean(one**2)) > _LOST**2 for one in missed)
