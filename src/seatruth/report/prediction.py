"""The report of predicted manoeuvres: one HTML page that stands alone."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pandas as pd

from seatruth.prediction import Predictions
from seatruth.report.blocks import Block, Column, Heading, Notes, Pictures, Section, Statement, Text, table
from seatruth.report.figures import manoeuvres as figures
from seatruth.report.numbers import number, shown
from seatruth.report.page import page
from seatruth.report.sections.pictures import Album
from seatruth.report.sections.run import of_findings, of_provenance
from seatruth.storage.atomic import write_file

_SYNTHETIC = "The trials behind this prediction were made by a simulator. Nothing here was measured at sea."
_UNITS = "Angles are shown in degrees; everything else in SI units. Positions: x up, y to the right; heading clockwise."
_KINDS = {"turn": "Turns", "zigzag": "Zigzags", "stop": "Stops"}


def write_prediction_report(found: Predictions, path: str | Path) -> None:
    """Writes the report of a prediction as one HTML file; whole or not at all."""
    write_file(path, render_prediction(found))


def render_prediction(found: Predictions) -> str:
    """The report as HTML text."""
    album = Album()
    sections = [_summary(found), _planned(found, album), _measured(found, album), _conditions(found)]
    sections += [of_findings(found.findings), of_provenance(found.provenance)]
    facts = [
        ("Model", found.model),
        ("Intervals", f"{100 * found.level:g} %, {found.draws} draws, seed {found.seed}"),
        ("Scale", f"1 : {found.scale:g}, at full scale" if found.scale != 1.0 else ""),
    ]
    kept = [section for section in sections if section is not None]
    synthetic = _SYNTHETIC if found.synthetic else ""
    return page("Prediction", found.study, [fact for fact in facts if fact[1]], kept, synthetic=synthetic, units=_UNITS)


def value_text(value: float, unit: str, digits: int = 3) -> str:
    """A figure as it is read: angles in degrees, shares in per cent; "" where there is none."""
    if unit == "1":
        return f"{100 * value:.0f} %" if math.isfinite(value) else number(value)
    return number(value * shown("", unit).factor, digits)


def unit_text(unit: str) -> str:
    """The unit of `value_text`."""
    return "" if unit == "1" else shown("", unit).unit


def interval_text(row: Any) -> str:
    """ "20.1 to 23.3", or "" where there is no interval."""
    low, high, unit = float(row["lower"]), float(row["upper"]), str(row["unit"])
    if math.isnan(low) or math.isnan(high):
        return ""
    return f"{value_text(low, unit)} to {value_text(high, unit)}"


def _summary(found: Predictions) -> Section:
    blocks: list[Block] = []
    turn = found.figures[(found.figures.kind == "turn") & found.figures.figure.isin(["advance", "tactical_diameter"])]
    said = [
        f"{row['title']}: {value_text(row['value'], row['unit'])} m ({interval_text(row)})"
        for row in turn.to_dict("records")
        if row["manoeuvre"] == turn.manoeuvre.iloc[0]
    ]
    doubtful = any(finding.severity == "warning" for finding in found.findings)
    known = found.measured[found.measured.measured.notna() & found.measured.lower.notna()]
    inside = int(known.inside.astype(bool).sum())
    checked = f"{inside} of {len(known)} measured figures lie inside their intervals. " if len(known) else ""
    held = found.figures.held_by.value_counts()
    parts = [f"{held[name]} by {name}" for name in ("trials", "both", "priors") if name in held]
    sentence = f"{checked}{'Figures are held: ' + ', '.join(parts) + '.' if parts else ''}"
    title = f"{turn.manoeuvre.iloc[0]}: {'; '.join(said)}" if said else "Figures of the trials, measured and predicted"
    blocks.append(Statement(title, sentence or "No manoeuvre was asked for.", "unsure" if doubtful else "sure"))
    grave = [(finding.message, "findings", True) for finding in found.findings if finding.severity == "warning"]
    if grave:
        blocks.append(Notes(grave))
    return Section("summary", "In short", blocks)


def _planned(found: Predictions, album: Album) -> Section | None:
    if not len(found.figures):
        return None
    wider = [
        f", and {100 * error:.2g} % (standard deviation) {what}"
        for error, what in (
            (found.model_error, "by which figures of the fitted trials miss"),
            (found.form_error, "for the model's form beyond the trials"),
        )
        if error > 0.0
    ]
    words = (
        "Value: at the estimate. Interval: what the trials and the priors leave open of the parameters"
        f"{''.join(wider)}. Held by: on what a figure rests, by the priors' share of its variance as the fit weighs "
        "trials and priors. A figure held by priors is as good as these are."
    )
    blocks: list[Block] = [Text(words)]
    pictures = []
    for label, part in found.figures.groupby("manoeuvre", sort=False):
        blocks.append(_figures_table(f"{str(label)[:1].upper()}{str(label)[1:]}", part))
        pictures.append(
            album.picture(
                figures.predicted_tracks(found, str(label)),
                f"Tracks of a {label} by the estimate and by drawn ships",
                f"{label}: the estimate over ships drawn from what it leaves open.",
            )
        )
    blocks.append(Pictures(pictures))
    return Section("manoeuvres", "Predicted manoeuvres", blocks)


def _figures_table(title: str, part: pd.DataFrame) -> Block:
    columns = [
        Column("figure"),
        Column("value", "number"),
        Column("interval", "number"),
        Column("unit"),
        Column("held by"),
        Column("share of priors", "number", "part of the variance that the priors make"),
        Column("draws without", "number"),
        Column("why none", "long"),
    ]
    rows = [
        [
            str(row["title"]),
            value_text(row["value"], row["unit"]),
            interval_text(row),
            unit_text(row["unit"]),
            str(row["held_by"]),
            _percent(row["prior_share"]),
            _percent(row["missing"]) if row["missing"] > 0 else "",
            str(row["why"]),
        ]
        for row in part.to_dict("records")
    ]
    return table(title, columns, rows)


def _measured(found: Predictions, album: Album) -> Section | None:
    if not len(found.measured):
        return None
    words = (
        "Turns and stops are sailed under the recorded inputs from the first samples of the manoeuvre on; zigzags "
        "anew, reversed by the ship's own heading where the recorded ones were. Trials held out took no part in "
        "the fit."
    )
    blocks: list[Block] = [Text(words)]
    pictures = []
    for kind in figures.kinds(found):
        alt = f"Measured figures of {_KINDS[kind].lower()} beside their predicted intervals"
        pictures.append(album.picture(figures.measured_beside_predicted(found, kind), alt, f"{_KINDS[kind]}."))
    if pictures:
        blocks.append(Pictures(pictures, wide=True))
    columns = [
        Column("trial"),
        Column("role"),
        Column("figure"),
        Column("measured", "number"),
        Column("predicted", "number"),
        Column("interval", "number"),
        Column("unit"),
        Column("inside"),
        Column("held by"),
        Column("why none", "long"),
    ]
    for label, part in found.measured.groupby("kind", sort=False):
        rows = [
            [
                str(row["trial"]),
                "held out" if row["role"] == "holdout" else "fitted",
                str(row["title"]),
                value_text(row["measured"], row["unit"]),
                value_text(row["predicted"], row["unit"]),
                interval_text(row),
                unit_text(row["unit"]),
                _inside(row),
                str(row["held_by"]),
                str(row["why"]),
            ]
            for row in part.to_dict("records")
        ]
        blocks += [Heading(_KINDS[str(label)]), table(f"{_KINDS[str(label)]}, measured and predicted", columns, rows)]
    return Section("measured", "Measured beside predicted", blocks)


def _inside(row: Any) -> str:
    if math.isnan(float(row["measured"])) or math.isnan(float(row["lower"])):
        return ""
    return "yes" if row["inside"] else "no"


def _conditions(found: Predictions) -> Section | None:
    given = found.conditions
    if not given:
        return None
    rows = [
        ["approach speed", number(given["speed"]), "m/s"],
        *([f"input {name}", number(value), unit_text(given["units"][name])] for name, value in given["inputs"].items()),
        ["rudder rate", number(math.degrees(given["rudder_rate"])) if "rudder_rate" in given else "", "deg/s"],
        ["time limit", number(given["limit"]), "s"],
        ["step", number(given["dt"]), "s"],
        ["effects of the environment taken away", ", ".join(given["without"]), ""],
        ["variance of the trials' part for their disagreement, times", number(max(1.0, found.lack_of_fit)), ""],
        ["error of the model, from misses of the fitted figures", number(100 * found.model_error), "%"],
        ["error of the model's form beyond the trials", number(100 * found.form_error), "%"],
    ]
    kept = [row for row in rows if row[1]]
    return Section(
        "conditions",
        "Conditions",
        [table("Conditions of the manoeuvres", [Column("what"), Column("is"), Column("unit")], kept)],
    )


def _percent(share: float) -> str:
    return "" if math.isnan(share) else f"{100 * share:.0f} %"
