"""First-order waves: a force that each trial has in a phase of its own."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from seatruth.effects.base import Effect
from seatruth.effects.each_trial import is_trial, labels_of
from seatruth.effects.kinematics import G, to_body_axes
from seatruth.models.parameter import Parameter, Prior

_FREQUENCY = 0.8
"""rad/s: waves of 8 s. [S] A factor of 2.2 to either side, and twice that, covers seas and waves in a towing tank."""
_SPREAD = 0.8
"""Deviation of that logarithm. [S]"""


class WaveForces(Effect):
    """First-order force of one long-crested wave along its direction, at the frequency of encounter.

    Two trials have no phase in common: each has its own in-phase and out-of-phase acceleration, under one frequency
    and one direction. `trials` are the names of the trials; two unnamed ones stand for those of a study until
    `of_trials` gives them. The moment is in quadrature to the force and vanishes in head and beam seas, as that of a
    long wave's pressure on a slender box does.

    Example:
        >>> from seatruth.effects.waves import WaveForces
        >>> WaveForces(["out", "back"]).magnitudes
        ('cosine_out', 'sine_out', 'cosine_back', 'sine_back')
    """

    name = "wave_forces"
    title = "first-order wave forces"
    cause = "environment.wave_motion"
    number = 29
    equation = "F/m = cosine cos(w t - k s) + sine sin(w t - k s) of each trial, k = w^2/g, s along the direction"
    source = "[L] linear deep-water waves; [S] magnitudes chosen here"
    acts_on = ("surge", "sway", "yaw")
    confused_with = ("rudder_dead_band", "rudder_backlash", "sloshing")
    distinguished_by = (
        "a narrow band whose frequency moves with course and speed; limit cycles and sloshing keep theirs"
    )
    comes_with = ("wave_drift", "wave_drift_vertical")  # each sea has both, drift of second order
    needs_states = ("u", "v", "psi", "r", "x", "y")
    needs_vehicle = ("dimensions",)
    stochastic = True
    each_trial = True

    def __init__(self, trials: Sequence[str] = ("first", "second")) -> None:
        self.trials = tuple(trials)
        acceleration = 0.02, "m/s^2", -2.0, 2.0
        words = {"cosine": "acceleration in phase", "sine": "acceleration out of phase"}
        self.parameters = (
            *(
                Parameter(
                    f"{part}_{label}", *acceleration, source="[S] chosen here", description=f"{text}, trial {trial}"
                )
                for trial, label in zip(self.trials, labels_of(self.trials))
                for part, text in words.items()
            ),
            Parameter(
                "ln_frequency",
                math.log(_FREQUENCY),
                "1",
                math.log(0.1),
                math.log(10.0),
                prior=Prior(math.log(_FREQUENCY), _SPREAD),
                source="[S] chosen here: waves of 1.6 to 40 s",
                description="w, seen from the earth, rad/s, ln",
            ),
            Parameter(
                "towards",
                0.0,
                "rad",
                -7.0,
                7.0,
                prior=Prior(0.0, 1.5),
                source="[S] chosen here: nearly any direction",
                description="clockwise from x",
            ),
            Parameter(
                "lever",
                0.3,
                "1",
                -1.0,
                1.5,
                prior=Prior(0.3, 0.2),
                source="[L] long wave on a slender box: k L / 12, 0.3 for one of 1.75 L; [S] deviation",
                description="of the moment / L",
            ),
        )
        self.null = {q.name: 0.0 for q in self.parameters if q.prior is None}
        super().__init__()

    def of_trials(self, trials: Sequence[str]) -> Effect:
        return WaveForces(trials)

    @staticmethod
    def force(e: Any, s: Any, i: Any, p: Any, q: Any, d: Any) -> Any:
        *own, ln_frequency, towards, lever = tuple(q)
        cosine = sine = 0.0
        for k in range(len(own) // 2):
            here = is_trial(e.trial, k)
            cosine, sine = cosine + here * own[2 * k], sine + here * own[2 * k + 1]
        frequency, c, t = math.exp(ln_frequency), math.cos(towards), math.sin(towards)
        phase = frequency * e.t - frequency * frequency / G * (s.x * c + s.y * t)
        force = d.mass * (cosine * math.cos(phase) + sine * math.sin(phase))
        quadrature = d.mass * (sine * math.cos(phase) - cosine * math.sin(phase))
        along, across, _ = to_body_axes(c, t, s)
        N = lever * d.length * quadrature * along * across
        return e._replace(X=e.X + force * along, Y=e.Y + force * across, N=e.N + N)
