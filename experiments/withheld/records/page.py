"""The score page of real cases: tables by run and by case, failures among them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from seatruth.report.blocks import Column, Notes, Section, Text, table
from seatruth.report.page import page
from withheld.measures import Measure
from withheld.names import TITLES as WORDS
from withheld.page import commit_of, interval, picture, protocol
from withheld.records.measures import NEAR
from withheld.records.pictures import degrees, left_out_figure, put_figure, wind_figure
from withheld.score import LIBRARY
from withheld.seal import write

Content = Mapping[str, Any]
Rows = Sequence[Mapping[str, Any]]


def write_page(out: Path, content: Content) -> None:
    """Writes score.html from what score.json holds."""
    first = LIBRARY if LIBRARY in content["rows"] else next(iter(content["rows"]))
    own, runs = content["rows"][first], content["runs"]
    sections = [_summary(content, first)]
    if own["wind"]:
        sections += [_wind(own["wind"], runs), _left_out(runs)]
    sections += [_put(own["put"], first), _calm(content), protocol(content)]
    facts = [
        ("Set", "real records"),
        ("Cases", str(len(content["truths"]))),
        ("Records", ", ".join(sorted({truth["ship"] for truth in content["truths"].values()}))),
        ("Commit of the diagnosis", commit_of(content["log"], first)),
    ]
    write(out / "score.html", page("Withheld-effect benchmark, real records", "Score", facts, sections))


def _summary(content: Content, first: str) -> Section:
    programs = {name: [Measure(**one) for one in of] for name, of in content["programs"].items()}
    columns = [Column("measure", "long"), *(Column(WORDS[name], "number") for name in programs)]
    rows = [
        [one.name, *(interval(of[k]) for of in programs.values())] for k, one in enumerate(programs[first]) if one.n
    ]
    return Section(
        "summary",
        "Summary",
        [
            Text(
                "Recorded runs of two ships. Wind that an anemometer measured was sealed; errors of a sensor were put "
                "into records exactly; a basin is indoors, with calm, deep water. The process that diagnosed could "
                "reach neither the anemometer nor the records without the errors. No model of a ship is exact: an "
                "answer outside the library is never wrong here, and never asked for. Shares with 95 % intervals; n is "
                "the number of cases or runs."
            ),
            table("Shares of cases", columns, rows),
        ],
    )


def _wind(days: Rows, runs: Rows) -> Section:
    columns = [Column("day"), Column("verdict", "long"), *(Column(name, "number") for name in (
        "p(wind)", "p(outside the library)", "share among named", "log-evidence of wind", "estimated, m/s, deg",
        "measured, m/s, deg", "direction off, deg", "speed, ratio", "closure"))]  # fmt: skip
    rows = [
        [
            day["day"], _said(day), f"{day['probability']:.2f}", f"{day['unknown']:.2f}", f"{day['share']:.2f}",
            _number(day["evidence"]), _both(day["estimate"]), _both(day["measured"]), *_off(day["off"]),
            _number(day["closure"]),
        ]
        for day in days
    ]  # fmt: skip
    by_run = [Column("run"), *(Column(name, "number") for name in (
        "measured, m/s, deg", "gusts, m/s", "day's diagnosis off, deg", "ratio", "other runs: m/s, deg", "off, deg",
        "ratio", "run alone: m/s, deg", "off, deg", "ratio"))]  # fmt: skip
    lines = [
        [
            run["run"], _both(run["measured"]), f"{run['measured']['gusts']:.2f}", *_off(run["off_day"]),
            _both(run["of_others"]), *_off(run["off_others"]), _both(run["of_itself"]), *_off(run["off_itself"]),
        ]
        for run in runs
    ]  # fmt: skip
    return Section(
        "wind",
        "Wind, against the anemometer",
        [
            Text(
                "Mean true wind of each run, as the anemometer has it: speed, and the direction towards which it "
                "blows, clockwise from the pond's x axis. Estimated: by the diagnosis of the day; by a fit of "
                "coefficients and a steady wind to all other runs of the day; by the same to the run alone."
            ),
            picture(wind_figure(days, runs), "Measured and estimated wind", "wind",
                    "Components of the wind by day. Estimates beyond the edge sit on it."),
            table("By day", columns, rows),
            table("By run", by_run, lines),
        ],
    )  # fmt: skip


def _left_out(runs: Rows) -> Section:
    columns = [Column("run"), Column("wind estimated", "number"), Column("wind measured", "number")]
    channels = list(next(iter(runs))["errors"]["ship alone"])
    columns += [Column(f"{name}: alone, est., meas.", "number") for name in channels]
    rows = [
        [
            run["run"], f"{run['estimated']:.2f}", f"{run['with_measured']:.2f}",
            *(", ".join(f"{of[name]:.3g}" for of in run["errors"].values()) for name in channels),
        ]
        for run in runs
    ]  # fmt: skip
    return Section(
        "left_out",
        "Does the wind of some runs predict another?",
        [
            Text(
                "Each run is left out of three fits to the others of its day: the ship alone, the ship in a steady "
                "wind that is estimated with it, the ship in the measured wind. Open-loop errors over windows of "
                "100 s, over those of the ship alone, geometric mean over channels; then each channel's root mean "
                "square error (SI units, rad)."
            ),
            picture(left_out_figure(runs), "Error on runs left out", "left_out", "By run; left of the line it helps."),
            table("Errors on runs left out", columns, rows),
        ],
    )  # fmt: skip


def _put(rows: Rows, first: str) -> Section:
    columns = [Column(name, "long" if name in ("verdict", "rise most") else "text") for name in (
        "case", "record", "error", "verdict", "named")]  # fmt: skip
    columns += [Column(name, "number") for name in (
        "p, control", "share among named, control", "rank, control", "log-evidence, control", "rise", "rank of rise",
        "put in", "found", "found in control", "recovered")]  # fmt: skip
    columns.append(Column("rise most", "long"))
    lines = [
        [
            row["case"], row["family"], f"{row['error']} x{row['times']:g}", row["failed"] or _said(row),
            "yes" if row["named"] else "no",
            f"{row['probability']:.2f}, {_number(row['probability_control'])}",
            f"{row['share']:.2f}, {_number(row['share_control'])}",
            f"{row['rank'] or '-'}, {row['rank_control'] or '-'}",
            f"{_number(row['evidence'])}, {_number(row['evidence_control'])}", _number(row["rise"]),
            str(row["rise_rank"] or ""), f"{row['size']:.3g} ({row['parameter']})", _value(row["estimate"]),
            _value(row["estimate_control"]), _number(row["recovered"]), ", ".join(row["rises_most"]),
        ]
        for row in rows
    ]  # fmt: skip
    return Section(
        "put",
        "Errors put into records",
        [
            Text(
                f"{WORDS[first]}. Each case beside its control: the same runs with nothing put in. Share and rank are "
                "those among the named causes, were an answer outside the library ruled out. Log-evidence is that of "
                "the effect alone over none. Recovered: the size found, less the control's where it was fitted there, "
                f"over the size put in; a goal of 1, within {NEAR:.0%}. The library has no name for a log that is "
                "turned; a bias of sway is what comes nearest."
            ),
            picture(put_figure(rows), "Errors put in, by case", "put", "By case; bars are the fit's standard error."),
            table("By case", columns, lines),
        ],
    )  # fmt: skip


def _calm(content: Content) -> Section:
    columns = [Column("record"), Column("model"), Column("program"), Column("verdict", "long")]
    columns += [Column(name, "number") for name in (
        "p(environment)", "p(outside the library)", "environment among named", "closure")]  # fmt: skip
    columns += [Column("first named"), Column("alarm")]
    rows = [
        [
            row["family"], f"fitted to {row['fitted_to']}" if row["fitted_to"] else "published", WORDS[name],
            row["failed"] or _said(row), f"{row['environment']:.2g}", f"{row['unknown']:.2f}",
            _number(row["share_environment"]), _number(row["closure"]), row["first_named"],
            "ALARM" if row["alarm"] else "none",
        ]
        for name, of in content["rows"].items()
        for row in of["calm"]
    ]  # fmt: skip
    return Section(
        "calm",
        "Calm basins: no wind, current, waves, bank or shallow water",
        [
            Text("KVLCC2 indoors, with the published coefficients and with those fitted to the other basin's runs. "
                 "The environment is blamed where it is named, or has a probability of one half."),
            Notes([(f"{row[0]}, {row[1]}, {row[2]}: {row[3]}", "", True) for row in rows if row[-1] == "ALARM"]),
            table("By basin", columns, rows),
        ],
    )  # fmt: skip


def _said(row: Mapping[str, Any]) -> str:
    return f"{row['verdict']}{': ' if row['said'] else ''}{', '.join(row['said'])}"


def _both(wind: Mapping[str, float] | None) -> str:
    return f"{wind['speed']:.2f}, {degrees(wind['towards'])}" if wind else ""


def _off(off: Mapping[str, Any] | None) -> tuple[str, str]:
    return (f"{math.degrees(off['towards']):+.0f}", f"{off['speed']:.2f}") if off else ("", "")


def _number(value: float | None) -> str:
    return "-" if value is None or not math.isfinite(value) else f"{value:.3g}"


def _value(pair: Sequence[float] | None) -> str:
    return f"{pair[0]:.3g} +- {pair[1]:.2g}" if pair else "-"
