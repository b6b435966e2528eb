"""Sections about the parameters: estimates, what cannot be separated, correlation, sensitivity, profiles."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import pandas as pd

from seatruth.report import figures
from seatruth.report.blocks import Block, Column, Pictures, Section, Table, Text, table
from seatruth.report.figures.estimates import MOST_CORRELATED, correlated
from seatruth.report.numbers import count, estimate, interval, listed, number, shown
from seatruth.report.readings import strong_pairs
from seatruth.report.sections.pictures import Album
from seatruth.report.sections.posterior import by_posterior, by_profile
from seatruth.report.view import View, finite
from seatruth.text import origin_legend
from seatruth.uncertainty.profile import profile_verdict

_STRONG = 0.9
_MOST_PAIRS = 12
_MOST_PROFILES = 24
_SMALL_PART = 0.1
"""Coefficients of a combination below this part of its largest are left out of its formula."""


def estimates(data: View, album: Album) -> Section | None:
    """The parameters with their intervals."""
    frame = data.parameters
    if not len(frame):
        return None
    blocks: list[Block] = [
        Text(
            "The last digit shown is the second significant digit of the standard error. The interval holds the true "
            "value in 95 of 100 such experiments if the model is right; autocorrelation of the residuals is allowed "
            "for. CRLB: the standard error that these trials would give if the residuals were white noise."
        ),
        _table("Free parameters", frame, folded=False, data=data),
    ]
    pictures = []
    if (np.isfinite(frame["start"]) & (frame["start"] != 0) & np.isfinite(frame["value"])).any():
        left_out = [str(name) for name in frame.index[(frame["start"] == 0).to_numpy()]]
        note = f" {listed(left_out)} started from 0 and cannot be shown so." if left_out else ""
        pictures.append(
            album.picture(
                figures.parameters(data, against="start"),
                f"Change of {count(len(frame), 'parameter')} from the start in percent, with 95 % intervals. "
                "The table above has the numbers.",
                f"Estimates and 95 % intervals as change from the start. Arrows: it extends beyond the figure.{note}",
            )
        )
    if (np.isfinite(frame["min"]) & np.isfinite(frame["max"])).any():
        pictures.append(
            album.picture(
                figures.parameters(data, against="bounds"),
                "Place of each estimate and its 95 % interval between its bounds. The table above has the numbers.",
                "The same between the bounds. An estimate on a thick line is held there by the bound, not by the data.",
            )
        )
    if pictures:
        blocks.append(Pictures(pictures))
    rows = [[str(name), str(row["description"]), str(row["source"])] for name, row in frame.iterrows()]
    if any(row[1] or row[2] for row in rows):
        columns = [Column("parameter"), Column("meaning", "long"), Column("source of the starting value", "long")]
        blocks.append(table("Meaning and source of each starting value", columns, rows, folded=True))
        if legend := origin_legend(row[2] for row in rows):
            blocks.append(Text(legend))
    if len(data.nuisances):
        blocks.append(_table("Estimated with them: initial states", data.nuisances, folded=True, nuisance=True))
    return Section("parameters", "Parameters", blocks)


def _table(
    caption: str, frame: pd.DataFrame, *, folded: bool, nuisance: bool = False, data: View | None = None
) -> Table:
    """`data` gives the intervals by profile and posterior, where there are any."""
    columns = [
        Column("parameter"),
        Column("value", "number"),
        Column("unit"),
        Column("std. error", "number"),
        Column("95 % interval", "number"),
        Column("verdict", "verdict"),
        Column("start", "number"),
        Column("bounds", "number"),
        Column("prior", "number", "mean ± standard deviation"),
        Column("CRLB", "number", "Cramér-Rao lower bound of the standard error"),
    ]
    rows = [_row(str(name), row, nuisance) for name, row in frame.iterrows()]
    if data is not None:
        columns[5:5] = [Column("95 % by profile", "number"), Column("95 % by posterior", "number")]
        for row in rows:
            row[5:5] = [by_profile(data, row[0]), by_posterior(data, row[0])]
    return table(f"{caption} ({len(rows)})", columns, rows, folded=folded)


def _row(name: str, row: pd.Series[float], nuisance: bool) -> list[str]:
    unit = shown("", str(row["unit"])) if nuisance else None
    factor = unit.factor if unit else 1.0
    value, error, lower, upper, start, low, high, mean, sd, crlb = (
        float(row[key]) * factor
        for key in ("value", "stderr", "lower", "upper", "start", "min", "max", "prior_mean", "prior_sd", "crlb")
    )
    text = "" if str(row["unit"]) == "1" else str(row["unit"])
    bounded = math.isfinite(low) or math.isfinite(high)
    return [
        name,
        estimate(value, error),
        unit.unit if unit else text,
        number(error, 2),
        interval(lower, upper, error),
        "" if nuisance else str(row["verdict"]),
        number(start, 4),
        f"{number(low, 3)} to {number(high, 3)}" if bounded else "",
        f"{number(mean, 4)} ± {number(sd, 2)}" if finite(mean, sd) else "",
        number(crlb, 2),
    ]


def combinations(data: View, album: Album) -> Section | None:
    """What the data cannot separate, and the strongest correlations."""
    pairs = strong_pairs(data, _STRONG)
    if not data.weak and not pairs:
        return None
    blocks: list[Block] = []
    if data.weak:
        condition = (getattr(data.estimate, "identifiability", None) or {}).get("condition")
        note = f" Condition number of the scaled problem: {number(condition, 2)}." if condition else ""
        blocks.append(
            Text(
                "Along each of these combinations the parameters can move together with little change in the fit. Fix "
                f"one of them, give it a prior, or add a trial that moves them apart.{note}"
            )
        )
        rows = [
            [
                str(item.get("sentence", "") or "A combination that the data hardly see."),
                (scaling if item.get("kind") == "scale" else formula)(item.get("combination") or {}),
            ]
            for item in data.weak
        ]
        columns = [
            Column("what it means", "long"),
            Column("combination", "long", "in parameters scaled by their priors, bounds or values"),
        ]
        blocks.append(table("Weakly determined combinations", columns, rows))
    if pairs:
        if not data.weak:
            blocks.append(Text("Read these estimates together: a change of one is largely made up for by the other."))
        columns = [Column("parameter"), Column("and"), Column("correlation", "number")]
        rows = [[a, b, number(value, 3)] for a, b, value in pairs[:_MOST_PAIRS]]
        caption = f"Correlations of at least {number(_STRONG, 1)}"
        if len(pairs) > _MOST_PAIRS:
            caption += f": the {_MOST_PAIRS} strongest of {len(pairs)}"
        blocks.append(table(caption, columns, rows))
    return Section("combinations", "What the data can hardly separate", blocks)


def scaling(powers: Mapping[str, float]) -> str:
    """ "a1 · f, C / f": what can be multiplied by powers of one factor f."""
    terms = []
    for name, power in powers.items():
        size = "" if abs(power) == 1.0 else f"^{number(abs(power), 2)}"
        terms.append(f"{name} {'·' if power > 0 else '/'} f{size}")
    return ", ".join(terms)


def formula(combination: Mapping[str, float]) -> str:
    """ "0.71 Y_v − 0.69 N_v": the terms that matter, the largest first, the first positive."""
    terms = [(str(name), float(value)) for name, value in combination.items() if finite(value)]
    if not terms:
        return ""
    terms.sort(key=lambda term: -abs(term[1]))
    largest = terms[0][1]
    sign = 1.0 if largest >= 0 else -1.0
    kept = [(name, sign * value) for name, value in terms if abs(value) >= _SMALL_PART * abs(largest)]
    if len(kept) == 1:
        return kept[0][0]
    text = " ".join(f"{'+' if value >= 0 else '−'} {number(abs(value), 2)} {name}" for name, value in kept)
    return text.removeprefix("+ ")


def correlation(data: View, album: Album) -> Section | None:
    """Correlation of the estimates."""
    shown_table = correlated(data)
    if len(shown_table) < 2:
        return None
    total = len(correlated(data, most=len(data.parameters)))
    more = f" Of {total} parameters, the {MOST_CORRELATED} with the strongest." if total > MOST_CORRELATED else ""
    values = np.abs(np.nan_to_num(shown_table.to_numpy(copy=True)))
    np.fill_diagonal(values, 0.0)
    i, j = divmod(int(values.argmax()), len(shown_table))
    names = [str(name) for name in shown_table.index]
    strongest = f"The strongest is {number(shown_table.iloc[i, j], 2)} between {names[i]} and {names[j]}."
    picture = album.picture(
        figures.correlation(data),
        f"Heat map of the correlation of {len(names)} parameters. {strongest}",
        f"Correlation of the estimates: near 1 or −1, only a combination of the two is known. {strongest}{more}",
    )
    return Section("correlation", "Correlation of the estimates", [Pictures([picture])])


def sensitivity(data: View, album: Album) -> Section | None:
    """What moves the outputs."""
    values = data.sensitivity.to_numpy(dtype=float)
    if not (np.isfinite(values) & (values > 0)).any():
        return None
    strongest = data.sensitivity.max(axis=1)
    idle = [str(name) for name in strongest.index[(strongest < 0.05).to_numpy()]]
    note = f" Below 0.05 everywhere: {listed(idle)}." if idle else ""
    picture = album.picture(
        figures.sensitivity(data),
        f"Relative sensitivity of {values.shape[1]} outputs to {values.shape[0]} parameters. The most sensitive to is "
        f"{strongest.idxmax()}.",
        "Relative change of an output over the relative change of a parameter, inputs held fixed: 0.5 means that 10 % "
        f"more of the parameter moves the output by 5 % of its mean size.{note}",
    )
    return Section("sensitivity", "Sensitivity of the outputs", [Pictures([picture])])


def profiles(data: View, album: Album) -> Section | None:
    """Profile likelihood."""
    if not data.profile:
        return None
    names = list(data.profile)
    pictures = [
        album.picture(
            figures.profile(data, [name]),
            f"Profile of {name}: least cost above the lowest, for {len(data.profile[name])} values.",
        )
        for name in names[:_MOST_PROFILES]
    ]
    more = f" Shown: {_MOST_PROFILES} of {len(names)}." if len(names) > _MOST_PROFILES else ""
    text = (
        "Each parameter was fixed at several values and all others were fitted again. If the curve is a parabola, the "
        "standard error is reliable; if it is flat or asymmetric, it is not. The dashed line bounds a 95 % "
        "interval if the residuals are white; the shaded interval allows for their autocorrelation, the dotted line "
        f"is the estimate. Where the curve had not risen to the dashed line, it was followed outward.{more}"
    )
    columns = [Column("parameter"), Column("the data leave it"), Column("lower end", "number")]
    columns += [Column("upper end", "number"), Column("linear interval")]
    rows = []
    for name, curve in data.profile.items():
        found = profile_verdict(curve)
        ends = [number(end, 4) if math.isfinite(end) else "none" for end in (found.lower, found.upper)]
        linear = ""
        if name in data.parameters.index:
            row = dict(data.parameters.loc[name])
            if math.isfinite(row["lower"]) and math.isfinite(row["upper"]):
                linear = f"{number(row['lower'], 4)} to {number(row['upper'], 4)}"
        rows.append([name, found.kind, *ends, linear])
    shown = table("Ends of the 95 % intervals by profile", columns, rows)
    return Section("profile", "Profile likelihood", [Text(text), Pictures(pictures), shown])
