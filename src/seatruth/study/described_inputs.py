"""Finds the columns of inputs by what the model says of them: "Steer_deg" for the steering angle of an outboard.

Names alone decide first (`infer_columns`). What is left over is looked at here: a column whose every word is one of the
input's description, of its kind of actuator, or says nothing. It is taken where there is one such column alone.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from seatruth.models import Model
from seatruth.study.column_spellings import spelt_out
from seatruth.study.infer_columns import InferredColumn, infer_columns, place_in, split_header
from seatruth.trials.channel import Channel

Numbers = NDArray[np.float64]
_STEERING = frozenset(
    (
        *(
            "steer",
            "steering",
            "steered",
            "rudder",
            "rud",
            "helm",
            "tiller",
            "nozzle",
            "wheel",
            "outboard",
            "sterndrive",
        ),
        *("jet", "waterjet", "azimuth", "pod"),
    )
)
_PLANES = frozenset(("plane", "planes", "elevator", "elevators", "fin", "fins", "sternplane", "hydroplane"))
_SHARES = frozenset(("throttle", "thr", "load", "power", "lever"))
"""Words of a part of what a drive can give: per cent, or 0 to 1. No speed of revolution, whatever the numbers are."""
_DRIVES = _SHARES | frozenset(
    (
        *("engine", "motor", "propeller", "prop", "thruster", "shaft", "rpm", "rps", "rev", "revs", "revolutions"),
        *("outboard", "sterndrive", "jet", "waterjet", "impeller", "pump", "pod", "esc", "main", "cpp"),
    )
)
_BALLAST = frozenset(
    (
        *("ballast", "buoyancy", "oil", "bladder", "vbd", "vbs", "vbe", "volume", "vol", "pumped", "displaced"),
        *("displacement", "engine", "piston", "de", "ballastpumped"),
    )
)
_BATTERY = frozenset(("battery", "batt", "bat", "batteries", "battpos"))
_SUPPLY = _BATTERY - {"battpos"}
"""Words that alone mean the supply, whose volts or charge a log has too."""
_KINDS: tuple[tuple[frozenset[str], frozenset[str]], ...] = (
    (frozenset(("steer", "steering", "rudder", "helm", "tiller", "nozzle", "delta", "delta_r")), _STEERING),
    (frozenset(("plane", "planes", "elevator", "delta_s", "delta_e")), _PLANES),
    (
        frozenset(("propeller", "prop", "engine", "motor", "throttle", "thruster", "shaft", "revolutions", "rpm", "n")),
        _DRIVES,
    ),
    (frozenset(("ballast", "buoyancy", "oil", "bladder", "vbd", "vbs")), _BALLAST),
    (frozenset(("battery", "batteries", "sliding")), _BATTERY),
)
"""Words of an input that say what kind of actuator it is, and the words by which logs call that. The first one holds:
"steering angle of the outboard motor" steers."""
_NEUTRAL = frozenset(
    (
        *("angle", "position", "pos", "speed", "rate", "actual", "act", "measured", "meas", "feedback", "fb", "sensor"),
        *("value", "val", "signal", "deflection", "setting", "vessel", "ship", "boat", "usv", "vehicle", "percentage"),
    )
)
"""Words that do not say which input it is."""
_BESIDE_A_NAME = _NEUTRAL | _DRIVES | frozenset(("pwm", "servo", "channel", "ch", "output", "out", "command", "cmd"))
"""Words beside an input's own name that leave no doubt of it: "pwm_fp_us" of the input "fp"."""
_OF_ANGLES = frozenset(("angle", "deflection"))
"""Words of what steers, which a drive has not: "jet angle"."""
_NO_CONTENT = frozenset(("of", "the", "a", "an", "its", "and", "in", "at", "to", "by", "command", "commanded", "order"))
_ANGLES = ("rad", "deg")


_LETTERS = {"p": "port", "s": "starboard"}
"""Last letters of columns of the two sides, of models that have an input for each."""
_ACTUATOR = "actuator"
"""What an input and its column are called where the words that tell it have been read."""


class _Seen(NamedTuple):
    """A column that may be an input, before its unit is looked at: its name without the words that tell the input."""

    column: str
    plain: str
    unit: str
    share: bool


@dataclass(frozen=True)
class Described:
    """Columns by input, and, by input, columns that may be meant but cannot be taken without a word of the user."""

    found: dict[str, InferredColumn]
    open: dict[str, tuple[str, ...]]

    def notes(self, missing: Sequence[Channel]) -> list[str]:
        """What the user should know of columns that were not taken for inputs that are missing."""
        said = []
        for channel in missing:
            columns = self.open.get(channel.name, ())
            listing = " and ".join(repr(column) for column in columns)
            if len(columns) == 1:
                unit = "without a unit" if channel.unit == "1" else f"in {channel.unit}"
                said.append(
                    f"The column {listing} may be meant for {channel.name!r}, which the model takes {unit}: that "
                    f"column is not. {_scaled(columns[0], channel)}"
                )
            elif columns:
                said.append(f"The columns {listing} may all be meant for {channel.name!r}.")
        return said


def _scaled(column: str, channel: Channel) -> str:
    """What to do with a column of another unit; a part of a largest speed has a scale that the user knows."""
    if channel.unit == "rev/s" and split_header(column)[1] in ("percent", "%"):
        return (
            f'Where 100 % is 1200 rpm, write {channel.name} = {{ column = "{column}", unit = "rev/s", scale = 0.2 }}; '
            "or name another column."
        )
    return "Let the model take what was recorded, or name another column."


def described_inputs(
    columns: Mapping[str, Numbers], inputs: Sequence[Channel], model: Model, taken: Collection[str] = ()
) -> Described:
    """Columns (name to numbers) of a model's inputs, by the words that the model uses for them; not those `taken`.

    Example:
        >>> import numpy as np
        >>> from seatruth.models import load_model
        >>> ship = load_model("mmg")
        >>> log = {"Steer_deg": np.array([0.0, 20.0]), "Throttle_pct": np.array([0.0, 80.0])}
        >>> described = described_inputs(log, ship.inputs, ship)
        >>> described.found["delta"].column, described.open
        ('Steer_deg', {'n': ('Throttle_pct',)})
    """
    names = [name for name in columns if name not in taken]
    seen = {channel.name: _seen(names, channel, model) for channel in inputs}
    fitting = {
        channel.name: [hit for one in seen[channel.name] if (hit := _taken(one, columns[one.column], channel))]
        for channel in inputs
    }
    shared = [hit.column for many in fitting.values() for hit in many]
    found: dict[str, InferredColumn] = {}
    unclear: dict[str, tuple[str, ...]] = {}
    for channel in inputs:
        own = [hit for hit in fitting[channel.name] if shared.count(hit.column) == 1]
        acted = [hit for hit in own if not hit.order] or own
        if len(acted) == 1:
            found[channel.name] = acted[0]
        elif seen[channel.name]:
            unclear[channel.name] = tuple(one.column for one in seen[channel.name])
    return Described(found, unclear)


def _seen(columns: Sequence[str], channel: Channel, model: Model) -> list[_Seen]:
    """The columns whose words fit what the model says of an input."""
    said = re.split("[,;(]", channel.description, maxsplit=1)[0]
    about = {*split_header(said)[0].split(), *split_header(channel.name)[0].split()} - _NO_CONTENT
    place = {*place_in(" ".join(about)).split()}
    named = {*about, model.standard_of(channel.name)[0]}
    kind = next((words for tell, words in _KINDS if tell & named), frozenset[str]())
    telling = kind | {word for word in about if len(word) > 1 and not place_in(word)} - _NEUTRAL
    own = channel.name.strip("_").lower() if len(channel.name.strip("_")) > 1 else ""
    found = []
    for column in columns:
        name, unit = split_header(column.rpartition(".")[2])
        if place and unit == "s":  # no input is in seconds: "Rudder S"
            name, unit = f"{name} s", ""
        words = spelt_out(name).split()
        if own in words and {*words} <= {own} | _BESIDE_A_NAME:
            found.append(_Seen(column, _ACTUATOR, unit, False))
            continue
        if place and words and words[-1] in _LETTERS:  # of one of two: "Rudder P", "RudderFb S"
            words[-1] = _LETTERS[words[-1]]
        told = telling & {*words}
        if not told or {*place_in(" ".join(words)).split()} != place or (kind is _DRIVES and {*words} & _OF_ANGLES):
            continue
        if not unit and {*words} <= _SUPPLY:
            continue
        left = [word for word in words if word not in telling | _NEUTRAL and not place_in(word)]
        plain = " ".join((_ACTUATOR, *left))
        if _inferred(plain, "", np.empty(0), channel) is not None:
            found.append(_Seen(column, plain, unit, bool(told & _SHARES)))
    return found


def _inferred(name: str, unit: str, numbers: Numbers, channel: Channel) -> InferredColumn | None:
    """What a column of an actuator is to its input: names that hold other words than those of an order are none."""
    header = f"{name} [{unit}]" if unit else name
    actuator = Channel(_ACTUATOR, channel.unit)
    return infer_columns({header: numbers}, [actuator], orders=[_ACTUATOR]).get(_ACTUATOR)


def _taken(seen: _Seen, numbers: Numbers, channel: Channel) -> InferredColumn | None:
    """A column as an input; None where its unit or its numbers are something else."""
    unit = seen.unit
    if not unit and seen.share:
        if channel.unit != "1":
            return None
        finite = numbers[np.isfinite(numbers)]
        unit = "percent" if finite.size and float(np.abs(finite).max()) > _FULL else "1"
    elif unit and (unit in _ANGLES) != (channel.unit in _ANGLES):
        return None  # an angle is a number for arithmetic, but no command
    hit = _inferred(seen.plain, unit, numbers, channel)
    if hit is None:
        return None
    why = hit.why if unit == seen.unit else "assumed; the header has no unit"
    return replace(hit, channel=channel.name, column=seen.column, why=f"{why}; taken by its words, so check it")


_FULL = 1.5
"""Above this a share is in per cent: drives give a little more than their rated power at most."""
