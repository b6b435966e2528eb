"""Sections with the evidence for where the gap lies and how far it shrinks."""

from __future__ import annotations

import math
from typing import Any

from seatruth.diagnosis.results import Diagnosis
from seatruth.report.blocks import Block, Column, Heading, Pictures, Section, Text, table
from seatruth.report.diagnosis import curves, maps, words
from seatruth.report.numbers import number, shown
from seatruth.report.sections.pictures import Album


def _fits(diagnosis: Diagnosis) -> tuple[str, ...]:
    """The fits that are compared: the third only where it differs from the second."""
    return ("before", "refit", "effect") if diagnosis.augmented["effects"] else ("before", "refit")


def gap(diagnosis: Diagnosis, album: Album) -> Section | None:
    """The gap by channel, in units and in multiples of the noise, and its split."""
    found = words.channels(diagnosis)
    if not found:
        return None
    fits = _fits(diagnosis)
    best = [maps.best_label(diagnosis)] * (len(fits) - 2)
    rows = []
    for row in found:
        scale = row["shown"]
        sizes = [number(row[key] * scale.factor, 3) for key in ("noise", *(f"rmse_{fit}" for fit in fits))]
        rows.append([scale.name, scale.unit, *sizes, *(number(row[f"multiple_{fit}"], 2) for fit in fits)])
    columns = [
        Column("channel"),
        Column("unit"),
        Column("noise", "number", "standard deviation"),
        Column("as believed", "number", "RMSE of the model before anything was fitted but the initial states"),
        Column("refitted", "number", "RMSE after its free coefficients were fitted under their priors"),
        *(Column(name, "number", "RMSE with the effects of the verdict and everything refitted") for name in best),
        Column("× noise, as believed", "number"),
        *(Column(name, "number") for name in ("refitted", *best)),
    ]
    pictures = [
        album.picture(
            maps.multiples(diagnosis),
            "RMSE of each channel in multiples of its noise: as believed, refitted, and with the effects.",
            "Open-loop simulation of all trials. 1 means that only noise is left. Only what refitting leaves is "
            "evidence of something that the model left out.",
        )
    ]
    split = album.picture(
        maps.split(diagnosis),
        f"Split of the misfit: {words.gap_in_words(diagnosis)}",
        "The squared misfit of the model as it was believed, whitened, split by what takes it away.",
    )
    blocks: list[Block] = [
        Text(words.gap_in_words(diagnosis)),
        Pictures([split]),
        table("The gap by channel, all trials together", columns, rows),
        Pictures(pictures),
        _by_trial(diagnosis),
    ]
    return Section("gap", "The gap", blocks)


def _by_trial(diagnosis: Diagnosis) -> Block:
    fits = _fits(diagnosis)
    rows = []
    for row in diagnosis.gap:
        scale = shown(str(row["channel"]), str(row["unit"]))
        sizes = [number(row[f"rmse_{fit}"] * scale.factor, 3) for fit in fits]
        multiples = [number(row[f"multiple_{fit}"], 2) for fit in fits]
        rows.append([str(row["trial"]), scale.name, scale.unit, str(row["n"]), *sizes, *multiples])
    heads = ("as believed", "refitted", maps.best_label(diagnosis))[: len(fits)]
    columns = [
        Column("trial"),
        Column("channel"),
        Column("unit"),
        Column("samples", "number"),
        *(Column(name, "number") for name in heads),
        *(Column(name, "number") for name in ("× noise, as believed", *heads[1:])),
    ]
    return table("The gap of each trial and channel", columns, rows, folded=True)


def where(diagnosis: Diagnosis, album: Album) -> Section | None:
    """Equation, actuator or sensor; time; operating region."""
    blocks: list[Block] = [Text(words.where_in_words(diagnosis))]
    places = diagnosis.where["places"]
    if places:
        rows = []
        for row in places:
            left = row["log_evidence_left"]
            rows.append(
                [
                    words.place_in_words(str(row["place"])),
                    words.chance(row["probability"]),
                    number(row["log_evidence"], 3),
                    number(left, 3) if diagnosis.augmented["effects"] else "",
                ]
            )
        columns = [
            Column("place", "long"),
            Column("probability", "number", "if one unnamed cause acted at one of these places"),
            Column("log evidence", "number", "of any function of time at that place, over none; above 0 speaks for it"),
            Column("with the named effects in", "number", "the same once they are in the model; below 0: nothing left"),
        ]
        blocks += [
            Heading("Equation, actuator or sensor"),
            Text(
                "As if one unnamed cause acted, free to change in time, at one place: how much the trials speak for "
                "each. A function of time can imitate a cause elsewhere, so a named effect says more than this table."
            ),
            table("Rival places", columns, rows),
        ]
    time, region = diagnosis.where["time"], diagnosis.where["region"]
    if time:
        many = len(words.stand_out(diagnosis, "time"))
        alt = f"Misfit over time, a row a trial: {many} of {len(time)} parts stand out."
        caption = (
            f"{many} of {len(time)} parts stand out. Each is tested against noise alone; of those that carry a dot at "
            "most 5 % are expected to be false (false discovery rate, all parts together)."
        )
        blocks += [Heading("Time"), Pictures([album.picture(maps.time_map(diagnosis), alt, caption)])]
    if region:
        many = len(words.stand_out(diagnosis, "region"))
        alt = f"Misfit over the operating region: {many} of {len(region)} cells stand out."
        caption = (
            f"{many} of {len(region)} cells stand out from the others: tested by moving the residuals' blocks about "
            "within each trial, so that their memory stays; false discovery rate 5 % over all cells."
        )
        blocks += [Heading("Operating region"), Pictures([album.picture(maps.region_map(diagnosis), alt, caption)])]
        blocks.append(_cells(region))
    return Section("where", "Where", blocks)


def _cells(region: list[dict[str, Any]]) -> Block:
    rows = []
    for cell in sorted(region, key=lambda row: float(row["p"])):
        scale = shown(str(cell["variable"]), str(cell["unit"]))
        ends = [number(float(cell[key]) * scale.factor, 3) for key in ("from", "to")]
        within = str(cell["cell"]) if cell["variable"] == "heading" else f"{ends[0]} to {ends[1]}"
        size = number(math.sqrt(max(float(cell["misfit"]), 0.0)), 3)
        tests = [number(cell["p"], 2), number(cell["p_adjusted"], 2)]
        rows.append(
            [scale.name, within, scale.unit, str(cell["n"]), size, *tests, "stands out" if cell["stands_out"] else ""]
        )
    columns = [
        Column("variable"),
        Column("cell"),
        Column("unit"),
        Column("samples", "number"),
        Column("misfit / noise", "number"),
        Column("p", "number", "probability of as much if the misfit did not depend on the region"),
        Column("p, adjusted", "number", "for the number of cells (Benjamini and Hochberg)"),
        Column("", "verdict"),
    ]
    return table(f"Cells of the operating region ({len(rows)})", columns, rows, folded=True)


def how_far(diagnosis: Diagnosis, album: Album) -> Section | None:
    """The shrinkage on trials left out, beside the refit and the flexible control."""
    far = diagnosis.how_far
    if far is None:
        return None
    blocks: list[Block] = [Text(words.how_far_in_words(diagnosis))]
    if not far["folds"]:
        return Section("how-far", "How far", blocks)
    picture = album.picture(
        curves.folds(diagnosis),
        "Error of the prediction of each trial left out, in multiples of the noise.",
        "Each trial is left out in turn: the others choose the effects and fit everything, then it is predicted in "
        "open loop from the state that its first fifth gives. The flexible control adds free terms in all equations "
        "instead of effects: it shows what mere freedom would bring.",
    )
    known = words.titles(diagnosis)
    rows = []
    for fold in far["folds"]:
        chosen = ", ".join(known.get(name, name) for name in fold["chosen"]) or "none"
        sizes = [number(fold[key], 3) for key in ("before", "refit", "flexible", "effect")]
        rows.append([str(fold["trial"]), str(fold["manoeuvre"]), *sizes, chosen])
    columns = [
        Column("trial left out"),
        Column("manoeuvre", "long"),
        Column("as believed", "number", "error over noise"),
        Column("refitted", "number"),
        Column("flexible control", "number"),
        Column("with effects", "number"),
        Column("effects that the other trials choose", "long"),
    ]
    blocks += [Pictures([picture]), table("Trials left out, error over noise", columns, rows)]
    kinds = far.get("by_manoeuvre") or []
    if 1 < len(kinds) < len(far["folds"]):
        rows = [
            [str(kind["manoeuvre"]) or "not stated", number(kind["refit"], 3), number(kind["effect"], 3)]
            for kind in kinds
        ]
        heads = [Column("manoeuvre", "long"), Column("refitted", "number"), Column("with effects", "number")]
        blocks.append(table("By kind of manoeuvre, error over noise", heads, rows))
    closure = far["closure"]
    if closure is not None and math.isfinite(closure["value"]):
        blocks.append(
            Text(
                "Closure is (error refitted − error with effects) / (error refitted − noise), the mean over trials. "
                "Its interval is that of a jackknife over trials: with few trials it is wide."
            )
        )
    return Section("how-far", "How far the gap shrinks", blocks)


def next_trial(diagnosis: Diagnosis, album: Album) -> Section | None:
    """The manoeuvre of a menu that best separates what is still confused."""
    new = diagnosis.next_trial
    if new is None:
        return None
    survivors = ", ".join(words.surviving(diagnosis, name) for name in new["survivors"])
    pictures = [
        album.picture(
            curves.next_inputs(diagnosis),
            f"The suggested trial, {new['manoeuvre']}: inputs and expected motion over time.",
            "Blue: inputs to apply. Grey: motion that the fitted model expects.",
        ),
        album.picture(
            curves.menu(diagnosis),
            "What each manoeuvre of the menu would bring.",
            "Distance between the two causes that would then be hardest to tell apart. Dashed: now. Dotted: from here "
            "on they count as told apart.",
        ),
    ]
    blocks: list[Block] = [
        Text(f"{words.next_in_words(diagnosis)} Causes compared: {survivors}."),
        Pictures(pictures),
    ]
    return Section("next-trial", "The next trial", blocks)


def noise(diagnosis: Diagnosis, album: Album) -> Section | None:
    """The noise floor of each channel."""
    if not diagnosis.noise:
        return None
    units = {str(row["channel"]): str(row["unit"]) for row in diagnosis.gap}
    rows = []
    for row in diagnosis.noise:
        scale = shown(str(row["channel"]), units.get(str(row["channel"]), ""))
        sizes = [number(row[key] * scale.factor, 3) for key in ("sd", "innovation")]
        counts = [str(row["order"]), number(row["memory_s"], 2), str(row["n"]), f"{row['n_eff']:.0f}"]
        rows.append([scale.name, scale.unit, number(row["step_s"], 3), *sizes, *counts])
    columns = [
        Column("channel"),
        Column("unit"),
        Column("sampling step (s)", "number"),
        Column("noise", "number", "standard deviation"),
        Column("innovation", "number", "standard deviation of what its own past does not foretell"),
        Column("order", "number", "of the autoregressive model"),
        Column("memory (s)", "number"),
        Column("samples", "number"),
        Column("effective", "number", "independent samples that these are worth"),
    ]
    text = (
        "The noise is what is left when everything that could be meant is free at once: coefficients, initial states "
        "and all effects. Residuals are whitened with it, so that correlated noise is not taken for evidence."
    )
    return Section("noise", "The noise floor", [Text(text), table("Noise of each channel", columns, rows)])
