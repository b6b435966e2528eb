"""The score as a table in Markdown, so that no published figure is typed."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

from seatruth.errors import BadInput
from withheld.commits import commits
from withheld.names import TITLES
from withheld.score import INSIDERS, LIMIT

Row = Mapping[str, Any]


def markdown(out: Path, *, draft: bool = False) -> str:
    """The table of a scored set, and a paragraph that says what was measured, when, and with which commit.

    Raises BadInput where the set was not scored, or where what made it is no single, clean commit, unless `draft` is
    asked for, which says so in its first line.
    """
    file = out / "score.json"
    if not file.exists():
        raise BadInput("the set is not scored", where=str(out), do="Run the score step first.")
    content = json.loads(file.read_text(encoding="utf-8"))
    if "doubts" not in content:
        raise BadInput("the set was scored by an earlier version", where=str(file), do="Run the score step again.")
    doubts: list[str] = content["doubts"]
    if doubts and not draft:
        raise BadInput(f"not to be published: {'; '.join(doubts)}", where=str(file),
                       do="Make the set from one clean commit, or print it with --draft.")  # fmt: skip
    programs: dict[str, list[Row]] = content["programs"]
    first = content["first"]
    simple = [name for name in programs if name not in (first, *INSIDERS)]
    lines = [f"**Draft, not to be published**: {'; '.join(doubts)}.", ""] if doubts else []
    lines += [_about(content, first, simple), ""]
    beside = ["best of the simple programs"] if simple else []
    lines += [row(["measure", "goal", f"{TITLES[first]} (95 % interval)", "cases", "", *beside, "limit"])]
    lines += [row(["---"] * (6 + len(beside)))]
    for k, one in enumerate(programs[first]):
        best = [_best([(name, programs[name][k]) for name in simple], one["goal"])] if simple else []
        limit = programs[LIMIT][k]["value"] if LIMIT in programs else None
        lines.append(
            row([
                one["name"], one["goal"], _value(one), str(one["n"] or ""), answer(one), *best,
                "" if limit is None else f"{limit:.2f}",
            ])
        )  # fmt: skip
    return "\n".join(lines) + "\n"


def answer(one: Row) -> str:
    """Whether a goal is met; "open" is added where the interval holds the goal, so that more cases could turn it."""
    if one["met"] is None:
        return "no case" if one["goal"] and not one["n"] else ""
    return ("met" if one["met"] else "missed") + ("" if one["clear"] else " (open)")


def _about(content: Row, first: str, simple: Sequence[str]) -> str:
    log, cases = content["log"], content["cases"]
    made, run = ", ".join(commits(log, "generate")), ", ".join(commits(log, "diagnose", first))
    end = max(datetime.fromisoformat(line["time"]) for line in log if line["step"] == "diagnose")
    kind = {"dev": "a development set, which may have been looked at", "test": "a test set, scored blind"}
    families = ", ".join(sorted({case["family"] for case in cases}))
    judged = [one for one in content["programs"][first] if one["met"] is not None]
    met = sum(one["met"] for one in judged)
    left = f" Simple programs: {', '.join(TITLES[name] for name in simple)}." if simple else ""
    absent = "" if "sindy" in simple else " SINDy was not run."
    return (
        f"{len(cases)} synthetic cases ({families}), {kind[content['set']]}: made by a simulator of the benchmark's "
        f"own (commit {made}), diagnosed with commit {run}, {end:%Y-%m-%d}. {met} of {len(judged)} goals are met; "
        f"(open) stands where the interval holds the goal.{left}{absent}"
    )


def _value(one: Row) -> str:
    if one["value"] is None:
        return ""
    return f"{one['value']:.2f}" + ("" if one["low"] is None else f" ({one['low']:.2f} to {one['high']:.2f})")


def _best(of: Sequence[tuple[str, Row]], goal: str) -> str:
    """The best value among programs, where a goal says what is better."""
    usable = [(one["value"], TITLES[name]) for name, one in of if one["value"] is not None and one["n"]]
    if not usable or not goal:
        return ""
    value, name = (min if goal.startswith("<") else max)(usable)
    return f"{value:.2f} ({name})"


def row(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cells) + " |"
