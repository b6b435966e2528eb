"""How a model names an actuator, said where an effect on actuators finds none in it."""

from __future__ import annotations

from seatruth.effects.base import Effect
from seatruth.effects.targets import targets
from seatruth.effects.undeclared_actuators import USUAL
from seatruth.models.actuators import COMMANDS, radian_in
from seatruth.models.base import Model
from seatruth.models.black_box import BlackBox


def how_to_name(effect: Effect, model: Model) -> str:
    """What would let an effect act on an input of a model, as a sentence after a blank; "" where no input may be it.

    Example:
        >>> from seatruth.effects import available
        >>> from seatruth.models import load_model
        >>> how_to_name(available()["plane_gain"], load_model("glider")).partition(":")[0]
        " If one of 'm_b', 'x_p' is a plane, let the model say so"
    """
    kind = effect.actuator
    if not kind or targets(effect, model):
        return ""
    known = {one.input for one in model.actuators}
    usual = {name for names in USUAL.values() for name in names}
    free = [c for c in model.inputs if c.name not in known and model.standard_of(c.name)[0] not in usual]
    angles = [channel for channel in free if channel.unit == "rad"]
    others = [channel for channel in free if channel.unit != "rad"]
    names = [channel.name for channel in (others if kind == "thruster" else angles or others)]
    if not names:
        return ""
    which = f"{names[0]!r} is" if len(names) == 1 else f"one of {', '.join(map(repr, names))} is"
    return f" If {which} a {kind}, let the model say so: {_entry(kind, names[0], model)}."


def _entry(kind: str, name: str, model: Model) -> str:
    """The lines that make an input an actuator."""
    if isinstance(model, BlackBox):
        more = {"plane": ', turns = "pitch"', "thruster": ", full = 20.0, at = [-1, 0, 0], towards = [1, 0, 0]"}
        keys = f'input = "{name}"{more.get(kind, "")}'
        return f"its `actuators`, or for an FMU [model.actuators.{kind}] with {keys}"
    if kind == "thruster":
        where = "at=(-1.0, 0.0, 0.0), towards=(1.0, 0.0, 0.0), full=20.0"
        return f"actuators = (Thruster({name!r}, {name!r}, {where}),), with its place and full input, and `thrusts`"
    turns = ", turns='pitch'" if kind == "plane" else ""
    unit = next(channel.unit for channel in model.inputs if channel.name == name)
    told = radian_in(unit) is not None or unit in COMMANDS
    full, which = ("", "") if told else (", full=1.0", f", `full` what it holds hard over, in {unit}")
    return f"actuators = (Rudder({kind!r}, {name!r}{turns}{full}),){which}"
