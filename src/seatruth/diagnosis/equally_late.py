"""Delays of the heading and of the rate of turn that are equal, which a steering that acts as much later shows as well.

Two sensors of different kinds are rarely late by the same time. A servo of another form than the model's, or an engine
that takes its time, is late in all that it turns.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from seatruth.diagnosis.decision import Decision
from seatruth.diagnosis.drift_in_turns import TIMING
from seatruth.diagnosis.fit import Fit
from seatruth.diagnosis.problem import Problem
from seatruth.diagnosis.size_errors import size_errors
from seatruth.diagnosis.verdict import Hypothesis
from seatruth.diagnosis.withdrawals import refusing
from seatruth.effects import Effect
from seatruth.effects.causes import is_within

_SENSORS = ("sensor:psi", "sensor:r")
_LATE = ("actuator.steering.dynamics", "actuator.propulsion.dynamics")
"""Causes of an actuator that acts later."""
_EQUAL = 2.0
"""Deviations of their difference within which two delays are equal: two, by convention."""


def equally_late(problem: Problem, at: Fit | None, effects: Mapping[str, Effect], names: Sequence[str]) -> list[str]:
    """Delays of the heading and of the rate of turn, of these effects of a fit, that are equal within their errors.

    Only beside a lateness of the steering or of the drive, and beside something else that the model lacks: of a
    workboat whose orders came 0.5 s late, and whose engine and roll its model had not, the rudder was late by 0.436 s,
    and compass and gyro by 0.039 +- 0.004 and 0.036 +- 0.003 s, at over 99.9 %.
    """
    if not any(is_within(effects[name].cause, cause) for name in names for cause in _LATE):
        return []
    late = {name: effects[name].acts_on for name in names if is_within(effects[name].cause, TIMING)}
    found = [name for sensor in _SENSORS for name, sensors in late.items() if sensors == (sensor,)]
    if len(found) != len(_SENSORS) or at is None or not at.discrepancy or not set(names) <= set(at.effects):
        return []
    errors = size_errors(problem, at)
    first, second = (int(problem.columns[name][0]) for name in found)
    apart = abs(float(at.point.shared[first] - at.point.shared[second]))
    return found if apart < _EQUAL * math.hypot(float(errors[first]), float(errors[second])) else []


def without_equally_late(decision: Decision, found: Sequence[Hypothesis], equal: Sequence[str]) -> Decision:
    """The decision less equal delays of the heading and of the rate of turn."""
    gone = tuple(one.member_in(decision.shown) for one in decision.clusters if one.member_in(decision.shown) in equal)
    kept = tuple(one for one in decision.clusters if one.member_in(decision.shown) not in gone)
    return refusing(decision, found, kept, turning=gone) if gone else decision
