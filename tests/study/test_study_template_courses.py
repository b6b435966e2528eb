"""Angles that jump and commands that step, as a first study says it."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from seatruth.models import BlackBox, load_model
from seatruth.readers import Log, Table
from seatruth.study.fields import Fields
from seatruth.study.infer_columns import InferredColumn
from seatruth.study.template_courses import between_samples, jumps_by_a_turn, wrapped_angles
from seatruth.trials import Channel

T = np.arange(0.0, 100.0, 0.1)
STEPS = np.where(T % 20.0 < 10.0, 1500.0, 1650.0) + (np.arange(T.size) % 2)
"""Pulses of an autopilot that holds its depth: they step, and change by 1 us all the time."""


@pytest.mark.parametrize(
    ("numbers", "unit", "order", "held"),
    [
        (STEPS, "us", False, True),
        ((STEPS - 1500.0) / 400.0, "1", False, True),
        (STEPS, "rpm", False, False),
        (1500.0 + 100.0 * np.sin(T), "us", False, False),
        (np.sin(T), "deg", True, True),
    ],
)
def test_commands_that_step_are_held(numbers: np.ndarray, unit: str, order: bool, held: bool) -> None:
    guessed = InferredColumn("n", "c", unit, "", order)
    assert between_samples({"c": numbers}, {"n": guessed}, load_model("mmg")) == (["n"] if held else [], [])


def test_what_does_not_step_is_joined_by_lines_beside_orders() -> None:
    columns = {"rudder": np.sign(np.sin(T)), "rpm": 600.0 + 20.0 * np.sin(0.1 * T)}
    guesses = {
        "delta": InferredColumn("delta", "rudder", "deg", "", order=True),
        "n": InferredColumn("n", "rpm", "rpm", ""),
    }
    model = load_model("mmg")
    assert between_samples(columns, guesses, model) == (["delta"], ["n"])
    assert between_samples({**columns, "rpm": STEPS}, guesses, model) == (["delta"], []), "it may be an order too"
    box = BlackBox("box", lambda *_: {}, inputs=model.inputs, outputs=model.outputs, parameters=[])
    assert between_samples(columns, guesses, box) == (["delta"], []), "it treats all alike"


def test_a_heading_that_wraps_jumps() -> None:
    guessed = InferredColumn("psi", "h", "deg", "")
    assert jumps_by_a_turn({"h": (10.0 * T) % 360.0}, guessed, False)
    assert not jumps_by_a_turn({"h": T}, guessed, False)
    assert jumps_by_a_turn({"h": T}, guessed, True)


def test_angles_of_a_model_are_unwrapped_where_any_log_jumps() -> None:
    """But not a rudder, nor the course, nor an input that is no angle."""
    jumping = (10.0 * T + 180.0) % 360.0 - 180.0
    names = ("az", "delta", "cog", "n")
    guesses = {name: InferredColumn(name, name, "rpm" if name == "n" else "deg", "") for name in names}
    channels = [Channel(name, "rev/s" if name == "n" else "rad") for name in names]
    quiet, loud = (_log(dict.fromkeys(names, values)) for values in (0.0 * T, jumping))
    assert wrapped_angles(Fields(quiet), guesses, channels, None) == []
    assert wrapped_angles(Fields(quiet), guesses, channels, [quiet, loud]) == ["az"]
    assert wrapped_angles(Fields(loud), guesses, channels, None) == ["az"]


def _log(columns: dict[str, np.ndarray]) -> Log:
    return Log("run", {"": Table("run", {name: pd.Series(values) for name, values in columns.items()})})
