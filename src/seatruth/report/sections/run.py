"""Sections about the run: summary, search, discretisation, data steps, findings, provenance."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from seatruth.report import figures
from seatruth.report.blocks import Block, Column, Notes, Pictures, Section, Table, Text, table
from seatruth.report.numbers import listed, number, seconds
from seatruth.report.readings import estimated, in_order, pooled
from seatruth.report.sections.pictures import Album
from seatruth.report.text.identification import ending, fit_in_words
from seatruth.report.text.worries import worries
from seatruth.report.view import View, finite
from seatruth.uncertainty.identifiability import verdicts_in_words

_SHORT = 16
"""Letters of each value up to which a group of them stands in one row."""
_LONGEST = 400
"""Letters of a value in the provenance."""


def summary(data: View, album: Album) -> Section:
    """How it ended, how well it fits, what is known, what to look at first."""
    texts = [ending(data), fit_in_words(data), verdicts_in_words(dict(data.parameters.get("verdict", {})))]
    blocks: list[Block] = [Text(" ".join(text for text in texts if text))]
    look = worries(data)
    if look:
        blocks.append(Text("What to look at first:"))
        blocks.append(Notes([(worry.text, worry.section, worry.grave) for worry in look]))
    else:
        blocks.append(Text("Nothing stands out that you should worry about."))
    by_channel = _by_channel(data)
    if by_channel is not None:
        blocks.append(by_channel)
    return Section("summary", "In short", blocks)


def _by_channel(data: View) -> Table | None:
    """Each channel over all trials: the fit, and the prediction of trials held out."""
    rows = []
    for name in dict.fromkeys(data.fit["channel"]):
        channel = data.channel(str(name))
        fitted, held = (part[part["channel"] == name] for part in (data.fitted, data.held_out))
        sizes = [number(pooled(fitted, key) * channel.factor, 3) for key in ("rmse", "noise", "rmse_start")]
        ratios = [number(pooled(part, "ratio"), 3) for part in (fitted, held)]
        rows.append([channel.name, channel.unit, sizes[0], sizes[1], *ratios, sizes[2]])
    if not any(row[2] for row in rows):
        return None
    columns = [
        Column("channel"),
        Column("unit"),
        Column("RMSE", "number", "root mean square of the residuals over all trials that were fitted to"),
        Column("noise", "number", "standard deviation"),
        Column("RMSE / noise", "number"),
        Column("the same, held out", "number", "of trials that took no part in the fit"),
        Column("RMSE before", "number", "with the starting values"),
    ]
    return table("Fit by channel, all trials together", columns, rows)


def search(data: View, album: Album) -> Section | None:
    """How the optimizer got there."""
    outcome = data.outcome
    optimizer = getattr(data.estimate, "optimizer", None) or {}
    rows = [["ended", str(outcome.get("code", ""))], ["why", str(outcome.get("reason", ""))]]
    counts = {"evaluations": "evaluations", "diverged": "diverged", "clipped": "moved inside the bounds"}
    rows += [[words, f"{int(outcome[key])}"] for key, words in counts.items() if finite(outcome.get(key))]
    rows.append(["time", seconds(outcome.get("wall_s"))])
    rows += [["cost reached", number(outcome[key], 6)] for key in ("value", "best") if finite(outcome.get(key))]
    rows += [["note", str(note)] for note in outcome.get("notes", None) or []]
    seed = getattr(data.estimate, "seed", None)
    rows += [["seed", "" if seed is None else str(seed)]]
    cost = getattr(data.estimate, "cost", None) or {}
    rows += _flat({"optimizer": optimizer, "cost": {key: value for key, value in cost.items() if key != "noise"}})
    own = sorted(estimated(data))
    stated = [str(name) for name in cost.get("noise") or {} if name not in own]
    rows += [["noise stated of", listed(stated, 20)], ["noise estimated from the residuals of", listed(own, 20)]]
    rows = [row for row in rows if row[1]]
    blocks: list[Block] = [table("How it ended", [Column("what"), Column("is", "long")], rows)] if rows else []
    if len(data.history) > 1:
        best = data.history["best"]
        picture = album.picture(
            figures.history(data),
            f"Best cost over the evaluations, from {number(best.iloc[0])} down to {number(best.iloc[-1])}.",
            "The best cost found so far. A curve that still falls at its end belongs to a search that was cut short.",
        )
        blocks.append(Pictures([picture]))
    return Section("search", "Search", blocks) if blocks else None


def discretisation(data: View, album: Album) -> Section | None:
    """What the time step costs."""
    rows = [
        [
            channel.name,
            channel.unit,
            number(row["error"] * channel.factor, 2),
            number(row["noise"] * channel.factor, 2),
            number(row["ratio"], 2),
        ]
        for name, row in data.discretisation.iterrows()
        for channel in (data.channel(str(name)),)
        if finite(row["error"])
    ]
    if not rows or data.is_table:
        return None
    columns = [
        Column("channel"),
        Column("unit"),
        Column("error", "number", "rms difference against half the step"),
        Column("noise", "number"),
        Column("error / noise", "number"),
    ]
    text = "Root mean square change of the simulated outputs when the step is halved: to be far below the noise."
    return Section(
        "discretisation", "Error of the time step", [Text(text), table("Error of the time step", columns, rows)]
    )


def steps(data: View, album: Album) -> Section | None:
    """What was done to the data."""
    found = getattr(data.estimate, "steps", None) or []
    rows = []
    for trial, step in found:
        read: Any = step.get if isinstance(step, Mapping) else lambda key, s=step: getattr(s, key, None)
        options = ", ".join(f"{key} = {_short(value)}" for key, value in dict(read("options") or {}).items())
        rows.append([str(trial), str(read("name") or ""), options, str(read("effect") or "")])
    if not rows:
        return None
    columns = [Column("trial"), Column("step"), Column("options", "long"), Column("what it did", "long")]
    text = "Everything that was done to the recorded data before the fit, in this order. Nothing else was changed."
    return Section("steps", "Steps on the data", [Text(text), table("Steps on record", columns, rows)])


def findings(data: View, album: Album) -> Section | None:
    """What the checks of the data and of the result found."""
    return of_findings(getattr(data.estimate, "findings", None) or [])


def of_findings(given: Sequence[Any]) -> Section | None:
    """The section of some findings, the gravest first."""
    found = in_order(given)
    if not found:
        return None
    keys = ("severity", "where", "channel", "message", "do")
    columns = [
        Column("gravity", "verdict"),
        Column("where"),
        Column("channel"),
        Column("what", "long"),
        Column("what to do", "long"),
    ]
    rows = [[finding[key] for key in keys] for finding in found]
    return Section("findings", "Findings", [table(f"Findings ({len(rows)})", columns, rows)])


def provenance(data: View, album: Album) -> Section | None:
    """What made this result."""
    return of_provenance(getattr(data.estimate, "provenance", None) or {})


def of_provenance(given: Mapping[str, Any]) -> Section | None:
    """The section of a provenance."""
    rows = _flat(given)
    if not rows:
        return None
    built: Table = table("What made this result", [Column("what"), Column("is", "long")], rows)
    return Section("provenance", "Provenance", [built])


def provenance_rows(values: Mapping[str, Any]) -> list[list[str]]:
    """What and what it is, for a table of provenance."""
    return _flat(values)


def _flat(values: Mapping[str, Any], path: tuple[str, ...] = ()) -> list[list[str]]:
    return list(_walk(values, path))


def _walk(values: Mapping[str, Any], path: tuple[str, ...]) -> Iterator[list[str]]:
    for key, value in values.items():
        here = (*path, str(key))
        if isinstance(value, Mapping):
            if all(isinstance(part, (str, int)) and len(str(part)) <= _SHORT for part in value.values()):
                value = ", ".join(f"{name} {_short(part)}" for name, part in value.items())
                yield [_path(here), value]
            else:
                yield from _walk(value, here)
        elif isinstance(value, (list, tuple)) and any(isinstance(part, Mapping) for part in value):
            yield from _walk({f"{key.removesuffix('s')} {k}": part for k, part in enumerate(value, 1)}, path)
        elif value not in (None, "", [], ()):
            yield [_path(here), _short(value)]


def _path(keys: tuple[str, ...]) -> str:
    """ "file sha256: zigzag_10.csv": words with blanks, file names as they are."""
    return ": ".join(key if "." in key else key.replace("_", " ") for key in keys)


def _short(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:g}"
    if isinstance(value, Sequence) and not isinstance(value, (str, bytes)):
        text = ", ".join(_short(item) for item in value)
    else:
        text = str(value)
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 1]}…"
