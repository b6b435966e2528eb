"""The score page: one HTML file that stands alone, in the style of the library's reports."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from markupsafe import Markup
from matplotlib.figure import Figure

from seatruth.report.blocks import Column, Notes, Picture, Pictures, Section, Text, table
from seatruth.report.figures.svg import svg
from seatruth.report.page import page
from withheld.intervals import wilson
from withheld.measures import Measure, Pair, confusion, groups, measures, stated, top
from withheld.pictures import confusion_figure, kept_figure, reliability_figure, strata_figure
from withheld.seal import write

SYNTHETIC = "Every case was made by a simulator of the benchmark's own. Nothing here was measured at sea."
LIBRARY = "seatruth"
WORDS = {
    LIBRARY: "seatruth diagnose", "rmse": "worst channel", "bic": "refit per effect, BIC",
    "white": "white, unprojected", "sindy": "SINDy discrepancy", "prior": "prior alone", "oracle": "oracle",
    "kinematics": "sensors' agreement alone",
}  # fmt: skip


def write_page(out: Path, pairs: Mapping[str, Sequence[Pair]]) -> None:
    """Writes score.html from the pairs of every program."""
    content = json.loads((out / "score.json").read_text(encoding="utf-8"))
    prior = {truth["case"]: own for truth, own in pairs.get("prior", [])}
    found = {name: measures(of, prior) for name, of in pairs.items()}
    first = LIBRARY if LIBRARY in pairs else next(iter(pairs))
    sections = [
        _summary(found, first),
        _table(found),
        _strata(pairs, first),
        _which(pairs[first], first),
        _sure(pairs, first),
        _closure(pairs[first], first),
        _cases(content["cases"], first),
        protocol(content),
    ]
    cases = content["cases"]
    facts = [
        ("Set", {"dev": "development", "test": "frozen test"}[content["set"]]),
        ("Cases", str(len(cases))),
        ("Families", ", ".join(sorted({case["family"] for case in cases}))),
        ("Commit of the diagnosis", commit_of(content["log"], first)),
    ]
    write(out / "score.html", page("Withheld-effect benchmark", "Score", facts, sections, synthetic=SYNTHETIC))


def interval(one: Measure) -> str:
    """A measure with its interval and cases."""
    if not one.n or not math.isfinite(one.value):
        return ""
    span = f" ({one.low:.2f}-{one.high:.2f})" if math.isfinite(one.low) else ""
    return f"{one.value:.2f}{span}, n {one.n}"


def _summary(found: Mapping[str, Sequence[Measure]], first: str) -> Section:
    judged = [one for one in found[first] if one.met is not None]
    met = [one for one in judged if one.met]
    notes = [(f"{one.name}: {interval(one)}, goal {one.goal}", "", not one.met) for one in judged]
    return Section(
        "summary",
        "Summary",
        [
            Text(
                f"{WORDS[first]}: {len(met)} of {len(judged)} goals that these cases can judge are met. Values with "
                "95 % intervals; n is the number of cases that a measure rests on. Missed goals are marked."
            ),
            Notes(notes),
        ],
    )


def _table(found: Mapping[str, Sequence[Measure]]) -> Section:
    columns = [Column("measure", "long"), Column("goal"), *(Column(WORDS[name], "number") for name in found)]
    names = [(one.name, one.goal) for one in next(iter(found.values()))]
    rows = [
        [name, goal, *(interval(next(one for one in of if one.name == name)) for of in found.values())]
        for name, goal in names
    ]
    return Section("measures", "Measures", [table("Every program on the same cases", columns, rows)])


def _strata(pairs: Mapping[str, Sequence[Pair]], first: str) -> Section:
    columns = [Column("group"), Column("cases", "number"), *(Column(WORDS[name], "number") for name in pairs)]
    rows = []
    for key in ("stratum", "family", "kind"):
        for group in groups(pairs[first], key):
            line = [f"{key} {group}", str(len(groups(pairs[first], key)[group]))]
            for of in pairs.values():
                own = groups(of, key).get(group, [])
                hits = sum(top(pair, 1) for pair in own)
                low, high = wilson(hits, len(own))
                line.append(f"{hits / len(own):.2f} ({low:.2f}-{high:.2f})" if own else "")
            rows.append(line)
    figure = strata_figure({WORDS[name]: of for name, of in pairs.items()})
    return Section(
        "strata",
        "By strength, family and kind",
        [
            Text("Share of cases whose first candidate is exactly the truth (no effect, the effect, the two effects, "
                 "or outside the library)."),
            picture(figure, "Share right by stratum of lambda, one effect", "strata",
                     "One effect: share of cases with the right first candidate, by the referee's lambda."),
            table("First candidate right", columns, rows),
        ],
    )  # fmt: skip


def _which(pairs: Sequence[Pair], first: str) -> Section:
    figure = confusion_figure(confusion(pairs))
    return Section(
        "which",
        "What is taken for what",
        [
            Text(f"{WORDS[first]}: truth down, first candidate across; cases with at most one cause."),
            picture(figure, "Confusion matrix", "confusion", "Number of cases; the diagonal is right."),
        ],
    )


def _sure(pairs: Mapping[str, Sequence[Pair]], first: str) -> Section:
    said = {
        WORDS[name]: [one for pair in of if (one := stated(pair))] for name, of in pairs.items() if name != "oracle"
    }
    return Section(
        "sure",
        "How sure, how right",
        [
            Text("Stated probability of the first candidate against the share that was right. On the line, "
                 "probabilities mean what they say."),
            picture(reliability_figure({name: of for name, of in said.items() if of}, WORDS[first]),
                     "Reliability diagram", "reliability", "Bins of a tenth; the size of a point goes with its cases."),
        ],
    )  # fmt: skip


def _closure(pairs: Sequence[Pair], first: str) -> Section:
    rows = [
        (truth["oracle"]["closure"], own["closure"])
        for truth, own in pairs
        if truth.get("oracle") and own["closure"] and own["closure"].get("value") is not None
    ]
    blocks: list[Any] = [
        Text("Share of the gap on trials left out that closes, starting from the refitted model. The oracle knows the "
             "cause, and fits its size and the coefficients to the other trials.")
    ]  # fmt: skip
    if rows:
        blocks.append(picture(kept_figure(rows), "Closure against the oracle's", "closure", WORDS[first]))
    else:
        blocks.append(Text(f"{WORDS[first]} states no closure."))
    return Section("closure", "How far the gap closes", blocks)


def _cases(cases: Sequence[Mapping[str, Any]], first: str) -> Section:
    columns = [Column(name) for name in ("case", "family", "kind", "stratum")]
    columns += [Column("truth", "long"), Column("lambda", "number"), Column(WORDS[first], "long")]
    rows = [
        [
            case["case"], case["family"], case["kind"], case["stratum"], " + ".join(case["effects"]) or "none",
            ", ".join(f"{value:.0f}" for value in case["lambda"].values()), case.get(first, ""),
        ]
        for case in cases
    ]  # fmt: skip
    return Section("cases", "Every case", [table("Truth and verdict", columns, rows, folded=True)])


def protocol(content: Mapping[str, Any]) -> Section:
    columns = [Column(name) for name in ("time", "step", "what", "program", "commit")]
    rows = [
        [line["time"], line["step"], line["what"], line.get("program", ""), line["commit"]] for line in content["log"]
    ]
    return Section(
        "protocol",
        "Protocol",
        [
            Text("Cases were made and sealed, then diagnosed where the seal could not be reached, verdicts were "
                 "hashed, and only then was the seal opened. Each line of the log holds the hash of those before it. "
                 f"Seed of the set: {content['seed']}."),
            table("Order of the steps", columns, rows),
        ],
    )  # fmt: skip


def commit_of(log: Sequence[Mapping[str, Any]], first: str) -> str:
    own = [line["commit"] for line in log if line["step"] == "diagnose" and line.get("program") == first]
    return own[-1] if own else ""


def picture(figure: Figure, alt: str, key: str, caption: str) -> Pictures:
    return Pictures([Picture(Markup(svg(figure, alt, key)), caption)])
