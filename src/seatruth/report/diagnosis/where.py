"""Section with the evidence for where the gap lies: place, tree of causes, trials and channels, time, region."""

from __future__ import annotations

from seatruth.diagnosis.results import Diagnosis
from seatruth.diagnosis.sentences import chance
from seatruth.report.blocks import Block, Column, Heading, Pictures, Section, Text, table
from seatruth.report.diagnosis import figures_where as figures
from seatruth.report.numbers import number, shown
from seatruth.report.sections.pictures import Album
from seatruth.report.text import gap as text
from seatruth.report.text.diagnosis import node_in_words

_NOT_SHOWN = 5e-4
"""Probability below which a place or node is left out of the tables."""


def where(diagnosis: Diagnosis, album: Album) -> Section:
    """Where it acts and where it shows."""
    blocks: list[Block] = [
        Text(text.where_in_words(diagnosis)),
        *_places(diagnosis, album),
        *_tree(diagnosis, album),
        *_gap(diagnosis, album),
        *_time(diagnosis, album),
        *_region(diagnosis, album),
    ]
    return Section("where", "Where", blocks)


def _places(diagnosis: Diagnosis, album: Album) -> list[Block]:
    rows = [
        [text.place_in_words(place), chance(p), "named" if place in diagnosis.verdict.places else ""]
        for place, p in text.ranked(diagnosis.places)
        if p >= _NOT_SHOWN or place in diagnosis.verdict.places
    ]
    if not rows:
        return []
    alt = f"Probability by place, the largest: {rows[0][0]}, {rows[0][1]}."
    caption = "Probability that something acts there, over all hypotheses. Blue: where the causes of the verdict act."
    columns = [
        Column("place", "long"),
        Column("probability", "number", "sum over the hypotheses in which something acts there"),
        Column("in the verdict", "verdict"),
    ]
    return [
        Heading("By place"),
        Pictures([album.picture(figures.places(diagnosis), alt, caption)]),
        table(f"Places ({len(rows)})", columns, rows, folded=True),
    ]


def _tree(diagnosis: Diagnosis, album: Album) -> list[Block]:
    found = figures.nodes(diagnosis)
    if not found:
        return []
    named = {cause.cause for cause in diagnosis.verdict.causes}
    rows = [
        [f"{'– ' * depth}{node_in_words(node)}", chance(p), "named" if node in named else ""]
        for depth, node, p in found
    ]
    alt = f"Probability by node of the tree of causes, {len(found)} nodes."
    caption = (
        "Each level narrows the cause down; a node holds all below it. The verdict names the finest node that reaches "
        "its probability (blue, with the nodes above)."
    )
    columns = [Column("cause", "long"), Column("probability", "number"), Column("in the verdict", "verdict")]
    return [
        Heading("By node of the tree of causes"),
        Pictures([album.picture(figures.tree(diagnosis), alt, caption)]),
        table(f"Nodes of the tree ({len(rows)})", columns, rows, folded=True),
    ]


def _gap(diagnosis: Diagnosis, album: Album) -> list[Block]:
    found, compared = text.channels(diagnosis), text.fits(diagnosis)
    if not found:
        return []
    labels = [figures.LABELS[fit] for fit in compared]
    rows = []
    for row in found:
        sizes = [number(size * row.channel.factor, 3) for size in (row.noise, *(row.rmse[fit] for fit in compared))]
        rows.append([row.channel.name, row.channel.unit, *sizes, *(number(row.multiple[fit], 2) for fit in compared)])
    columns = [
        Column("channel"),
        Column("unit"),
        Column("noise", "number", "standard deviation of its white and slow part together"),
        *(Column(label, "number", "root mean square error") for label in labels),
        *(Column(f"× noise, {label}" if k == 0 else label, "number") for k, label in enumerate(labels)),
    ]
    split = album.picture(
        figures.split(diagnosis),
        f"Split of the misfit: {text.gap_in_words(diagnosis)}",
        "The squared misfit of the declared model in multiples of the noise, split by what removes it.",
    )
    channels = album.picture(
        figures.multiples(diagnosis),
        "Root mean square error of each channel in multiples of its noise, by fit.",
        "Simulation of all trials. 1 means that only noise is left. Only what the refit leaves is evidence of "
        "something that the model left out.",
    )
    return [
        Heading("By trial and channel"),
        Text(text.gap_in_words(diagnosis)),
        Pictures([split]),
        table("The gap by channel, all trials together", columns, rows),
        Pictures([channels]),
        _by_trial(diagnosis, compared),
    ]


def _by_trial(diagnosis: Diagnosis, compared: tuple[str, ...]) -> Block:
    rows = []
    for _, row in diagnosis.gap.iterrows():
        scale = shown(str(row["channel"]), str(row["unit"]))
        sizes = [number(row[f"rmse_{fit}"] * scale.factor, 3) for fit in compared]
        multiples = [number(row[f"multiple_{fit}"], 2) for fit in compared]
        rows.append([str(row["trial"]), scale.name, scale.unit, str(row["n"]), *sizes, *multiples])
    labels = [figures.LABELS[fit] for fit in compared]
    columns = [
        Column("trial"),
        Column("channel"),
        Column("unit"),
        Column("samples", "number"),
        *(Column(label, "number", "root mean square error") for label in labels),
        *(Column(f"× noise, {label}" if k == 0 else label, "number") for k, label in enumerate(labels)),
    ]
    return table("The gap of each trial and channel", columns, rows, folded=True)


def _time(diagnosis: Diagnosis, album: Album) -> list[Block]:
    if not len(diagnosis.time):
        return []
    many = len(text.significant(diagnosis.time))
    alt = f"Misfit over time, one row per trial: {many} of {len(diagnosis.time)} parts are significant."
    caption = (
        f"{many} of {len(diagnosis.time)} parts are significant (dots): of these, at most 5 % are expected to be false "
        "(false discovery rate over all parts)."
    )
    return [Heading("In time"), Pictures([album.picture(figures.time_map(diagnosis), alt, caption)])]


def _region(diagnosis: Diagnosis, album: Album) -> list[Block]:
    cells = diagnosis.region
    if not len(cells):
        return []
    many = len(text.significant(cells))
    alt = f"Misfit over the operating region: {many} of {len(cells)} cells are significant."
    caption = (
        f"{many} of {len(cells)} cells are significant against the others (false discovery rate 5 % over all cells). "
        "The residuals are permuted in blocks within each trial, so that their autocorrelation stays."
    )
    rows = []
    for _, cell in cells.sort_values("p", kind="stable").iterrows():
        size = figures.label_of_cell(float(cell["misfit"]))
        mark = "significant" if cell["significant"] else ""
        tests = [number(cell["p"], 2), number(cell["p_adjusted"], 2)]
        rows.append([text.cell_in_words(cell), str(cell["n"]), size, *tests, mark])
    columns = [
        Column("cell", "long"),
        Column("samples", "number"),
        Column("error / noise", "number"),
        Column("p", "number", "probability of as much if the misfit did not depend on the region"),
        Column("p, adjusted", "number", "for the number of cells (Benjamini and Hochberg)"),
        Column("", "verdict"),
    ]
    return [
        Heading("Over the operating region"),
        Pictures([album.picture(figures.region_map(diagnosis), alt, caption)]),
        table(f"Cells of the operating region ({len(rows)})", columns, rows, folded=True),
    ]
