"""Preparation steps of the published sea-trial procedure: each is asked for by name and leaves itself on record.

    from seatruth.trials import prepare
    trial = prepare.low_pass(prepare.hampel(trial), cutoff=1.0)
    trial = prepare.apply_steps(trial, [("cut", {"start": 10.0}), ("resample", {"rate": 5.0})])

STEPS holds every step by its name in study files, with the pydantic model of its options.
"""

from seatruth.trials.prepare.base import STEPS, Options, Preparation, apply_steps, jumps_by_a_turn, preparation
from seatruth.trials.prepare.filters import differentiate, low_pass, resample
from seatruth.trials.prepare.full_scale import full_scale
from seatruth.trials.prepare.fusion import DepthFusion, fuse, fuse_depth
from seatruth.trials.prepare.lever_arm import lever_arm
from seatruth.trials.prepare.outliers import hampel
from seatruth.trials.prepare.simple import (
    change_sign,
    correct,
    cut,
    fill_gaps,
    follow_heading,
    mark_invalid,
    shift_time,
    unwrap,
    zero_time,
)
from seatruth.trials.prepare.turn_current import TurnCurrent, remove_current, turn_current

__all__ = [
    "STEPS",
    "DepthFusion",
    "Options",
    "Preparation",
    "TurnCurrent",
    "apply_steps",
    "change_sign",
    "correct",
    "cut",
    "differentiate",
    "fill_gaps",
    "follow_heading",
    "full_scale",
    "fuse",
    "fuse_depth",
    "hampel",
    "jumps_by_a_turn",
    "lever_arm",
    "low_pass",
    "mark_invalid",
    "preparation",
    "remove_current",
    "resample",
    "shift_time",
    "turn_current",
    "unwrap",
    "zero_time",
]
