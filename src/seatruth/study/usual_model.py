"""The model of a first study, where the user names none: a ship, unless the log is one of a vehicle that dives."""

from __future__ import annotations

from typing import NamedTuple

from seatruth.models import load_model
from seatruth.readers import Log
from seatruth.study.described_inputs import described_inputs
from seatruth.study.fields import Fields
from seatruth.study.infer_columns import infer_columns
from seatruth.study.numbered_columns import numbered_columns
from seatruth.study.pressure_columns import pressure_of_depth
from seatruth.trials import STANDARD_CHANNELS, Channel

SHIP, PLANE, DRIVEN_PLANE, GLIDER, ROV = "mmg", "diving_plane", "diving_plane_driven", "glider", "bluerov2"
_STEERED = ("delta", "n_port", "n_starboard")
"""Inputs of what is steered at the surface, where no stern plane is beside them: its pitch is a motion in waves, its
depth that of the water."""


class Usual(NamedTuple):
    """A model's name, and, of a vehicle that dives, what of the log speaks for it, as a sentence; "" for a ship."""

    name: str
    why: str


def usual_model(log: Log) -> Usual:
    """The model to begin with for a log.

    Example:
        >>> import pandas as pd
        >>> from seatruth.readers import Table
        >>> columns = {name: pd.Series([0.0, 1.0]) for name in ("t", "pitch_deg", "depth_m", "elevator_deg")}
        >>> usual_model(Log("log.csv", {"": Table("log.csv", columns, {})})).name
        'diving_plane'
    """
    fields = Fields(log)
    drives = [Channel(name, "rev/s") for name in _STEERED[1:]]
    channels = [*(STANDARD_CHANNELS[name] for name in ("theta", "z", "depth", "delta", "delta_s")), Channel("T", "N")]
    found = infer_columns(
        fields,
        [*channels, *drives],
        orders=["delta", "delta_s", "T", *_STEERED[1:]],
        thrusters={"n_port": "port", "n_starboard": "starboard"},
    )
    dives = {"z", "depth"} & {*found} or pressure_of_depth(fields, "z").found is not None
    steered = {*_STEERED} & {*found}
    if "theta" not in found or not dives or (steered and "delta_s" not in found):
        return Usual(SHIP, "")
    if "delta_s" in found:
        driven = "T" in found
        inputs = "a stern plane and a thrust" if driven else "a stern plane"
        return Usual(DRIVEN_PLANE if driven else PLANE, _has(inputs, steered="delta" in found))
    rov = load_model(ROV)
    commands = [channel for channel in rov.inputs if channel.unit == "1"]
    if len(numbered_columns(fields, commands)) == len(commands):
        return Usual(ROV, _has("six numbered outputs"))
    glider = load_model(GLIDER)
    described = described_inputs(fields, [one for one in glider.inputs if one.name != "delta"], glider)
    if described.found or described.open:
        return Usual(GLIDER, _has("a ballast or a mass that is moved"))
    return Usual(PLANE, "The log has a pitch and a depth, but no input that a model of seatruth takes: name your own.")


def _has(inputs: str, *, steered: bool = False) -> str:
    left_out = ". Its motion in the horizontal plane, under the rudder, is left out: --model torpedo takes both."
    beside = left_out if steered else ", and no rudder."
    return f"The log has a pitch, a depth and {inputs}{beside}"
