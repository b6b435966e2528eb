"""A log as its model knows it: which inputs steer and drive, and what manoeuvres are told by that it lacks."""

from __future__ import annotations

from seatruth.effects.undeclared_actuators import drive_inputs, resting_inputs, steering_inputs
from seatruth.manoeuvres.recording import Recording, recordings
from seatruth.manoeuvres.steering import RudderSteering, Steering, steering_of
from seatruth.manoeuvres.steering_gear import Kind, steering_gear, with_planes
from seatruth.models.actuators import Thruster
from seatruth.models.base import Model
from seatruth.models.black_box import BlackBox
from seatruth.trials.trial import Trial

AHEAD = 0.5
"""Part of its thrust that a thruster gives ahead, from which it drives the vehicle: those that push across do not."""


def in_a_model(log: Trial, model: Model | None, *, others: bool = False) -> list[Recording]:
    """The log between its pauses, with what steers and drives it by the model; by its usual names without one.

    `others`: keep the pitch as well, and the inputs that neither steer nor drive it.
    """
    steering, (drives, unit) = _steering(model, log), _drives(model)
    kept: list[str] = []
    if others:
        known = {"delta", "delta_s", "n", *drives}
        if isinstance(steering, RudderSteering):
            known |= steering.gear.keys()
        elif steering is not None:
            known |= steering.layout.full.keys()
        inputs = () if model is None else model.inputs
        kept = ["theta", *(channel.name for channel in inputs if channel.name not in known)]
    return recordings(with_planes(model, log), steering, drives, unit, kept)


def _steering(model: Model | None, log: Trial) -> Steering | None:
    """What steers, by the model; by the log where its rudder has the usual name."""
    return None if model is None or "delta" in log.inputs else steering_of(model)


def _drives(model: Model | None) -> tuple[dict[str, float], str]:
    """The inputs of a model that push it ahead, with those at which they rest, and their unit."""
    if model is None:
        return {}, "rev/s"
    thrusters = [one for one in model.actuators if isinstance(one, Thruster)]
    ahead = [one.input for one in thrusters if not isinstance(one.towards[0], str) and one.towards[0] > AHEAD]
    box = isinstance(model, BlackBox)
    resting = {} if box else resting_inputs(model) or {}
    found = {name: resting.get(name, 0.0) for name in (ahead if thrusters or box else drive_inputs(model))}
    units = [channel.unit for channel in model.inputs if channel.name in found]
    return found, units[0] if units else "rev/s"


def not_recorded(log: Trial, model: Model | None = None) -> list[str]:
    """What recognition lacks in a log, and which manoeuvres it therefore cannot find, a sentence each.

    Example:
        >>> import numpy as np
        >>> t = np.arange(60.0)
        >>> not_recorded(Trial("log", t, {"delta": 0.0 * t, "n": 0.0 * t + 2.0}, {"psi": 0.0 * t}))
        ['There is no speed and no position: stops and straight runs cannot be found.']
    """
    parts = in_a_model(log, model)
    steers = all(part.control is None for part in parts) and not not_understood(log, model)
    lacks = [
        (steers, "rudder and no thrusters", "turning circles and zigzags"),
        (all(part.angle is None for part in parts), "heading", "turning circles, zigzags and straight runs"),
        (all(part.speed is None for part in parts), "speed and no position", "stops and straight runs"),
        (all(part.drive is None for part in parts), "drive", "crash stops"),
    ]
    return [f"There is no {what}: {lost} cannot be found." for lacking, what, lost in lacks if lacking and parts]


def not_understood(log: Trial, model: Model | None) -> list[str]:
    """What steers a model and is recorded, but not so that manoeuvres are told by it, a sentence."""
    kinds: tuple[Kind, ...] = ("rudder", "plane")
    if model is None:
        return []
    units = {channel.name: channel.unit for channel in model.inputs}
    known = {*log.inputs, *log.outputs}
    names = {kind: [name for name in steering_inputs(model, kind) if name in known] for kind in kinds}
    if any(steering_gear(model, kind).keys() & {*own} for kind, own in names.items()):
        if names["rudder"] or "theta" in known:
            return []
        return ["A plane steers and no pitch is recorded: zigzags in pitch cannot be found."]
    odd = [f"{name!r} steers in {units.get(name, '?')}, which is no angle" for own in names.values() for name in own]
    return [f"{', '.join(odd)}: zigzags cannot be told by it."] if odd else []
