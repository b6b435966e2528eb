"""What the channels of a study file measure: the observations that the model gets as outputs."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Mapping, Sequence
from typing import Any, Literal

import numpy as np

from seatruth.costs.options import OPTIONS, TrajectoryOptions
from seatruth.effects import ExtendedBlackBox, ExtendedModel
from seatruth.errors import BadInput
from seatruth.models import MEASURES, BlackBox, Model, Observation, ServoBlackBox, WithServos, observed
from seatruth.models.observed import ObservedBlackBox, ObservedModel
from seatruth.models.with_holds import WithHolds
from seatruth.study.schema import StudyFile
from seatruth.study.schema_trials import ChannelTable
from seatruth.study.validation import Problems
from seatruth.trials import Channel, Trial
from seatruth.trials.frames import POSITIONS
from seatruth.trials.prepare import apply_steps, jumps_by_a_turn
from seatruth.trials.trial import Step

_AROUND = (ExtendedModel, ExtendedBlackBox, WithServos, ServoBlackBox, WithHolds)
"""Effects, servos and holds around a model."""


def observed_as_stated(model: Model, file: StudyFile, problems: Problems) -> Model | None:
    """The model with the outputs that [channels] says the instruments measure; None where that is not possible."""
    inputs = {channel.name for channel in model.inputs}
    outputs = {channel.name for channel in model.outputs}
    for entry, trial in enumerate(file.trials):
        for name, changes in trial.channels.items():
            for key in sorted(changes.model_fields_set & {"measures", "at"}):
                problems.add(
                    ("trials", entry, "channels", name, key),
                    f"{key!r} holds for all trials",
                    "State it in [channels]; trials with another sensor need a channel of their own.",
                )
    observations: list[Observation] = []
    named = _named(file)
    antenna = _antenna(model, file, problems)
    for name, table in named.items():
        if name in _FIXES or (table.at is not None and not _has_place(name, table, problems)):
            continue
        if _is_observation(name, table, inputs, outputs):
            with problems.at("channels", name):
                observations.append(Observation(name, table.measures, _place(table)))
                observed(model, observations[-1:])  # each channel's own fault has its own line
    if problems:
        return None
    with problems.at("channels"):
        return observed(model, [*antenna, *_with_velocity(observations, named, model, file)], keep=tuple(named))
    return None


_FIXES = tuple(name for pair in POSITIONS for name in pair)
"""Channels from which reading makes x and y: they are compared as these."""


def _antenna(model: Model, file: StudyFile, problems: Problems) -> list[Observation]:
    """x and y as an antenna shows them whose latitude and longitude, or northing and easting, state its place.

    A place that one of the two states holds for both, as one receiver gives both.
    """
    named = _named(file)
    for pair in POSITIONS:
        tables = {name: named[name] for name in pair if name in named}
        for name in (name for name, table in tables.items() if table.measures is not None):
            problems.add(("channels", name, "measures"), f"{name!r} is read as x and y", "Remove `measures`.")
        for name in (name for name in ("x", "y") if tables and name in file.channels):
            if file.channels[name].at is not None and file.channels[name].column is None:
                do = f"Remove {name!r}, and give {pair[0]!r} its `at`."
                problems.add(("channels", name), f"{name!r} is made of {' and '.join(tables)}", do)
        placed = {name: _place(table) for name, table in tables.items() if table.at is not None}
        if not placed:
            continue
        path, places = ("channels", next(iter(placed)), "at"), {*placed.values()}
        if len(places) > 1:
            problems.add(path, f"{' and '.join(pair)} have different places", "State one place for both.")
        elif isinstance(model, BlackBox) and {"x", "y"} & {channel.name for channel in model.states}:
            do = "Move the positions of the log, with the step 'lever_arm' on the channels x and y."
            problems.add(path, "the positions of a black box that are its states cannot be shown elsewhere", do)
        else:
            with problems.at(*path):
                antenna = [Observation(name, name, *places) for name in ("x", "y")]
                observed(model, antenna)
                return antenna
    return []


def _has_place(name: str, table: ChannelTable, problems: Problems) -> bool:
    """Whether what a channel measures depends on the sensor's place; if not, that is a problem."""
    if table.measures is not None or name in MEASURES:
        return True
    do = "Remove `at`: angles and rates are the same everywhere aboard. A sensor of something else needs `measures`."
    problems.add(("channels", name, "at"), f"what {name!r} measures does not depend on the place of the sensor", do)
    return False


def _named(file: StudyFile) -> dict[str, ChannelTable]:
    return {name: table for entry in file.trials for name, table in entry.channels.items()} | dict(file.channels)


VELOCITY = ("v_n", "v_e")
"""What a speed and a course over ground are compared as."""


def _with_velocity(
    observations: Sequence[Observation], named: Mapping[str, ChannelTable], model: Model, file: StudyFile
) -> list[Observation]:
    """The observations, with a velocity north and east in the place of a speed and a course over ground.

    A receiver measures the velocity, with the same noise in all directions. Its course has noise that grows as the
    vehicle slows, and turns half round where it stops: no fit follows it there. They stay as they are where the study
    states a noise for the course, or marks courses as not valid.
    """
    speeds, courses = ([one for one in observations if one.measured == what] for what in ("sog", "cog"))
    taken = {*named, *(channel.name for channel in model.outputs)}
    if len(speeds) != 1 or len(courses) != 1 or speeds[0].at != courses[0].at or taken & {*VELOCITY}:
        return list(observations)
    course, tables = courses[0].channel, (file.channels, *(entry.channels for entry in file.trials))
    marked = any(one[course].invalid_where is not None for one in tables if course in one)
    pair = {speeds[0].channel, course}
    if marked or course in file.noise or any(pair & {*entry.without} for entry in file.trials):
        return list(observations)
    kept = [one for one in observations if one.channel not in pair]
    return [*kept, *(Observation(name, None, speeds[0].at) for name in VELOCITY)]


def speed_and_course(model: Model, file: StudyFile) -> tuple[Channel, ...]:
    """The channels of a speed and a course over ground that are compared as a velocity; none where there are none."""
    named = _named(file)
    if not {*VELOCITY} <= {one.channel for one in _observations_of(model)} - {*named}:
        return ()
    names = {table.measures or name: name for name, table in named.items() if not table.extra}
    measures = [MEASURES[what] for what in ("sog", "cog")]
    return tuple(Channel(names[one.name], one.unit, one.title, one.angle) for one in measures)


def noise_of_velocity(
    stated: Mapping[str, float | Literal["estimate"]], pair: Sequence[Channel]
) -> dict[str, float | Literal["estimate"]]:
    """The noise by output, that of a speed over ground being the noise of the velocity, alike in all directions.

    `pair` are the speed and the course that are compared as a velocity. What is stated of the velocity itself goes
    first.
    """
    if not pair or pair[0].name not in stated:
        return dict(stated)
    both = dict.fromkeys(VELOCITY, stated[pair[0].name])
    return {**both, **{name: value for name, value in stated.items() if name != pair[0].name}}


def without_velocity(model: Model, file: StudyFile) -> dict[str, str]:
    """Why there is no velocity over ground that a noise is stated for, where speed and course stay as they are."""
    named = _named(file)
    course = next((name for name, table in named.items() if (table.measures or name) == "cog"), None)
    if course is None or course not in file.noise or {*VELOCITY} & {channel.name for channel in model.outputs}:
        return {}
    do = (
        f"A noise of {course!r} keeps speed and course as they are: remove it, and v_n and v_e take their place, with "
        "the noise of the speed where one is stated."
    )
    return dict.fromkeys(VELOCITY, do)


def with_velocity(trial: Trial, names: Sequence[str]) -> Trial:
    """The trial with the velocity over ground, north and east, of a speed and a course (by their names).

    Example:
        >>> import numpy as np
        >>> run = Trial("run", [0.0, 1.0], {}, {"sog": [2.0, 2.0], "cog": [0.0, np.pi / 2]})
        >>> with_velocity(run, ("sog", "cog")).outputs["v_e"].round(6).tolist()
        [0.0, 2.0]
    """
    speed, course = (np.asarray(trial.outputs[name]) for name in names)
    found = dict(zip(VELOCITY, (speed * np.cos(course), speed * np.sin(course))))
    said = f"{' and '.join(VELOCITY)} from {' and '.join(names)}: their noise does not grow as the vehicle slows"
    step = Step("ground_velocity", {"channels": list(names)}, said)
    return dataclasses.replace(trial, outputs={**trial.outputs, **found}, steps=(*trial.steps, step))


def _is_observation(name: str, table: ChannelTable, inputs: set[str], outputs: set[str]) -> bool:
    """Whether a channel is compared with something that the model gets for it."""
    if table.extra:
        return False
    if table.measures is not None or table.at is not None:
        return True
    return name not in inputs | outputs and name in MEASURES and MEASURES[name].by_name and name not in _GROUND


_GROUND = frozenset(("u", "v", "w", "x", "y", "z"))
"""Standard channels that a log may hold for the checks alone, where the model has no such output."""


def _place(table: ChannelTable) -> Any:
    return tuple(table.at) if table.at is not None else (0.0, 0.0, 0.0)


def observable(model: Model, *, accelerates: bool = False) -> list[Channel]:
    """Channels beside its outputs that a model can show and whose names say what they measure.

    Accelerometers are apart: they show vibration and tilt that no model has, so a user should ask for them.
    """
    outputs = {channel.name for channel in model.outputs}
    found = []
    for name, measure in MEASURES.items():
        if measure.by_name and measure.accelerates == accelerates and name not in outputs | _GROUND:
            try:
                observed(model, [Observation(name)])
            except BadInput:
                continue
            found.append(Channel(name, measure.unit, measure.title, measure.angle))
    return found


def as_logged(model: Model, columns: Collection[str]) -> Model:
    """The model with the outputs of a log that has columns for these channels."""
    seen = [Observation(channel.name) for channel in observable(model) if channel.name in columns]
    return observed(model, seen, keep=tuple(columns))


def check_initial_state(model: Model, file: StudyFile, problems: Problems) -> None:
    """A speed through the water gives no state over ground where a current acts: a fixed start would be wrong."""
    if not isinstance(model, ExtendedModel) or OPTIONS[file.cost.kind] is not TrajectoryOptions:
        return
    currents = [effect.name for effect in model.effects if effect.current is not None]
    observations = _observations_of(model)
    kept = {channel.name for channel in model.outputs}
    through = [one.channel for one in observations if one.measure.in_water and one.measure.needs[0] not in kept]
    over_ground = {"sog", "v_n"} & {one.measured for one in observations}
    if currents and through and not over_ground and file.cost.initial == "fixed":
        problems.add(
            ("cost", "initial"),
            f"the initial state cannot be fixed: {through[0]!r} is measured through the water, and {currents[0]!r} "
            "makes it differ from the state, which is over ground",
            'Set initial = "free" in [cost].',
        )


def turned_with_heading(trial: Trial, model: Model, others: Collection[str] = ()) -> Trial:
    """The trial with courses over ground, and `others`, within half a turn of the heading, as steps on record.

    A compass shows 0 to 360 degrees: the heading that courses follow is unwrapped before, where it jumps.
    """
    observed_as = {one.channel: one.measured for one in _observations_of(model)}
    courses = [name for name in trial.outputs if observed_as.get(name) == "cog" or name in others]
    if not courses:
        return trial
    wrapped = "psi" in trial.outputs and jumps_by_a_turn(trial, "psi")
    steps = [("unwrap", {"channels": ["psi"]}), ("follow_heading", {"channels": courses})]
    return apply_steps(trial, steps if wrapped else steps[1:])


def plain_outputs(model: Model) -> tuple[Channel, ...]:
    """Outputs of the model without its effects, servos, holds and observations."""
    while isinstance(model, (*_AROUND, ObservedModel, ObservedBlackBox)):
        model = model.base
    return model.outputs


def _observations_of(model: Model) -> tuple[Observation, ...]:
    """Observations of the model under its effects, servos and holds."""
    while isinstance(model, _AROUND):
        model = model.base
    return model.observations if isinstance(model, (ObservedModel, ObservedBlackBox)) else ()
