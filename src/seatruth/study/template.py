"""A first study file for a log: every guess written down with its reason, ready to be corrected."""

from __future__ import annotations

import json
from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from seatruth.errors import BadInput
from seatruth.models import FMU, MEASURES, Model
from seatruth.readers import Log, Table
from seatruth.study.column_names import MAGNETIC
from seatruth.study.described_inputs import described_inputs
from seatruth.study.fields import Fields
from seatruth.study.infer_columns import FROM_HEADER, VAGUE, InferredColumn, infer_columns, split_header
from seatruth.study.numbered_columns import numbered_columns, pulse_columns
from seatruth.study.observations import as_logged, observable
from seatruth.study.pressure_columns import Pressures, pressure_of_depth
from seatruth.study.proposals import UTM, accelerometers, named_drives, utm_positions, utm_zone
from seatruth.study.template_courses import between_samples, wrapped_angles
from seatruth.study.template_parameters import one_line as _one_line
from seatruth.study.template_parameters import parameter_lines
from seatruth.study.template_simulator import recordable, simulator_lines, with_names
from seatruth.study.template_size import too_fast_for_its_length
from seatruth.study.time_columns import dated_column
from seatruth.trials import STANDARD_CHANNELS, Channel, Clock
from seatruth.trials.time_axis import time_axis
from seatruth.units import PULSES

_EXTRA = ("x", "y", "psi", "phi", "theta", "u", "v", "w", "p", "q", "r", "depth")
"""Standard channels that are worth reading for the checks even if the model does not compare them."""
_FIX = ("latitude", "longitude")
"""Channels from which reading makes x and y."""
_SHOWN = 40
"""Columns without a channel that are listed; a flight log has hundreds. Chosen here [S]."""


def template(
    path: str,
    log: Log,
    model: Model,
    use: str,
    more: Sequence[str] = (),
    *,
    name: str | None = None,
    pattern: str | None = None,
    others: Iterable[Log] = (),
) -> tuple[str, list[str]]:
    """The text of a study file for a log, and what could not be guessed, in sentences.

    `path` is the log's path as the study file will name it, `use` the model as the study file will name it, `more` the
    paths of further logs with the same columns, `name` that of the study (by default the log's), `pattern` one that
    takes all these logs and no other, `others` the contents of the further logs, where angles may jump.
    """
    fields = Fields(log)
    model, own_names = with_names(model, fields)
    required = {channel.name for channel in (*model.inputs, *model.outputs)}
    extra = [STANDARD_CHANNELS[name] for name in _EXTRA if name not in required]
    extra += [STANDARD_CHANNELS[name] for name in _FIX if {"x", "y"} <= required]
    clocks = all(table.time is not None for table in log.tables.values())
    wanted = [*recordable(model), *model.outputs, *observable(model), *extra]
    utm = utm_positions(fields) if {"x", "y"} <= required else {}
    wanted = [channel for channel in wanted if not utm or channel.name not in ("x", "y")]
    numbered = numbered_columns(fields, recordable(model))
    guesses = numbered | infer_columns(
        fields,
        [*([] if clocks else [Channel("t", "s")]), *(c for c in wanted if c.name not in numbered)],
        orders=[channel.name for channel in model.inputs],
        thrusters=named_drives(model),
    )
    twice = sorted({"sog", "cog"} & {*guesses}) if {"v_n", "v_e"} <= {*guesses} else []
    also = [guesses.pop(name) for name in twice]  # the same velocity of the same receiver would count twice
    used = {column for hit in guesses.values() for column in hit.columns}
    described = described_inputs(fields, [c for c in recordable(model) if c.name not in guesses], model, used)
    guesses |= described.found
    used |= {column for hit in described.found.values() for column in hit.columns}
    pulses = [channel for channel in recordable(model) if channel.unit in PULSES]
    if not {channel.name for channel in pulses} & guesses.keys():
        guesses |= pulse_columns({title: fields[title] for title in fields if title not in used}, pulses)
    if "z" in required and "z" not in guesses and "depth" in guesses:
        guesses["z"] = replace(guesses.pop("depth"), channel="z")  # z counts down
    pressures = Pressures(None, ())
    if "z" in required and "z" not in guesses:
        pressures = pressure_of_depth(fields, "z")
        guesses |= {} if pressures.found is None else {"z": pressures.found}
    if "t" not in guesses and not clocks and (dated := dated_column(fields)) is not None:
        guesses["t"] = dated
    measured = accelerometers(fields, model)
    model = as_logged(model, guesses)
    needed = [*model.inputs, *model.outputs]
    missing_inputs = [c for c in model.inputs if c.name not in guesses]
    of_simulator = simulator_lines(model, missing_inputs, own_names)
    if isinstance(model, FMU) and len(missing_inputs) < len(model.inputs):
        needed = [c for c in needed if c not in missing_inputs]
        missing_inputs = []  # they keep their start values
    fixes = all(name in guesses for name in _FIX) and not {"x", "y"} & guesses.keys()
    guesses = {name: hit for name, hit in guesses.items() if fixes or name not in _FIX}
    if utm and not fixes:
        guesses |= utm
        extra += [STANDARD_CHANNELS[name] for name in UTM]
    given = {*guesses, *(("x", "y") if fixes or utm else ())}
    missing_outputs = [c for c in model.outputs if c.name not in given]
    notes = list(log.notes)
    if also:
        columns = " and ".join(repr(fields.name(hit.column)) for hit in also)
        notes.append(f"{columns} say what v_n and v_e do, and are left out.")
    if "t" not in guesses and not clocks:
        notes.append("No time column was recognised: name it in [time].")
    if missing_inputs:
        notes.append(
            f"No column was recognised for the input {_list(missing_inputs)}: name it in [channels], or give it a "
            "value, as { value = 0.0 }."
        )
    notes += described.notes(missing_inputs)
    if len(missing_outputs) == len(model.outputs):
        notes.append("No column was recognised for any output of the model: name them in [channels].")
        missing_outputs = []
    elif missing_outputs:
        notes.append(
            f"No column was recognised for the output {_list(missing_outputs)}: if the log has it, name it in "
            "[channels] and take it out of `without` in [[trials]]."
        )
    notes += [*pressures.notes("z", fields), *_vague(guesses), *_several_shafts(guesses, fields)]
    notes += [] if ":" in use else too_fast_for_its_length(model, fields, guesses)
    zone = utm_zone(log)
    if "easting" in guesses and zone is None:
        notes.append('The zone of northing and easting is not known: state it in [frames], as utm = "32 north".')
    held, joined = between_samples(fields, guesses, model)
    text = "\n".join(
        [
            *_head(path if pattern is None else pattern, log.notes, model, use, name or Path(path).stem),
            *of_simulator,
            *parameter_lines(model, own=":" in use),
            *(_OWN_CLOCKS if clocks else _time(guesses.get("t"), fields, notes)),
            *_channels(guesses, needed, extra, missing_inputs, fields, joined),
            *_accelerometers(measured, fields),
            *_left(fields, {c for hit in (*guesses.values(), *measured.values()) for c in hit.columns}, model, given),
            "",
            *(_frames(zone) if "easting" in guesses else []),
            *_actuators([channel.name for channel in model.inputs], guesses),
            *_trials([path, *more] if pattern is None else [pattern], missing_outputs),
            *_steps(wrapped_angles(fields, guesses, [*model.inputs, *model.outputs], others if more else None)),
            *_rest(model, bool(held)),
        ]
    )
    return text, notes


def _vague(guesses: Mapping[str, InferredColumn]) -> list[str]:
    """What was taken for speeds whose columns do not say what they measure."""
    return [
        f"The column {hit.column!r} was taken for {name!r}, the speed over ground along the bow. If a log measured it "
        "through the water, call the channel u_w; if satellites did, call it sog (docs/channels.md)."
        for name, hit in guesses.items()
        if name == "u" and split_header(hit.column)[0] in VAGUE
    ]


def _several_shafts(guesses: Mapping[str, InferredColumn], fields: Fields) -> list[str]:
    """What a model with one propeller makes of a vehicle with several."""
    hit = guesses.get("n")
    if hit is None or not hit.others:
        return []
    shafts = ", ".join(map(fields.name, hit.columns))
    return [
        f"The model has one shaft and the log {len(hit.columns)} ({shafts}): 'n' is their mean. Where they differ, "
        "they turn the vehicle, which this model does not know; one with an input for each does."
    ]


_OWN_CLOCKS = [
    "# Each topic of the log has its own clock, which is used. Another field of the topics can take its place:",
    "# [time]",
    '# column = "header.stamp"',
    "",
]


def _head(log: str, notes: Sequence[str], model: Model, use: str, name: str) -> list[str]:
    sets = list(getattr(model, "sets", ()))
    return [
        f"# Study of {_one_line(log)}, written by `seatruth init`. Check every guess; the key reference is in",
        "# docs/study-file.md. Then: seatruth check THIS.toml, and seatruth identify THIS.toml",
        *(f"# Of the log: {_one_line(note)}" for note in notes),
        "",
        "[study]",
        f"name = {_text(name)}",
        "seed = 1                      # the same seed gives the same result",
        "",
        "[model]",
        f"use = {_text(use)}   # {_one_line(model.title) or 'the model'}",
        *([f"set = {_text(sets[0])}   # parameter set; there are: {', '.join(sets)}"] if sets else []),
    ]


def _time(guessed: InferredColumn | None, fields: Fields, notes: list[str]) -> list[str]:
    """The table of the time: what it is read as, or why it cannot be read yet, which goes to the notes."""
    if guessed is None:
        return ["[time]", f'column = "t"   # not recognised; the columns are: {_columns(fields)}', ""]
    name, content, column = fields.places[guessed.column]
    lines = ["[time]", f"column = {_text(name)}"]
    units = {column: content.units[column]} if column in content.units else {}
    if not units and guessed.why == FROM_HEADER:
        units = {column: guessed.unit}  # as its name says, "time_ms"
    table = Table("the log", {column: content.columns[column]}, units)
    try:
        axis = time_axis(table, Clock(column))
    except BadInput as problem:
        notes.append(f"Time: {problem.what.removeprefix('time: ')}. {problem.do}")
        if guessed.unit == "s":
            return [*lines, f"# {_one_line(problem.what)}. {_one_line(problem.do)}", ""]
        return [*lines, f"unit = {_text(guessed.unit)}   # guessed: {_one_line(problem.what)}", ""]
    said = _one_line("; ".join(axis.notes or [f"from {start} on" for start in axis.about.values()]))
    why = said or (FROM_HEADER if units else "assumed; the header has no unit")
    return [*lines, f"unit = {_text(axis.unit)}   # {why}", ""]


def _channels(
    guesses: dict[str, InferredColumn],
    needed: Sequence[Channel],
    extra: Sequence[Channel],
    missing_inputs: Sequence[Channel],
    fields: Fields,
    joined: Container[str],
) -> list[str]:
    lines = [
        "# Column and unit of each channel in the file. sign = -1 turns a channel round: psi clockwise, y and v to",
        '# starboard, z down, rudder positive for a turn to starboard. invalid_where = "flag == 1" drops samples.',
        "[channels]",
    ]
    for channel in (*needed, *extra):
        hit = guesses.get(channel.name)
        if hit is not None:
            keys = f"unit = {_text(hit.unit)}{hit.turned and ', '}{hit.turned}"
            keys += ', hold = "foh"' if channel.name in joined else ""
            entry = f"{{ {_source(fields, hit)}, {keys} }}"
            measured = MEASURES[channel.name].title if channel.name in MEASURES else channel.description
            used = f"{hit.why}; {measured}" if channel in needed and measured else hit.why
            if channel.name in (*_FIX, *UTM):
                used = "x and y, from the first fix on"
                used += "; at = [forward, starboard, down] is the antenna's place" if channel.name == _FIX[0] else ""
            elif channel not in needed:
                used = f"{hit.why}; for the checks only"
            if channel.name == "psi" and split_header(hit.column)[0] in MAGNETIC:
                used += '; magnetic: add declination = "3.5 deg", yours, east positive'
            if channel.name in joined:
                used += '; measured, as it does not step: if it is an order, take hold = "foh" away'
            lines.append(f"{channel.name} = {entry}   # {_one_line(used)}")
        elif channel in missing_inputs:
            lines.append(
                f'# {channel.name} = {{ column = "?", unit = {_text(channel.unit)} }}   # needed; not recognised'
            )
    return lines


def _source(fields: Fields, hit: InferredColumn) -> str:
    """The column of a channel, or those whose mean it is, as its entry has them."""
    names = [_text(fields.name(column)) for column in hit.columns]
    return f"mean = [{', '.join(names)}]" if hit.others else f"column = {names[0]}"


def _left(fields: Fields, used: set[str], model: Model, given: Container[str]) -> list[str]:
    """What no channel takes, so that nothing is dropped silently. Speed through the water may be the model's speed."""
    rest = [title for title in fields if title not in used]
    lines = []
    if any(channel.name == "u" for channel in model.outputs) and "u" not in given:
        through = infer_columns({title: fields[title] for title in rest}, [STANDARD_CHANNELS["u_w"]])
        lines += [
            f"# u = {{ column = {_text(fields.name(hit.column))}, unit = {_text(hit.unit)} }}   # speed through the "
            "water: take the # away if the water was at rest, or if u is that of the model"
            for hit in through.values()
        ]
    inputs = [channel.name for channel in model.inputs]
    ordered = infer_columns(
        {title: fields[title] for title in rest}, model.inputs, orders=inputs, thrusters=named_drives(model)
    )
    lines += [
        f"# {_one_line(' and '.join(map(fields.name, hit.columns)))}: what {name} was ordered to; the model takes what "
        "acted."
        for name, hit in ordered.items()
        if hit.order
    ]
    if rest:
        names = [fields.name(title) for title in rest]
        more = f", and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
        lines.append(f"# No channel takes these columns: {_one_line(', '.join(names[:_SHOWN]))}{more}.")
    return lines


def _accelerometers(found: Mapping[str, InferredColumn], fields: Fields) -> list[str]:
    """Proposals that the user takes over by hand: where a sensor sits decides what it shows."""
    if not found:
        return []
    return [
        "# Accelerometers: state where each sits (m forward, starboard, down of the model's origin); take the # away.",
        *(
            f"# {name} = {{ column = {_text(fields.name(hit.column))}, unit = {_text(hit.unit)}, at = [0, 0, 0] }}"
            for name, hit in found.items()
        ),
    ]


def _frames(zone: str | None) -> list[str]:
    if zone is None:
        return [
            "# [frames]",
            '# utm = "32 north"   # zone of northing and easting; needed, as the log does not say',
            "",
        ]
    return ["[frames]", f"utm = {_text(zone)}   # zone of northing and easting, from the log", ""]


def _actuators(inputs: Sequence[str], guesses: Mapping[str, InferredColumn]) -> list[str]:
    """Which inputs the log holds as orders."""
    ordered = [name for name in inputs if name in guesses and guesses[name].order]
    lines = ["# Inputs that the log holds as ordered, not as they acted; state what is known of the servo between, as"]
    lines.append('# { record = "order", rate_limit = "2.3 deg/s", lag = "0.5 s" }.')
    if not ordered:
        lines[1] += " Take the # of both lines away."
        return [*lines, "# [actuators]", f'# {next(iter(inputs), "delta")} = "order"', ""] if inputs else []
    return [*lines, "[actuators]", *(f'{name} = "order"   # as its column says' for name in ordered), ""]


def _trials(logs: Sequence[str], missing: Sequence[Channel]) -> list[str]:
    names = ", ".join(_text(channel.name) for channel in missing)
    lines: list[str] = []
    for log in logs:
        about = "" if lines else "   # a pattern (runs/*.csv) takes many files"
        lines += ["", "[[trials]]"] if lines else ["[[trials]]"]
        lines.append(f"file = {_text(log)}{about}")
        if missing:
            about = "   # outputs of the model that no column was recognised for" if log == logs[0] else ""
            lines.append(f"without = [{names}]{about}")
    return [
        *lines,
        "",
        "# A run that is only predicted, never fitted:",
        "# [[trials]]",
        '# file = "another.csv"',
        '# role = "holdout"',
        "",
    ]


def _steps(wrapped: Sequence[str]) -> list[str]:
    lines = ["# Preparation steps run in this order; each is on record in the result (docs/study-file.md)."]
    if wrapped:
        names = ", ".join(_text(name) for name in wrapped)
        lines += ["[[prepare]]", 'step = "unwrap"', f"channels = [{names}]   # may jump by a full turn", ""]
    return [*lines, "# [[prepare]]", '# step = "hampel"             # removes outliers', ""]


def _rest(model: Model, orders: bool) -> list[str]:
    first = model.outputs[0]
    hold = ['hold = "zoh"                  # orders step when they are given; "foh" joins samples by lines']
    return [
        "[noise]",
        f'# Standard deviation of each output, as {first.name} = "0.01 {first.unit}"; the default is "estimate".',
        "",
        "[cost]",
        'kind = "trajectory"           # simulate the whole run and compare; or "regression"',
        *(hold if orders else []),
        'initial = "free"              # initial states are estimated too; "fixed" takes the first samples',
        "",
        "[optimizer]",
        'use = "least_squares"         # see: seatruth list optimizers',
        "",
        "[budget]",
        "evaluations = 20000",
        "",
    ]


def _columns(fields: Fields) -> str:
    return _one_line(", ".join(fields.name(title) for title in fields)[:200])


def _list(channels: Sequence[Channel]) -> str:
    return ", ".join(repr(channel.name) for channel in channels)


def _text(value: str) -> str:
    """A TOML string. JSON's escapes are TOML's, but for characters beyond the basic plane, which stay as they are."""
    if any(ord(character) == 127 for character in value):
        raise BadInput(f"the name {value!r} holds a control character", do="Rename the file or the column.")
    return json.dumps(value, ensure_ascii=False)
