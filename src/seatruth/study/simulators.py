"""The model that a study names: an installed one, a user's own, or a simulator as an FMU with what is said of it."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from seatruth.effects.thruster_places import check_thruster_places
from seatruth.effects.turned_thrusters import check_turned_thrusters
from seatruth.models import (
    BlackBox,
    Dimensions,
    IsolatedBlackBox,
    Model,
    Rudder,
    Thruster,
    load_fmu,
    load_model,
    with_areas,
)
from seatruth.models.isolated import TIME_LIMIT
from seatruth.study.quantity import positive
from seatruth.study.schema import ModelActuatorTable, ModelTable
from seatruth.study.validation import Problems

_OF_AN_FMU = ("names", "inputs", "outputs", "initial", "ports", "dimensions", "actuators", "kind", "step")
_OF_A_THRUSTER = ("full", "at", "towards")
_AREAS = ("frontal_area", "lateral_area")


def model_of(table: ModelTable, hold: Literal["foh", "zoh"], folder: Path, problems: Problems) -> Model | None:
    """The model of a study; notes keys that do not belong to it."""
    if table.use.endswith(".fmu"):
        if table.set is not None:
            problems.add(("model", "set"), "an FMU offers no parameter sets", "Leave out `set`.")
            return None
        size = table.dimensions
        actuators = [_actuator(name, one, problems) for name, one in table.actuators.items()]
        simulator = load_fmu(
            folder / table.use,
            names=table.names,
            inputs=table.inputs,
            outputs=table.outputs,
            initial=table.initial,
            ports={key: value for key, value in table.ports.model_dump().items() if value},
            step=table.step,
            hold=hold,
            kind=table.kind,
            dimensions=None if size is None else Dimensions(**size.model_dump()),
            actuators=[one for one in actuators if one is not None],
            time_limit=TIME_LIMIT if table.time_limit is None else table.time_limit,
        )
        return _with_areas(simulator, table, problems)
    model = _with_areas(load_model(table.use, folder, table.set), table, problems)
    check_turned_thrusters(model)
    check_thruster_places(model)
    for key in _OF_AN_FMU:
        if key in table.model_fields_set:
            what = f"{key!r} belongs to an FMU"
            problems.add(("model", key), what, "A model of Python states this itself; remove it here.")
    if table.time_limit is None:
        return model
    if not isinstance(model, BlackBox):
        what = "only a simulator that seatruth cannot look into has a time limit"
        problems.add(("model", "time_limit"), what, "Remove it.")
        return model
    return IsolatedBlackBox(model, time_limit=table.time_limit)


def _with_areas(model: Model, table: ModelTable, problems: Problems) -> Model:
    """The model with the areas above water that the table states; notes what is wrong with them."""
    for name in _AREAS:
        stated = getattr(table, name)
        if stated is None:
            continue
        if table.dimensions is not None and getattr(table.dimensions, name) is not None:
            problems.add(("model", name), f"{name!r} is stated twice", "Remove it here or in [model.dimensions].")
            continue
        with problems.at("model", name):
            model = with_areas(model, **{name: positive(stated, "m2", "an area")})
    return model


def _actuator(name: str, table: ModelActuatorTable, problems: Problems) -> Rudder | Thruster | None:
    """An actuator as the file states it; notes keys that do not belong together."""
    path = ("model", "actuators", name)
    stated = [key for key in (*_OF_A_THRUSTER, "diameter", "force", "turned_by") if getattr(table, key) is not None]
    if not stated or (table.turns is not None and stated == ["full"]):
        return Rudder(name, table.input, table.turns or "yaw", table.full)
    if table.turns is not None:
        stated = [key for key in stated if key != "full"]
        problems.add((*path, "turns"), f"a rudder has no {stated[0]!r}", "Remove `turns` of a thruster.")
        return None
    if table.full is None or table.at is None or table.towards is None:
        lacking = next(key for key in _OF_A_THRUSTER if key not in stated)
        problems.add(path, f"a thruster needs {lacking!r}", f"State {', '.join(_OF_A_THRUSTER)}.")
        return None
    (x, y, z), (a, b, c) = table.at, table.towards
    return Thruster(name, table.input, (x, y, z), (a, b, c), table.full, table.diameter, table.force, table.turned_by)
