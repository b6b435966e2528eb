"""The score page: one HTML file that stands alone, in the style of the library's reports."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

from markupsafe import Markup
from matplotlib.figure import Figure

from seatruth.report.blocks import Block, Column, Notes, Picture, Pictures, Section, Statement, Text, table
from seatruth.report.figures.svg import svg
from seatruth.report.page import page
from withheld.commits import commits
from withheld.goals import measures
from withheld.intervals import wilson
from withheld.markdown import answer
from withheld.measures import Measure, Pair, closures, confusion, groups, stated, top
from withheld.names import TITLES as WORDS
from withheld.pictures import confusion_figure, kept_figure, reliability_figure, strata_figure
from withheld.score import BY, INSIDERS, LIBRARY, LIMIT, encoded
from withheld.seal import write

SYNTHETIC = "Every case was made by a simulator of the benchmark's own. Nothing here was measured at sea."
SETS = {"dev": "development", "test": "frozen test"}
EXPECTED = ("seatruth", "rmse", "bic", "white", "sindy", "classifier", "orthogonal", "prior")
"""Programs that a full score holds."""


def write_page(out: Path, pairs: Mapping[str, Sequence[Pair]]) -> None:
    """Writes score.html from the pairs of every program."""
    content = json.loads((out / "score.json").read_text(encoding="utf-8"))
    prior, best = ({truth["case"]: own for truth, own in pairs.get(name, [])} for name in ("prior", LIMIT))
    found = {name: measures(of, prior, best) for name, of in pairs.items()}
    first = LIBRARY if LIBRARY in pairs else next(iter(pairs))
    sections = [
        _summary(content, found[first], pairs, first),
        _parts(content, found[first], first),
        _baselines(found, pairs),
        _strata(pairs),
        _which(pairs[first], first),
        _sure(pairs, first),
        _closure(pairs[first], first),
        _cases(content["cases"], list(pairs), first),
        protocol(content),
    ]
    cases = content["cases"]
    end = max(datetime.fromisoformat(line["time"]) for line in content["log"])
    facts = [
        ("Set", SETS[content["set"]]),
        ("Cases", f"{len(cases)} of {content['sealed']} that are sealed, synthetic"),
        ("Families", ", ".join(sorted({case["family"] for case in cases}))),
        ("Commit of the diagnosis", commit_of(content["log"], first)),
        ("Scored", f"{end:%Y-%m-%d}"),
    ]
    write(out / "score.html", page("Withheld-effect benchmark", "Score", facts, sections, synthetic=SYNTHETIC))


def interval(one: Measure) -> str:
    """A measure with its interval and cases."""
    return f"{_value(one)}, n {one.n}" if _value(one) else ""


def _value(one: Measure) -> str:
    if not one.n or not math.isfinite(one.value):
        return ""
    return f"{one.value:.2f}" + (f" ({one.low:.2f} to {one.high:.2f})" if math.isfinite(one.low) else "")


def _summary(
    content: Mapping[str, Any], found: Sequence[Measure], pairs: Mapping[str, Sequence[Pair]], first: str
) -> Section:
    judged = [one for one in found if one.met is not None]
    met = sum(bool(one.met) for one in judged)
    kinds = groups(pairs[first], "kind")
    count = {name: len(of) for name, of in kinds.items()}
    words = {
        "single": "one cause", "double": "two causes", "none": "none", "outside": "one that is not in its library",
        "confounded": "one that its trials can hardly tell from others",
        "form": "another form of hull, damping or wake", "form+single": "another form and one effect on top",
    }  # fmt: skip
    asked = ", ".join(f"{text}: {count[name]}" for name, text in words.items() if name in count)
    blocks: list[Block] = []
    if content["doubts"]:
        blocks.append(Statement("Not to be published", f"{'; '.join(content['doubts'])}.", "wrong"))
    blocks += [
        Statement(
            f"{WORDS[first]} meets {met} of the {len(judged)} goals that these {len(pairs[first])} cases can judge",
            "Does the diagnosis find what a simulator lacks, without being told? Trials were made by an independent "
            "simulator in which something acts that the model does not hold. The diagnosis saw the trials and the "
            "model alone; its verdicts were hashed before the causes were unsealed.",
            "sure" if met == len(judged) else "unsure" if met else "wrong",
        ),
        _main(found),
        Text(
            f"Cases by what was withheld: {asked}. lambda is the squared size of a cause in standard deviations of the "
            "noise, after everything that refitting the model can take up is taken out. Values stand with 95 % "
            "intervals (Wilson for shares, bootstrap over cases for others). (open): the interval holds the goal."
        ),
    ]
    missing = [WORDS[name] for name in EXPECTED if name not in pairs]
    failed = sum(1 for _, own in pairs[first] if own.get("failed"))
    notes = [(f"Not run on this set: {', '.join(missing)}" + _why(content, missing) + ".", "", True)] if missing else []
    if failed:
        notes.append(
            (f"{WORDS[first]} ended without a verdict on {failed} cases, which count as wrong.", "cases", True)
        )
    weak = [case["case"] for case in content["cases"] if case["stratum"] == "<9"]
    if weak:
        notes.append((f"Of {len(weak)} cases the cause has a lambda below 9, the largest that is believable there; "
                      "they count in no measure by lambda.", "cases", False))  # fmt: skip
    return Section("summary", "What was measured", [*blocks, *([Notes(notes)] if notes else [])])


def _why(content: Mapping[str, Any], missing: Sequence[str]) -> str:
    left = [f"{line['program']}: {line['why']}" for line in content["log"] if line["what"] == "left out"]
    return f" ({'; '.join(dict.fromkeys(left))})" if left and missing else ""


def _main(found: Sequence[Measure]) -> Block:
    columns = [Column("measure", "long"), Column("answer"), Column("value (95 % interval)"), Column("goal"),
               Column("cases", "number"), Column("in words", "long")]  # fmt: skip
    rows = []
    for one, row in zip(found, encoded(found), strict=True):
        said = answer(row)
        sign = "● " if said.startswith("met") else "✖ " if said.startswith("missed") else ""
        rows.append([one.name, sign + said, _value(one), one.goal, str(one.n), one.says])
    return table("Every measure", columns, rows)


def _parts(content: Mapping[str, Any], found: Sequence[Measure], first: str) -> Section:
    blocks: list[Block] = [
        Text(f"{WORDS[first]}: the same measures on parts of the cases. Where a part has no case for a measure, its "
             "cell is empty; with few cases intervals are wide.")
    ]  # fmt: skip
    titles = {"stratum": "By stratum of lambda", "family": "By family of vehicles", "kind": "By what was withheld",
              "stated": "By whether the study states the noise of the data sheet",
              "aside": "By whether the family was set aside until the method was frozen"}  # fmt: skip
    for key in BY:
        parts = content["parts"][key]
        columns = [Column("measure", "long"), Column("goal"), *(Column(name, "number") for name in parts)]
        rows = [
            [one.name, one.goal, *(_cell(of[k]) for of in parts.values())]
            for k, one in enumerate(found)
            if any(of[k]["n"] for of in parts.values())
        ]
        blocks.append(table(titles[key], columns, rows))
    return Section("parts", "By strength, family and kind", blocks)


def _cell(one: Mapping[str, Any]) -> str:
    if not one["n"] or one["value"] is None:
        return ""
    span = "" if one["low"] is None else f" ({one['low']:.2f} to {one['high']:.2f})"
    return f"{one['value']:.2f}{span}, n {one['n']}"


def _baselines(found: Mapping[str, Sequence[Measure]], pairs: Mapping[str, Sequence[Pair]]) -> Section:
    columns = [Column("measure", "long"), Column("goal"), *(Column(WORDS[name], "number") for name in found)]
    rows = [
        [one.name, one.goal, *(interval(of[k]) for of in found.values())]
        for k, one in enumerate(next(iter(found.values())))
    ]
    right = [Column("cases", "long"), Column("", "number"), *(Column(WORDS[name], "number") for name in pairs)]
    lines = []
    for key in BY:
        for group, own in groups(next(iter(pairs.values())), key).items():
            line = [f"{key} {group}", str(len(own))]
            for of in pairs.values():
                part = groups(of, key).get(group, [])
                hits = sum(top(pair, 1) for pair in part)
                low, high = wilson(hits, len(part))
                line.append(f"{hits / len(part):.2f} ({low:.2f} to {high:.2f})" if part else "")
            lines.append(line)
    return Section(
        "baselines",
        "Beside simple programs, the limit and the oracle",
        [
            Text("The same cases, diagnosed by simple programs: the worst channel blamed for what it is known for; one "
                 "refit for each effect compared by BIC; signatures against unrefitted residuals, noise taken as "
                 "white; a sparse formula of what accelerations are left (SINDy); a random forest trained on draws of "
                 "the study's own model with each effect; a Gaussian process orthogonal to the model's parameters, "
                 "whose mean is compared with each effect's signatures; and the prior, which sees no data. "
                 "The limit knows reality's forms, noise and priors, and compares all causes by their evidence, to "
                 "first order: what the best possible program would say. The oracle knows the cause."),
            table("All measures, value with 95 % interval", columns, rows),
            table("First candidate exactly right (none, the effect, both effects, outside the library)", right, lines),
        ],
    )  # fmt: skip


def _strata(pairs: Mapping[str, Sequence[Pair]]) -> Section:
    figure = strata_figure({WORDS[name]: of for name, of in pairs.items() if name not in INSIDERS})
    return Section(
        "strata",
        "The stronger, the surer",
        [picture(figure, "Share right by stratum of lambda, one effect", "strata",
                 "One effect: share of cases with the right first candidate, by the referee's lambda, with 95 % "
                 "intervals. Programs stand beside each other at each stratum.")],
    )  # fmt: skip


def _which(pairs: Sequence[Pair], first: str) -> Section:
    figure = confusion_figure(confusion(pairs))
    return Section(
        "which",
        "What is taken for what",
        [
            Text(f"{WORDS[first]}: truth down, first candidate across; cases with at most one cause. Framed cells on "
                 "the diagonal are right. Columns of causes that were never named are left out."),
            picture(figure, "Confusion matrix", "confusion", "Number of cases; the shade is the share of the row.",
                    wide=True),
        ],
    )  # fmt: skip


def _sure(pairs: Mapping[str, Sequence[Pair]], first: str) -> Section:
    said = {name: [one for pair in of if (one := stated(pair))] for name, of in pairs.items() if name not in INSIDERS}
    return Section(
        "sure",
        "How sure, how right",
        [
            Text("Stated probability of the first candidate against the share that was right. On the line, "
                 "probabilities mean what they say; below it, they are too sure."),
            picture(reliability_figure({WORDS[name]: of for name, of in said.items() if of}, WORDS[first]),
                    "Reliability diagram", "reliability",
                    f"Bins of a tenth, with 95 % intervals for {WORDS[first]} and its cases beside each point. The "
                    "band holds 95 % of what chance would show of perfect probabilities with as many cases."),
        ],
    )  # fmt: skip


def _closure(pairs: Sequence[Pair], first: str) -> Section:
    rows = closures(pairs)
    blocks: list[Block] = [
        Text("Share of the gap on trials left out that closes, starting from the refitted model. The oracle knows the "
             "cause, and fits its size and the coefficients to the other trials. What those leave open about a trial "
             "counts as noise of its prediction. Cases in which the oracle closes less than a fifth are left out.")
    ]  # fmt: skip
    if rows:
        caption = f"{WORDS[first]}, with its 95 % intervals; on the line it closes what the oracle closes."
        blocks.append(picture(kept_figure(rows), "Closure against the oracle's", "closure", caption))
    else:
        blocks.append(Text(f"{WORDS[first]} states no closure."))
    return Section("closure", "How far the gap closes", blocks)


def _cases(cases: Sequence[Mapping[str, Any]], programs: Sequence[str], first: str) -> Section:
    columns = [Column(name) for name in ("case", "right", "family", "kind")]
    columns += [Column("truth", "long"), Column("lambda", "number"), Column(WORDS[first], "long")]
    columns += [Column("not to be told from", "long")]
    rows = [
        [
            case["case"], case.get("right", {}).get(first, ""), case["family"], case["kind"],
            " + ".join(case["effects"]) or "nothing", ", ".join(f"{value:.0f}" for value in case["lambda"].values()),
            case.get(first, ""), _others(case),
        ]
        for case in cases
    ]  # fmt: skip
    simple = [name for name in programs if name not in (first, *INSIDERS)]
    more = [[case["case"], " + ".join(case["effects"]) or "nothing", *(case.get(name, "") for name in simple)]
            for case in cases]  # fmt: skip
    own = [Column("case"), Column("truth", "long"), *(Column(WORDS[name], "long") for name in simple)]
    return Section(
        "cases",
        "Every case",
        [
            Text("Truth, verdict, first candidate and its probability; ● is right, ✖ is not."),
            table("Truth and verdict", columns, rows),
            *([table("What the simple programs said", own, more, folded=True)] if simple else []),
        ],
    )


def _others(case: Mapping[str, Any]) -> str:
    others = [name for name in case.get("set", []) if name not in case["effects"]]
    return ", ".join(others) if len(others) <= 6 else f"{len(others)} effects"


def protocol(content: Mapping[str, Any]) -> Section:
    """The order of the steps, from the log."""
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
            table("Order of the steps", columns, rows, folded=True),
        ],
    )  # fmt: skip


def commit_of(log: Sequence[Mapping[str, Any]], first: str) -> str:
    """The commits with which a program diagnosed."""
    return ", ".join(commits(log, "diagnose", first))


def picture(figure: Figure, alt: str, key: str, caption: str, *, wide: bool = False) -> Pictures:
    """One figure with its caption."""
    return Pictures([Picture(Markup(svg(figure, alt, key)), caption, wide)], wide=wide)
