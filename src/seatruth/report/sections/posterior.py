"""The section about the posterior: how far the sample can be relied on, its intervals, the corner and trace plots."""

from __future__ import annotations

import math

from seatruth.report import figures
from seatruth.report.blocks import Block, Column, Pictures, Section, Table, Text, table
from seatruth.report.figures.posterior import MOST_CORNER, corner_names
from seatruth.report.numbers import count, interval, listed, number, percent
from seatruth.report.sections.pictures import Album
from seatruth.report.view import View
from seatruth.statistics.posterior_sample import ENOUGH_TIMES
from seatruth.uncertainty.profile import profile_verdict

_MOST_CHAINS = 8


def posterior(data: View, album: Album) -> Section | None:
    """The sample of the posterior."""
    found = data.posterior
    names = [str(name) for name in data.parameters.index if found is not None and name in found.summary.index]
    if found is None or not names:
        return None
    enough = "which is enough" if found.long_enough else "which is too short: do not rely on the intervals"
    kept = f"{count(found.walkers, 'walker')} took {count(found.steps, 'step')}; the first {found.burn_in} are left out"
    blocks: list[Block] = [
        Text(
            f"The density is likelihood times priors, uniform where a parameter has bounds alone. {kept}. After them "
            f"the chain has {number(found.times, 3)} autocorrelation times (at least {number(ENOUGH_TIMES, 2)} are "
            f"needed), {enough}. {percent(found.acceptance)} of the proposals were accepted. Residuals count as "
            "independent here; the linear interval allows for their autocorrelation."
        ),
        _intervals(data, names),
    ]
    shown = corner_names(data)
    if shown:
        more = f" Shown: {MOST_CORNER} of {len(shown)}, the most correlated." if len(shown) > MOST_CORNER else ""
        blocks.append(
            Pictures(
                [
                    album.picture(
                        figures.corner(data),
                        f"Corner plot of the posterior of {listed(shown[:MOST_CORNER])}. The table above has the "
                        "intervals.",
                        "Draws of each parameter and of each pair. Where the tinted regions leave the dashed ellipse "
                        f"the standard errors mislead.{more}",
                    )
                ]
            )
        )
    pictures = [
        album.picture(figures.chains(data, [name]), f"Values of {name} over the steps of the walkers.")
        for name in names[:_MOST_CHAINS]
    ]
    more = f" Shown: {_MOST_CHAINS} of {len(names)} parameters." if len(names) > _MOST_CHAINS else ""
    blocks.append(
        Text(
            "The walkers over the steps: their median, where 95 % of them are, and two of them one by one. Grey at "
            f"the left is what is left out. Behind it nothing may drift or change its width.{more}"
        )
    )
    blocks.append(Pictures(pictures))
    return Section("posterior", "Posterior", blocks)


def _intervals(data: View, names: list[str]) -> Table:
    assert data.posterior is not None
    columns = [
        Column("parameter"),
        Column("unit"),
        Column("median", "number"),
        Column("std. deviation", "number"),
        Column("95 % by posterior", "number"),
        Column("95 % by profile", "number"),
        Column("95 % linear", "number"),
        Column("autocorrelation time", "number", "steps"),
        Column("effective samples", "number"),
    ]
    rows = []
    for name in names:
        row, linear = dict(data.posterior.summary.loc[name]), dict(data.parameters.loc[name])
        rows.append(
            [
                name,
                "" if linear["unit"] == "1" else str(linear["unit"]),
                number(row["median"], 4),
                number(row["sd"], 2),
                by_posterior(data, name),
                by_profile(data, name),
                interval(linear["lower"], linear["upper"], linear["stderr"]),
                number(row["autocorrelation_time"], 2),
                f"{row['effective_samples']:.0f}" if math.isfinite(row["effective_samples"]) else "",
            ]
        )
    return table("95 % intervals beside each other", columns, rows)


def by_posterior(data: View, name: str) -> str:
    """The 95 % interval of a parameter by the posterior; "" without one."""
    if data.posterior is None or name not in data.posterior.summary.index:
        return ""
    row = dict(data.posterior.summary.loc[name])
    return interval(float(row["lower"]), float(row["upper"]), float(row["sd"]))


def by_profile(data: View, name: str) -> str:
    """The 95 % interval of a parameter by its profile, "none" at an open end; "" without one."""
    if name not in data.profile:
        return ""
    found = profile_verdict(data.profile[name])
    ends = [number(end, 4) if math.isfinite(end) else "none" for end in (found.lower, found.upper)]
    return f"{ends[0]} to {ends[1]}"
