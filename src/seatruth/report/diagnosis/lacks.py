"""Sections about the rest of the statistical model: missing forces, measurement noise, coefficients."""

from __future__ import annotations

import math

from seatruth.diagnosis.results import Diagnosis
from seatruth.report.blocks import Block, Column, Pictures, Section, Text, table
from seatruth.report.diagnosis import figures_prediction as figures
from seatruth.report.numbers import estimate, listed, number, percent, shown
from seatruth.report.sections.pictures import Album
from seatruth.report.text import diagnosis as text
from seatruth.report.text.gap import place_in_words, ranked
from seatruth.uncertainty.moved_coefficients import Coefficient

_FAR = 2.0
"""Prior standard deviations from which a refitted coefficient is marked. Chosen here [S]."""


def discrepancy(diagnosis: Diagnosis, album: Album) -> Section:
    """Sizes, time histories and formula of the forces that the model's structure lacks."""
    missing = diagnosis.discrepancy
    blocks: list[Block] = [Text(text.lacks_in_words(diagnosis))]
    if missing is not None:
        rows = [[place_in_words(name), percent(size) or "0 %"] for name, size in ranked(missing.sizes)]
        if rows:
            columns = [
                Column("equation", "long"),
                Column("missing acceleration", "number", "as a part of the usual acceleration of that equation"),
            ]
            blocks.append(table("Size of the missing acceleration", columns, rows))
        forces = figures.largest_forces(diagnosis)
        if forces:
            where = place_in_words(forces[0].equation)
            alt = f"Missing acceleration in {where} over time, one panel per trial, with 95 % bands."
            caption = f"The missing acceleration in {where} over the time of each trial, with 95 % bands."
            blocks.append(Pictures([album.picture(figures.missing_forces(diagnosis), alt, caption)]))
        blocks += _formula(diagnosis)
    return Section("discrepancy", "What the structure lacks", blocks)


def _formula(diagnosis: Diagnosis) -> list[Block]:
    missing = diagnosis.discrepancy
    if missing is None or not missing.terms:
        return []
    rows = []
    for term in missing.terms:
        value, error = estimate(term.coefficient, term.stderr), number(term.stderr, 2)
        rows.append([place_in_words(term.equation), term.term, value, error, term.unit.replace("^2", "²")])
    columns = [
        Column("equation", "long"),
        Column("term", "text", "function of motion and inputs in the units of the model's channels"),
        Column("coefficient", "number", "multiply the term by it and add it to the acceleration"),
        Column("std. error", "number"),
        Column("unit", "text", "of the acceleration"),
    ]
    return [
        Text(f"As a formula: {listed(text.formula_in_words(diagnosis))}."),
        table("Terms that stand out, the clearest first", columns, rows),
    ]


def noise(diagnosis: Diagnosis, album: Album) -> Section | None:
    """White and slow measurement noise of each channel."""
    if not diagnosis.noise:
        return None
    rows = []
    for channel in diagnosis.noise:
        scale = shown(channel.channel, channel.unit)
        sizes = [number(x * scale.factor, 3) for x in (channel.white, channel.slow)]
        tau = number(channel.tau, 2) if channel.slow > 0 else ""
        declared = number(channel.declared * scale.factor, 3)
        rows.append([scale.name, scale.unit, *sizes, tau, declared, str(channel.samples)])
    columns = [
        Column("channel"),
        Column("unit"),
        Column("white", "number", "standard deviation"),
        Column("slow", "number", "standard deviation of the slow error (Ornstein-Uhlenbeck); 0 where there is none"),
        Column("tau (s)", "number", "correlation time of the slow error"),
        Column("white, declared", "number", "what the study states"),
        Column("samples", "number"),
    ]
    about = (
        "Each sensor has a white error and a slow error that returns to zero. Their sizes are estimated together with "
        "the effects and the missing forces, so that none of them is taken for another."
    )
    return Section("noise", "Measurement noise", [Text(about), table("Noise of each channel", columns, rows)])


def coefficients(diagnosis: Diagnosis, album: Album) -> Section | None:
    """Refitted coefficients beside their priors, and the model with the named effects."""
    blocks: list[Block] = []
    if diagnosis.coefficients:
        rows = []
        for coefficient in diagnosis.coefficients:
            distance = _distance(coefficient)
            rows.append(
                [
                    coefficient.name,
                    coefficient.unit,
                    number(coefficient.declared, 4),
                    number(coefficient.prior_sd, 2),
                    f"{estimate(coefficient.value, coefficient.stderr)} ± {number(coefficient.stderr, 2)}",
                    number(distance, 2),
                    "far" if abs(distance) >= _FAR else "",
                ]
            )
        columns = [
            Column("coefficient"),
            Column("unit"),
            Column("declared", "number", "mean of its prior"),
            Column("prior sd", "number"),
            Column("refitted ± std. error", "number", "together with the effects of the verdict"),
            Column("distance", "number", "from its prior, in prior standard deviations"),
            Column("", "verdict"),
        ]
        about = (
            "The free coefficients are refitted under their priors together with the effects of the verdict. One that "
            "moved by more than 2 prior standard deviations (marked) stands for something that the prior excludes."
        )
        blocks += [Text(about), table("Coefficients", columns, rows)]
    blocks += _augmented(diagnosis)
    return Section("coefficients", "Coefficients and the augmented model", blocks)


def _distance(coefficient: Coefficient) -> float:
    sd = coefficient.prior_sd
    return (coefficient.value - coefficient.declared) / sd if sd > 0 else math.nan


def _augmented(diagnosis: Diagnosis) -> list[Block]:
    effects = tuple(diagnosis.augmented.get("effects") or ())
    if not effects:
        return [Text("The verdict names no effect, so augmented.toml is the study as it was.")]
    values = diagnosis.augmented["parameters"]
    rows = [[name, number(value, 6)] for name, value in values.items()]
    about = (
        f"augmented.toml is the study with {text.in_titles(diagnosis, effects)} at the reported values, and no other "
        "change. Its coefficients are those of the study: identify with it before you simulate it."
    )
    columns = [Column("parameter"), Column("value", "number", "SI units, angles in rad, as the study file holds them")]
    return [Text(about), table("What augmented.toml adds", columns, rows)]
