"""Recorded runs: reading them, preparing them on record, and checking them at the door.

`read_trial` reads one run from a log of any format that a reader knows; `apply_steps` runs named preparation steps,
each of which leaves a Step in the trial; `check_trials` says what is wrong with the data before any fit.
"""

from seatruth.trials.channel import Channel
from seatruth.trials.check import check_trials, excitation_table
from seatruth.trials.columns import ColumnSpec
from seatruth.trials.finding import Finding, findings_table
from seatruth.trials.frames import Frames
from seatruth.trials.prepare import STEPS, apply_steps
from seatruth.trials.read import read_trial
from seatruth.trials.standard_channels import STANDARD_CHANNELS
from seatruth.trials.time_axis import Clock
from seatruth.trials.trial import Step, Trial, Trials

__all__ = [
    "STANDARD_CHANNELS",
    "STEPS",
    "Channel",
    "Clock",
    "ColumnSpec",
    "Finding",
    "Frames",
    "Step",
    "Trial",
    "Trials",
    "apply_steps",
    "check_trials",
    "excitation_table",
    "findings_table",
    "read_trial",
]
