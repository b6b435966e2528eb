"""What the channels of a study file measure: the observations that the model gets as outputs."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from seatruth.costs.options import OPTIONS, TrajectoryOptions
from seatruth.effects import ExtendedBlackBox, ExtendedModel
from seatruth.errors import BadInput
from seatruth.models import MEASURES, Model, Observation, ServoBlackBox, WithServos, observed
from seatruth.models.observed import ObservedBlackBox, ObservedModel
from seatruth.study.schema import StudyFile
from seatruth.study.schema_trials import ChannelTable
from seatruth.study.validation import Problems
from seatruth.trials import Channel, Trial
from seatruth.trials.prepare import apply_steps

_AROUND = (ExtendedModel, ExtendedBlackBox, WithServos, ServoBlackBox)
"""Effects and servos around a model."""


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
    named = {name: table for entry in file.trials for name, table in entry.channels.items()} | dict(file.channels)
    for name, table in named.items():
        if _is_observation(name, table, inputs, outputs):
            with problems.at("channels", name):
                observations.append(Observation(name, table.measures, _place(table)))
                observed(model, observations[-1:])  # each channel's own fault has its own line
    if problems:
        return None
    with problems.at("channels"):
        return observed(model, observations, keep=tuple(named))
    return None


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


def turned_with_heading(trial: Trial, model: Model) -> Trial:
    """The trial with courses over ground within half a turn of the heading, as a step on record."""
    observed_as = {one.channel: one.measured for one in _observations_of(model)}
    courses = [name for name in trial.outputs if observed_as.get(name) == "cog"]
    return apply_steps(trial, [("follow_heading", {"channels": courses})]) if courses else trial


def plain_outputs(model: Model) -> tuple[Channel, ...]:
    """Outputs of the model without its effects, servos and observations."""
    while isinstance(model, (*_AROUND, ObservedModel, ObservedBlackBox)):
        model = model.base
    return model.outputs


def _observations_of(model: Model) -> tuple[Observation, ...]:
    """Observations of the model under its effects and servos."""
    while isinstance(model, _AROUND):
        model = model.base
    return model.observations if isinstance(model, (ObservedModel, ObservedBlackBox)) else ()
