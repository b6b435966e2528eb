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
    CrashStop,
    Manoeuvre,
    PitchZigzag,
    SpeedSteps,
    Spiral,
    Straight,
    TurningCircle,
    Zigzag,
)
from seatruth.manoeuvres.run import (
    add_noise,
    run_manoeuvre,
    self_propulsion,
    steady_current,
)
from seatruth.manoeuvres.spirals import SpiralFigures, spiral_figures
from seatruth.manoeuvres.steering import steered
from seatruth.manoeuvres.stepper import Stepper
from seatruth.manoeuvres.stopping import StoppingFigures, stopping_figures
from seatruth.manoeuvres.thrusting import AxisSteps, StationKeeping, ThrusterLayout, ThrusterSteps, thruster_layout

__all__ = [
    "AxisSteps",
    "CoastDown",
    "CrashStop",
    "GlideSpiral",
    "Manoeuvre",
    "PitchZigzag",
    "Sawtooth",
    "SpeedSteps",
    "Spiral",
    "SpiralFigures",
    "StationKeeping",
    "Stepper",
    "StoppingFigures",
    "Straight",
    "ThrusterLayout",
    "ThrusterSteps",
    "Trim",
    "TurningCircle",
    "TurningCircleFigures",
    "Zigzag",
    "ZigzagFigures",
    "add_noise",
    "run_manoeuvre",
    "self_propulsion",
    "spiral_figures",
    "steady_current",
    "steered",
    "stopping_figures",
    "thruster_layout",
    "turning_circle_figures",
    "zigzag_figures",
]
