"""The trials that a study file names: which files, which columns, which steps."""

from __future__ import annotations

import dataclasses
import fnmatch
import os
from collections.abc import Mapping, Sequence, Set
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import ValidationError

from seatruth.errors import BadInput, nearest
from seatruth.models.base import Model
from seatruth.progress import Progress, silent
from seatruth.study.file_patterns import MOST_FILES, is_pattern, matching_files
from seatruth.study.observations import VELOCITY, plain_outputs, speed_and_course, turned_with_heading, with_velocity
from seatruth.study.quantity import number
from seatruth.study.schema import StudyFile
from seatruth.study.schema_trials import ChannelTable, PrepareTable, TimeTable, TrialTable
from seatruth.study.shared_problems import SharedProblems, check_units
from seatruth.study.validation import Problems, add_schema_errors
from seatruth.trials import STANDARD_CHANNELS, Clock, ColumnSpec, Frames, Trial, Trials, read_trial
from seatruth.trials.frames import POSITIONS, with_origin
from seatruth.trials.split import split_at_gaps

ROS2_BAG = "metadata.yaml"
"""File in a folder that is a ROS 2 bag."""


class Recording(NamedTuple):
    """One file of the study: its trial's name, path, role, and where it stands in the study file."""

    name: str
    path: Path
    entry: int
    table: TrialTable


def recordings(file: StudyFile, folder: Path, problems: Problems) -> list[Recording]:
    """Every file that [[trials]] names, patterns expanded; names distinct."""
    recorded: list[Recording] = []
    if len(file.trials) > MOST_FILES:
        problems.add(("trials",), f"it has {len(file.trials)} trials, more than {MOST_FILES}", "Split the study.")
        return recorded
    for entry, table in enumerate(file.trials):
        files = paths(table, folder, ("trials", entry, "file"), problems)
        if table.name is not None and len(files) > 1:
            problems.add(
                ("trials", entry, "name"),
                f"{table.file!r} takes {len(files)} files, which cannot all be called {table.name!r}",
                "Remove `name`: each trial is then called after its file.",
            )
            continue
        recorded.extend(Recording(table.name or path.stem, path, entry, table) for path in files)
    first: dict[str, Recording] = {}
    for recording in recorded:
        other = first.setdefault(recording.name, recording)
        if other is not recording:
            same = " from the same file" if other.path == recording.path else ""
            problems.add(
                ("trials", recording.entry),
                f"two trials are called {recording.name!r}{same} ([trials] {other.entry + 1} is the other)",
                "Give each its own `name`.",
            )
    if not file.trials:
        problems.add((), "the study has no trials", "Add a [[trials]] table with file = ... for each recorded run.")
    return recorded


def read(
    file: StudyFile,
    model: Model,
    recordings: Sequence[Recording],
    problems: Problems,
    *,
    synthetic: bool,
    progress: Progress = silent,
) -> tuple[Trials, Trials]:
    """The trials that are fitted and those held out, read and prepared."""
    # Outputs for which an observation stands can still be named: they are in no trial.
    pair = speed_and_course(model, file)
    known = {channel.name: channel for channel in (*model.inputs, *model.outputs, *plain_outputs(model), *pair)}
    _check_channels(file, known, problems)
    check_units(file, known, problems)
    _check_values(file, {channel.name for channel in model.inputs}, problems)
    _check_steps(file, [recording.name for recording in recordings], problems)
    if problems:
        return Trials([]), Trials([])
    fitted: list[Trial] = []
    held: list[Trial] = []
    frames = Frames()
    with problems.at("frames"):
        frames = stated_frames(file)
    shared = SharedProblems(file, problems)
    for recording in recordings:
        with shared.of(recording.name, recording.entry):
            try:
                trial = _read_one(file, model, recording, frames, synthetic, progress)
            except BadInput as problem:
                unnamed = _not_in_channels(problem, file, model, recording)
                if unnamed is None:
                    raise
                problems.add(("channels",), *unnamed)  # once for all files that lack it
                continue
            trial = turned_with_heading(trial, model, [course.name for course in pair[1:]])
            trial = with_velocity(trial, [channel.name for channel in pair]) if pair else trial
            frames = with_origin(frames, trial)
            parts = split_at_gaps(trial) if recording.table.split_at_gaps else [trial]
            (fitted if recording.table.role == "fit" else held).extend(parts)
    shared.report()
    if recordings and not problems and not fitted:
        problems.add(("trials",), "every trial is held out, so there is nothing to fit", 'Give one role = "fit".')
    return Trials(fitted), Trials(held)


def _not_in_channels(problem: BadInput, file: StudyFile, model: Model, recording: Recording) -> tuple[str, str] | None:
    """What to say of a channel of the model that the study does not mention, where the file has no column of its name.

    None where the problem is another one.
    """
    for kind, channels in (("input", model.inputs), ("output", model.outputs)):
        for name in (
            channel.name for channel in channels if channel.name not in {*file.channels, *recording.table.channels}
        ):
            if problem.what == f"no column {name!r}":
                columns = problem.do.partition("Known: ")[2]
                other = "give it a `value`" if kind == "input" else "list it in `without` of [[trials]]"
                known = f" The columns are: {columns}" if columns else ""
                what = f"the {kind} {name!r} is not in [channels], and the file has no column of that name"
                return what, f"Name its column, or {other}.{known}"
    return None


def clock(time: TimeTable) -> Clock:
    """How the time of the logs is read."""
    return Clock(time.column, time.unit, time.dates, time.date, time.jumps)


def stated_frames(file: StudyFile) -> Frames:
    """The axes of the logs; BadInput for an origin or a zone that is none."""
    stated = file.frames
    origin = None if stated.origin is None else (stated.origin[0], stated.origin[1])
    return Frames(stated.earth, stated.body, origin, stated.utm)


def _read_one(
    file: StudyFile, model: Model, recording: Recording, frames: Frames, synthetic: bool, progress: Progress
) -> Trial:
    table = recording.table
    maps = {**file.channels}
    for name, changes in table.channels.items():
        shared = maps.get(name, ChannelTable())
        stated = changes.model_dump(exclude_unset=True)
        # The trial's own column stands in place of a mean that all share.
        maps[name] = shared.model_copy(update={"mean": None, **stated} if "column" in stated else stated)
    time = file.time if table.time is None else _merged_time(file.time, table.time)
    inputs = {c.name: column_spec(c.name, maps) for c in model.inputs}
    pair = speed_and_course(model, file)
    made = VELOCITY if pair else ()
    wanted = [c.name for c in model.outputs if c.name not in table.without and c.name not in made]
    if any({first, other} <= maps.keys() for first, other in POSITIONS):
        wanted = [name for name in wanted if name in maps or name not in ("x", "y")]
    wanted += [name for name in maps if name not in inputs and name not in wanted and name not in table.without]
    trial = read_trial(
        recording.path,
        time=clock(time),
        inputs=inputs,
        outputs={name: column_spec(name, maps) for name in wanted},
        channels={c.name: c for c in (*model.inputs, *model.outputs, *pair)},
        name=recording.name,
        conditions=table.conditions,
        synthetic=synthetic,
        repeated_time=time.repeated,
        where=table.where,
        prepare=_steps(file, table, recording.name),
        frames=frames,
        hold=file.cost.hold,
        progress=progress,
        **file.files.reading,
    )
    return dataclasses.replace(trial, absent=tuple(table.without))


def column_spec(name: str, maps: Mapping[str, ChannelTable]) -> ColumnSpec:
    """The column of a channel; a channel that the study does not mention is a column of the same name."""
    table = maps.get(name, ChannelTable())
    q = table.quaternion
    return ColumnSpec(
        column=table.column or name,
        unit=table.unit,
        sign=float(table.sign),
        scale=table.scale,
        offset=table.offset,
        invalid_where=table.invalid_where,
        vector=None if table.vector is None else (table.vector[0], table.vector[1]),
        quaternion=None if q is None else (q[0], q[1], q[2], q[3]),
        mean=tuple(table.mean or ()),
        declination=number(table.declination, "rad"),
        time=table.time,
        value=table.value,
        hold=table.hold,
    )


def _merged_time(shared: TimeTable, changes: TimeTable) -> TimeTable:
    return shared.model_copy(update=changes.model_dump(exclude_unset=True))


def _steps(file: StudyFile, table: TrialTable, name: str) -> list[tuple[str, Mapping[str, Any]]]:
    """The steps of one trial in order: its own, then the shared ones that act on it."""
    shared = [step for step in file.prepare if step.trials is None or _takes(step.trials, name)]
    return [(step.step, step.options) for step in (*table.prepare, *shared)]


def _takes(patterns: Sequence[str], name: str) -> bool:
    return any(fnmatch.fnmatchcase(name, pattern) for pattern in patterns)


def paths(table: TrialTable, folder: Path, at: tuple[str | int, ...], problems: Problems) -> list[Path]:
    """The files that an entry takes; none where there is no such file, which is then a problem."""
    if "\0" in table.file or not table.file.strip():
        problems.add(at, "the file's name is empty or holds a null character", "Name the file.")
        return []
    path = folder / table.file
    try:
        if path.is_file() or (path / ROS2_BAG).is_file():
            return [path]
        if is_pattern(table.file):
            taken = matching_files(table.file, folder, ROS2_BAG)
            if not taken:
                problems.add(at, f"no file fits {table.file!r}", f"Paths are relative to {folder}.")
            return taken
        siblings = [entry.name for entry in path.parent.iterdir()] if path.parent.is_dir() else []
    except BadInput as problem:
        problems.add(at, problem.what, problem.do)
        return []
    except OSError as problem:
        problems.add(at, f"{table.file!r} cannot be looked for ({problem.strerror})", "Check the path.")
        return []
    if path.is_dir():
        problems.add(at, f"{table.file!r} is a folder", f'Name its files, as "{table.file.rstrip("/")}/*.csv".')
    elif os.path.lexists(path):
        problems.add(at, f"{table.file!r} is no plain file", "It is a device, a pipe, or a link that leads nowhere.")
    else:
        hint = nearest(path.name, siblings).split("Known:")[0].strip()
        problems.add(at, f"there is no file {table.file!r}", hint or f"Paths are relative to {folder.resolve()}.")
    return []


def _check_channels(file: StudyFile, known: Mapping[str, Any], problems: Problems) -> None:
    """Channels that neither the model, nor the standard list, nor `extra` knows are typing errors."""
    extra = {name for name, table in file.channels.items() if table.extra}
    allowed = {*known, *STANDARD_CHANNELS, *extra}
    for name in file.channels:
        if name == "t":
            problems.add(("channels", "t"), "time is not a channel", "Describe it in [time].")
        elif name not in allowed:
            hint = nearest(name, known) or nearest(name, allowed)
            problems.add(("channels", name), f"unknown channel {name!r}", f"{hint} `extra = true` allows others.")
    for entry, table in enumerate(file.trials):
        for name, changes in table.channels.items():
            if name not in allowed and not changes.extra:
                problems.add(("trials", entry, "channels", name), f"unknown channel {name!r}", nearest(name, known))
        for name in table.without:
            if name not in known:
                problems.add(("trials", entry, "without"), f"unknown channel {name!r}", nearest(name, known))


def _check_values(file: StudyFile, inputs: Set[str], problems: Problems) -> None:
    """A number that stands for a record: of an input, and without a column beside it."""
    stated: list[tuple[tuple[str | int, ...], str, ChannelTable]] = [
        (("channels", name), name, table) for name, table in file.channels.items()
    ]
    for entry, trial in enumerate(file.trials):
        stated += [(("trials", entry, "channels", name), name, table) for name, table in trial.channels.items()]
    for path, name, table in stated:
        if table.mean and (table.column or table.vector or table.quaternion or table.value is not None):
            problems.add((*path, "mean"), f"{name!r} has a mean and a column or a value", "Remove one of them.")
        if table.value is None:
            continue
        if name not in inputs:
            problems.add((*path, "value"), f"{name!r} is no input, and only inputs can be stated", "Name its column.")
        elif table.column or table.vector or table.quaternion or table.time:
            problems.add((*path, "value"), f"{name!r} has a value and a column", "Remove one of them.")


def _check_steps(file: StudyFile, names: Sequence[str], problems: Problems) -> None:
    """Steps that do not exist, and patterns that take no trial."""
    from seatruth.trials.prepare import STEPS

    def check(step: PrepareTable, path: tuple[str | int, ...]) -> None:
        if step.step not in STEPS:
            problems.add((*path, "step"), f"there is no preparation step {step.step!r}", nearest(step.step, STEPS))
            return
        options = STEPS[step.step].options
        try:
            options.model_validate(step.options)
        except ValidationError as error:
            add_schema_errors(problems, error, table=options, at=path)

    for position, step in enumerate(file.prepare):
        check(step, ("prepare", position))
        for pattern in step.trials or ():
            if names and not any(fnmatch.fnmatchcase(name, pattern) for name in names):
                problems.add(("prepare", position, "trials"), f"no trial fits {pattern!r}", nearest(pattern, names))
    for entry, table in enumerate(file.trials):
        for position, step in enumerate(table.prepare):
            check(step, ("trials", entry, "prepare", position))
            if step.trials is not None:
                problems.add(
                    ("trials", entry, "prepare", position, "trials"),
                    "a trial's own step acts on that trial alone",
                    "Remove `trials`, or move the step to [[prepare]].",
                )
