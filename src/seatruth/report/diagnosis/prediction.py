"""Sections about predictions: trials left out, and the next trial."""

from __future__ import annotations

import math

from seatruth.diagnosis.results import Diagnosis
from seatruth.report.blocks import Block, Column, Pictures, Section, Text, table
from seatruth.report.diagnosis import figures_prediction as figures
from seatruth.report.diagnosis.figures_where import LABELS
from seatruth.report.numbers import number
from seatruth.report.sections.pictures import Album
from seatruth.report.text import diagnosis as text


def validation(diagnosis: Diagnosis, album: Album) -> Section | None:
    """Each trial predicted from the others, and the gap explained."""
    found = diagnosis.validation
    if found is None:
        return None
    blocks: list[Block] = [Text(text.validation_in_words(diagnosis))]
    if not found.folds:
        return Section("validation", "Trials left out", blocks)
    picture = album.picture(
        figures.folds(diagnosis),
        "Error of the prediction of each trial left out, in multiples of the noise.",
        "Each trial is left out in turn: the others fit everything, and the trial is predicted. Errors are of what the "
        "others determine of it. Black: noise, which the best fit to all trials leaves. The control fits free terms in "
        "the equations instead of effects: it shows what freedom alone would bring.",
    )
    rows = []
    for fold in found.folds:
        sizes = [
            number(x, 3)
            for x in (fold.error_refit, fold.error_discrepancy, fold.error_effects, fold.error_noise, fold.left_open)
        ]
        chosen = text.in_titles(diagnosis, fold.effects)
        rows.append([fold.trial, *sizes, number(fold.predictive_gain, 3), chosen])
    columns = [
        Column("trial left out"),
        Column(LABELS["refit"], "number", "root mean square error over noise"),
        Column("free terms (control)", "number"),
        Column(LABELS["effects"], "number", "those of the verdict, refitted to the other trials"),
        Column("noise", "number", "what the best fit to all trials leaves of this one"),
        Column("left open", "number", "what the other trials leave open about this one, over noise; not in the errors"),
        Column(
            "predictive gain", "number", "log predictive density, given others, with the effects less without (nats)"
        ),
        Column("effects that the other trials select", "long"),
    ]
    blocks += [Pictures([picture]), table("Trials left out, error over noise", columns, rows)]
    if math.isfinite(found.gap_explained):
        blocks.append(
            Text(
                "The gap explained is (refit − effects) / (refit − noise) of the mean errors of trials left out. What "
                "the other trials leave open about a trial counts as noise of its prediction, with the effects as "
                "without. The interval rests on how far the trials differ: with few trials it is wide."
            )
        )
    return Section("validation", "Trials left out", blocks)


def next_trial(diagnosis: Diagnosis, album: Album) -> Section | None:
    """The trial that best separates the causes that are left."""
    new = diagnosis.next_trial
    if new is None:
        return None
    blocks: list[Block] = [Text(text.next_in_words(diagnosis))]
    pictures = []
    if new.manoeuvre and new.t:
        alt = f"The suggested trial, {new.manoeuvre}: inputs and expected motion over time."
        caption = "Blue: inputs to apply. Grey: motion that the model expects."
        pictures.append(album.picture(figures.suggested(diagnosis), alt, caption))
    if new.menu:
        alt = "Distance of the most probable cause from the nearest other one after each trial of the menu."
        caption = "Dashed: with the recorded trials alone. Dotted: from here on two causes can be distinguished."
        pictures.append(album.picture(figures.menu(diagnosis), alt, caption))
    if pictures:
        blocks.append(Pictures(pictures))
    rows = [
        [
            entry.manoeuvre,
            entry.text,
            number(math.sqrt(max(entry.noncentrality, 0.0)), 3),
            number(entry.gain, 2),
            ", ".join(text.survivor(diagnosis, name) for name in entry.weakest),
        ]
        for entry in new.menu
    ]
    if rows:
        columns = [
            Column("trial", "long"),
            Column("what the crew does", "long"),
            Column("distance", "number", "of the most probable cause from the nearest other, in standard deviations"),
            Column(
                "gain",
                "number",
                "of the true one's noncentrality, in the mean by probability and to first order; at most 8",
            ),
            Column("most probable cause and the nearest other", "long"),
        ]
        blocks.append(table(f"Menu ({len(rows)})", columns, rows, folded=True))
    return Section("next-trial", "The next trial", blocks)
