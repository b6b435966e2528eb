"""Manoeuvres: simulated in closed loop to make trials, and their figures from any trial."""

from seatruth.manoeuvres.figures import (
    TurningCircleFigures,
    ZigzagFigures,
    turning_circle_figures,
    zigzag_figures,
)
from seatruth.manoeuvres.gliding import GlideSpiral, Sawtooth, Trim
from seatruth.manoeuvres.plans import (
    CoastDown,
    Manoeuvre,
    PitchZigzag,
    SpeedSteps,
    Spiral,
    Straight,
    TurningCircle,
    Zigzag,
)
from seatruth.manoeuvres.run import (
    Stepper,
    add_noise,
    run_manoeuvre,
    self_propulsion,
    steady_current,
)

__all__ = [
    "CoastDown",
    "GlideSpiral",
    "Manoeuvre",
    "PitchZigzag",
    "Sawtooth",
    "SpeedSteps",
    "Spiral",
    "Stepper",
    "Straight",
    "Trim",
    "TurningCircle",
    "TurningCircleFigures",
    "Zigzag",
    "ZigzagFigures",
    "add_noise",
    "run_manoeuvre",
    "self_propulsion",
    "steady_current",
    "turning_circle_figures",
    "zigzag_figures",
]
