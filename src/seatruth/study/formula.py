"""A study of a static formula: its parameters, its table."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from seatruth.errors import BadInput, nearest
from seatruth.expression import equation, names_in
from seatruth.models.formula import Formula
from seatruth.models.parameter import Parameter
from seatruth.progress import Progress, silent
from seatruth.readers import Table, read_log
from seatruth.readers.tables import as_text
from seatruth.study import parameters
from seatruth.study.schema import StudyFile
from seatruth.study.schema_trials import ChannelTable, TrialTable
from seatruth.study.trial_files import Recording, column_spec, paths
from seatruth.study.validation import Problems
from seatruth.trials import Channel, Trial, Trials
from seatruth.trials.read import trial_from_table

_MOST_TRIALS = 200
_ROW = "row of the table"
_NOT_HERE = {"trials": "[formula] file names the table", "prepare": "tables are not prepared", "time": "it has no time"}


class FormulaParts(NamedTuple):
    """What a formula study is made of."""

    model: Formula
    parameters: tuple[Parameter, ...]
    table: Recording


def parts(file: StudyFile, folder: Path, problems: Problems) -> FormulaParts | None:
    """The formula as a model, its parameters and its file; None where something is wrong with them."""
    assert file.formula is not None
    for key, why in _NOT_HERE.items():
        if key in file.model_fields_set:
            problems.add((key,), f"a formula study has no [{key}]: {why}", "Remove it.")
    entry = TrialTable(file=file.formula.file)
    files = paths(entry, folder, ("formula", "file"), problems)
    if len(files) > 1:
        problems.add(("formula", "file"), f"{file.formula.file!r} takes {len(files)} files", "Name one.")
    declared = parameters.free_of_model(file.parameters, problems)
    model = None
    with problems.at("formula", "expression"):
        output, right = equation(file.formula.expression)
        names = [parameter.name for parameter in declared]
        columns = [name for name in names_in(right) if name not in names]
        units = {name: table.unit for name, table in file.channels.items() if table.unit is not None}
        model = Formula(file.formula.expression, declared, columns, units=units)
        for name in file.channels:
            if name not in (*columns, output):
                hint = nearest(name, [*columns, output])
                problems.add(("channels", name), f"the formula has no column {name!r}", hint)
    if model is None or len(files) != 1:
        return None
    return FormulaParts(model, model.parameters, Recording(files[0].stem, files[0], 0, entry))


def read(file: StudyFile, made: FormulaParts, problems: Problems, progress: Progress = silent) -> Trials:
    """The table as a trial whose time counts the rows; numbers are taken in the units in which the file has them."""
    with problems.at("formula", "file"):
        table = read_log(made.table.path, progress=progress, **file.files.reading).table()
        with_rows = Table(
            table.source,
            {**table.columns, _ROW: pd.Series(range(len(table)), dtype="float64")},
            {**table.units, _ROW: "s"},
            table.lines,
            table.decimal,
        )
        channels = (*made.model.inputs, *made.model.outputs)
        for channel in channels:
            _require_column(channel.name, channel in made.model.inputs, file, table)
        trial = trial_from_table(
            with_rows,
            time=_ROW,
            inputs={channel.name: column_spec(channel.name, file.channels) for channel in made.model.inputs},
            outputs={channel.name: column_spec(channel.name, file.channels) for channel in made.model.outputs},
            channels={
                channel.name: _as_in_file(channel, file.channels.get(channel.name), table) for channel in channels
            },
            name=made.table.name,
            synthetic=file.study.synthetic,
        )
        if file.formula is not None and file.formula.trial is not None:
            return _by_condition(trial, file.formula.trial, table)
        return Trials([trial])
    return Trials([])


def _require_column(name: str, is_input: bool, file: StudyFile, table: Table) -> None:
    """BadInput where the table lacks a column of the formula, or where an input of it has gaps."""
    spec = column_spec(name, file.channels)
    try:
        values = table.numbers(spec.column)
    except BadInput as problem:
        if problem.what.startswith("no column"):
            hint = nearest(spec.column, list(table.columns))
            do = f"{hint} If it is a parameter, give it a value in [parameters]."
            raise BadInput(problem.what, where=table.source, do=do) from None
        raise
    gone = np.flatnonzero(np.isnan(values))
    if is_input and gone.size:
        where = f"{table.source}, {table.places(gone.tolist())}"
        raise BadInput(f"column {spec.column!r} has no value", where=where, do="Complete these rows or take them out.")


def _by_condition(trial: Trial, column: str, table: Table) -> Trials:
    """The rows with the same entry in a column as a trial each, in the order in which they come."""
    if column not in table.columns:
        raise BadInput(f"no column {column!r} to distinguish the trials", do=nearest(column, list(table.columns)))
    entries = as_text(table.columns[column], f"{table.source}, column {column!r}").fillna("").to_numpy()
    entries = entries[trial.t.astype(np.intp)]
    labels = list(dict.fromkeys(entries.tolist()))
    if len(labels) > _MOST_TRIALS:
        do = "Name a column with few different entries, or none."
        raise BadInput(f"column {column!r} has {len(labels)} different entries, a trial each", do=do)
    return Trials(
        [trial.samples(np.flatnonzero(entries == label), f"{column} {label or '(empty)'}") for label in labels]
    )


def _as_in_file(channel: Channel, stated: ChannelTable | None, table: Table) -> Channel:
    """The channel in the unit of the file, so that nothing is converted: a formula is written for its table."""
    column = (stated.column if stated is not None else None) or channel.name
    unit = (stated.unit if stated is not None else None) or table.unit(column)
    return Channel(channel.name, unit) if unit else channel
