"""How the numbers of a log run on, as far as a first study says it: angles that jump by a turn, commands that step."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from seatruth.costs.stepped_orders import steps_from_rest
from seatruth.effects.undeclared_actuators import USUAL
from seatruth.models import BlackBox, Model
from seatruth.readers import Log
from seatruth.study.fields import Fields
from seatruth.study.infer_columns import InferredColumn
from seatruth.trials.channel import Channel
from seatruth.units import PULSES

Numbers = NDArray[np.float64]
ANGLES = ("psi", "phi", "theta")
"""Standard angles that may jump by a turn."""
_OTHERWISE = (*USUAL["rudder"], *USUAL["plane"], "cog")
"""Angles that stay within a quarter turn, and the course, which follows the heading (`follow_heading`)."""
_TURNS = {"deg": 360.0, "rad": 2.0 * np.pi}
"""A full turn, by the unit of the column."""


def jumps_by_a_turn(columns: Mapping[str, Numbers], guessed: InferredColumn, others: bool) -> bool:
    """Whether an angle jumps by most of a turn; a heading that stays within one may do so in other logs."""
    numbers, turn = columns[guessed.column], _TURNS.get(guessed.unit, 2.0 * np.pi)
    numbers = numbers[np.isfinite(numbers)]
    jumps = np.abs(np.diff(numbers))
    within = others and guessed.channel == "psi" and bool(numbers.size) and float(np.abs(numbers).max()) <= turn
    return within or (bool(jumps.size) and float(jumps.max()) > 0.75 * turn)


def wrapped_angles(
    fields: Fields, guesses: Mapping[str, InferredColumn], channels: Sequence[Channel], others: Iterable[Log] | None
) -> list[str]:
    """The channels that need `unwrap`: headings, pitch and roll, and what else of a model's `channels` is an angle.

    The direction of a pod jumps in the run that turns it astern alone, so `others`, the further logs, are asked as
    well, one by one until they have told; None where there is one log only.
    """
    found = [one for one in ANGLES if one in guesses and jumps_by_a_turn(fields, guesses[one], others is not None)]
    open_ = {
        channel.name: guesses[channel.name]
        for channel in channels
        if channel.name in guesses
        and channel.unit == "rad"
        and channel.name not in (*ANGLES, *_OTHERWISE)
        and guesses[channel.name].unit in _TURNS
    }
    wrapped: set[str] = set()
    for record in itertools.chain([fields], map(Fields, others or ()) if open_ else ()):
        wrapped |= {name for name, hit in open_.items() if hit.column in record and jumps_by_a_turn(record, hit, False)}
        if wrapped == open_.keys():
            break
    return [*found, *(name for name in open_ if name in wrapped)]


def between_samples(
    columns: Mapping[str, Numbers], guesses: Mapping[str, InferredColumn], model: Model
) -> tuple[list[str], list[str]]:
    """Inputs that keep their value until the next sample, and, beside such, those that do not step: measured ones.

    A black box joins or holds all alike.
    """
    known = [channel.name for channel in model.inputs if channel.name in guesses]
    held = [name for name in known if _is_held(columns, guesses[name])]
    if not held or isinstance(model, BlackBox):
        return held, []
    return held, [name for name in known if name not in held and not _steps(columns[guesses[name].column])]


def _is_held(columns: Mapping[str, Numbers], guessed: InferredColumn) -> bool:
    """Whether an input keeps its value until the next sample: it is an order, or a command that steps.

    A command has no unit, or is a pulse: no actuator moves so, as it may where the column holds an angle or a speed.
    """
    if guessed.order:
        return True
    return guessed.unit in ("1", *PULSES) and _steps(columns[guessed.column])


def _steps(numbers: Numbers) -> bool:
    return steps_from_rest(numbers[np.isfinite(numbers)]) > 0
