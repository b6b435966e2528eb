"""Sections with the evidence for which effect causes the gap, and for what has no name."""

from __future__ import annotations

import math
from typing import Any

from seatruth.diagnosis.results import Diagnosis
from seatruth.report.blocks import Block, Column, Heading, Pictures, Section, Text, table
from seatruth.report.diagnosis import curves, words
from seatruth.report.numbers import count, estimate, interval, listed, number, shown
from seatruth.report.sections.pictures import Album

_ANY = 1e-3
"""Lambda below which an effect has no signature to speak of."""
_NEVER = 100.0
"""Multiple of the typical magnitude from which an effect counts as one that would never show."""
_SIZED = 8
"""Effects whose fitted parameters are listed."""
_LEGEND = (
    ("measured", "residual after refitting"),
    ("explained", "the part that the effects explain"),
    ("residual", "what remains; the band is twice the noise"),
)


def which(diagnosis: Diagnosis, album: Album) -> Section | None:
    """The ranked answers and the leading effects' parameters."""
    best = diagnosis.candidates[0]
    alt = f"Most probable answer: {words.in_titles(diagnosis, best['effects'])}, {words.chance(best['probability'])}."
    picture = album.picture(
        curves.answers(diagnosis),
        alt,
        "Probabilities of all answers add up to 1. Log evidence counts against each hypothesis what else it could have "
        "explained.",
    )
    rows = []
    for candidate in diagnosis.candidates[:20]:
        effects = words.in_titles(diagnosis, candidate["effects"])
        p = float(candidate["probability"])
        rows.append([effects, words.chance(p), number(candidate["log_evidence"], 4)])
    columns = [
        Column("answer", "long"),
        Column("probability", "number"),
        Column("log evidence", "number", "over the refitted model without effects"),
    ]
    blocks: list[Block] = [
        Text(words.which_in_words(diagnosis)),
        Pictures([picture]),
        _sizes(diagnosis),
        table(f"Answers ({len(rows)} of {len(diagnosis.candidates)})", columns, rows, folded=True),
    ]
    for name in diagnosis.named:
        about = next(row for row in diagnosis.effects if row["name"] == name)
        blocks.append(Heading(str(about["title"]), f"effect `{name}`".replace("`", "")))
        texts = [str(about["equation"]), f"Source: {about['source']}" if about["source"] else ""]
        blocks.append(Text(". ".join(part.rstrip(".") for part in texts if part) + "."))
        if about["equivalent"]:
            blocks.append(Text(f"No trial could tell it from: {listed([str(e) for e in about['equivalent']])}."))
    return Section("which", "Which effect", blocks)


def _sizes(diagnosis: Diagnosis) -> Block:
    """Fitted parameters of the leading effects with intervals, beside what is typical."""
    about = {row["name"]: {q["name"]: q for q in row["parameters"]} for row in diagnosis.effects}
    rows = []
    fitted = [row for row in diagnosis.which if row["parameters"]][:_SIZED]
    for row in fitted:
        for k, q in enumerate(row["parameters"]):
            scale = shown(str(q["name"]), str(q["unit"]))
            value, error, low, high = (float(q[key]) * scale.factor for key in ("value", "stderr", "lower", "upper"))
            typical = float(about[row["name"]][q["name"]]["typical"]) * scale.factor
            rows.append(
                [
                    str(row["title"]),
                    words.chance(row["probability"]),
                    str(q["name"]).replace("_", " "),
                    estimate(value, error) if abs(value) >= 0.01 * error else "0",
                    number(error, 2),
                    interval(low, high, error),
                    scale.unit,
                    number(typical, 2),
                    number(math.sqrt(row["lambda"]), 3) if k == 0 and row["lambda"] > _ANY else "",
                ]
            )
    columns = [
        Column("effect"),
        Column("probability", "number", "that it acts, alone or with others"),
        Column("parameter"),
        Column("value", "number", "fitted alone; of named effects, together"),
        Column("std. error", "number"),
        Column("95 % interval", "number"),
        Column("unit"),
        Column("typical", "number", "distance from its null that is usual for such a vehicle"),
        Column("z", "number", "size of its signature in standard deviations, what refitting takes up projected out"),
    ]
    return table("The leading effects", columns, rows)


def signatures(diagnosis: Diagnosis, album: Album) -> Section | None:
    """Residuals, the part that the effects explain, and what remains."""
    chosen = curves.telling(diagnosis)
    if not chosen or not len(diagnosis.traces):
        return None
    pictures = []
    for trial, channel in chosen:
        alt = f"Residual of {channel} in trial {trial} after refitting, the part explained, and what remains."
        pictures.append(album.picture(curves.signature(diagnosis, trial, channel), alt))
    effects = diagnosis.augmented["effects"]
    text = (
        f"The trials and channels in which {words.in_titles(diagnosis, effects)} explains most."
        if effects
        else "No effect is in the model here: the trials and channels in which the refitted model misses most."
    )
    legend = _LEGEND if effects else (("residual", "residual after refitting; the band is twice the noise"),)
    return Section("signatures", "Signatures", [Text(text), Pictures(pictures, legend)])


def confusion(diagnosis: Diagnosis, album: Album) -> Section | None:
    """How well the leading effects can be told apart on these trials."""
    names, found = curves.pairs(diagnosis)
    if len(names) < 2:
        return None
    known = words.titles(diagnosis)
    close = sorted((value, pair) for pair, value in found.items() if value < words.NEAR)
    text = (
        "Pairwise lambda: what is left of the effect of the row, at its fitted size, when that of the column and all "
        "coefficients take up what they can. Below 11 (marked) the two count as not told apart on these trials."
    )
    blocks: list[Block] = [Text(text)]
    picture = album.picture(
        curves.apart(diagnosis),
        f"Pairwise lambda of {count(len(names), 'effect')}; {count(len(close), 'pair')} below 11.",
        "Squared distance in standard deviations. Columns carry the numbers of the rows"
        + "".join(f"; {k + 1}: {known.get(name, name)}" for k, name in enumerate(names))
        + ".",
    )
    blocks.append(Pictures([picture]))
    together = [row for row in diagnosis.effects if row["name"] in diagnosis.verdict["set"]]
    blocks.extend(
        Text(f"{row['title']}: told apart by {row['distinguished_by']}.") for row in together if row["distinguished_by"]
    )
    return Section("confusion", "What is confused with what", blocks)


def unnamed(diagnosis: Diagnosis, album: Album) -> Section | None:
    """What something that is not in the library would look like: in time and as a formula."""
    found = diagnosis.unnamed
    if found is None:
        return None
    grave = diagnosis.verdict["kind"] == "unknown" or diagnosis.verdict["beside"]
    beside = [words.titles(diagnosis).get(name, name) for name in found["beside"]]
    speaks = float(found["log_evidence"]) > 0 or float(found["formula_log_evidence"]) > 0
    if not speaks and not grave:
        text = "Nothing unnamed is needed: free functions of time and free terms in each equation were tried"
        return Section(
            "unnamed", "What has no name", [Text(f"{text}{_beside(beside)}, and the trials speak against them.")]
        )
    text = (
        f"If something unnamed acts{_beside(beside)}, it looks most like something in "
        f"{words.place_in_words(found['place'])}: log evidence {number(found['log_evidence'], 3)} as a function of "
        f"time, {number(found['formula_log_evidence'], 3)} as a formula of the motion."
    )
    alt = f"What is missing at {found['place']} over time, with 95 % bands."
    caption = "What has to be added there over the time of each trial, with 95 % bands."
    blocks: list[Block] = [Text(text), Pictures([album.picture(curves.unnamed(diagnosis), alt, caption)])]
    if found["formula"]:
        blocks.append(Text(f"As a formula, {words.formula_in_words(found)}."))
        rows = [
            [str(row["term"]), number(row["factor"], 3), number(row["coefficient"], 3), number(row["stderr"], 2)]
            for row in found["formula"]
        ]
        columns = [
            Column("term"),
            Column("factor", "number", "in SI units: multiply the term by it and add it to the acceleration"),
            Column("usual size", "number", "acceleration in SI units where motions have their usual size"),
            Column("std. error", "number"),
        ]
        caption = f"Terms of the equation of {found['equation']} that the trials ask for"
        blocks.append(table(caption, columns, rows))
    return Section("unnamed", "What has no name", blocks)


def _beside(effects: list[str]) -> str:
    return f" beside {listed(effects)}" if effects else ""


def detectable(diagnosis: Diagnosis, album: Album) -> Section | None:
    """The smallest magnitude of each effect that these trials would show."""
    about = {row["name"]: {q["name"]: q for q in row["parameters"]} for row in diagnosis.effects}
    rows: list[list[str]] = []
    weak = set(diagnosis.verdict["powerless"])
    ranked: list[dict[str, Any]] = sorted(diagnosis.which, key=lambda row: row["name"] not in weak)
    for row in ranked:
        for name, limit in row["detectable"].items():
            q = about[row["name"]][name]
            scale = shown(name, str(q["unit"]))
            typical = float(q["typical"]) * scale.factor
            least = float(limit) * scale.factor
            sizes = [number(least, 2) if least < _NEVER * typical else "none", number(typical, 2)]
            could = "could show" if float(limit) <= float(q["typical"]) else "could not"
            rows.append([str(row["title"]), name.replace("_", " "), *sizes, scale.unit, could])
    if not rows:
        return None
    columns = [
        Column("effect"),
        Column("parameter"),
        Column("smallest shown", "number", "found with probability 0.8 in a test at 0.05"),
        Column("typical", "number"),
        Column("unit"),
        Column("at typical size", "verdict"),
    ]
    text = (
        "The smallest magnitude of each effect that these trials would have shown, what the coefficients and initial "
        "states can take up taken off. An effect that could not show is not excluded by any verdict above."
    )
    caption = f"Smallest detectable magnitudes ({count(len(rows), 'parameter')})"
    return Section(
        "detectable", "What could have been seen", [Text(text), table(caption, columns, rows, folded=not weak)]
    )


def model(diagnosis: Diagnosis, album: Album) -> Section | None:
    """The model with what was found."""
    effects = diagnosis.augmented["effects"]
    rows = [[name, number(value, 6)] for name, value in diagnosis.augmented["parameters"].items()]
    text = (
        f"The model {diagnosis.model} with {words.in_titles(diagnosis, effects)} and the values below is saved as "
        "augmented.toml, a study file to simulate and identify with."
        if effects
        else f"No effect is added to {diagnosis.model}; its refitted values are saved in augmented.toml."
    )
    columns = [Column("parameter"), Column("value", "number", "in the model's own unit")]
    return Section(
        "model",
        "The model with what was found",
        [Text(text), table(f"Parameters ({len(rows)})", columns, rows, folded=True)],
    )


def steps(diagnosis: Diagnosis, album: Album) -> Section | None:
    """Everything that was done to the data before."""
    rows = [
        [str(trial["name"]), str(step["name"]), str(step["effect"])]
        for trial in diagnosis.trials
        for step in trial.get("steps") or []
    ]
    if not rows:
        return None
    columns = [Column("trial"), Column("step"), Column("what it did", "long")]
    text = "Everything that was done to the recorded data before the diagnosis, in this order."
    return Section("steps", "Steps on the data", [Text(text), table("Steps on record", columns, rows, folded=True)])


def not_asked(diagnosis: Diagnosis, album: Album) -> Section | None:
    """Effects that took part, and those that did not with the reason."""
    took = [
        [str(row["title"]), str(row["name"]), "" if row["number"] is None else str(row["number"]), str(row["family"]),
         ", ".join(str(place) for place in row["acts_on"]), str(row["equation"])]
        for row in diagnosis.effects
    ]  # fmt: skip
    columns = [
        Column("effect"),
        Column("name"),
        Column("number", "number", "in the catalogue"),
        Column("family"),
        Column("acts on", "long"),
        Column("equation", "long"),
    ]
    blocks: list[Block] = [table(f"Effects that took part ({len(took)})", columns, took, folded=True)]
    if diagnosis.left_out:
        rows = [[name, why] for name, why in diagnosis.left_out.items()]
        heads = [Column("effect"), Column("took no part because", "long")]
        blocks.append(table(f"Effects that took no part ({len(rows)})", heads, rows, folded=True))
    return Section("effects", "Effects", blocks)
