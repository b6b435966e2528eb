"""With which commits a set was made and diagnosed, from its log: told when a run goes on, shown with the score."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from withheld.seal import commit, log

CHANGED = "+changes"
"""Stands behind a commit from which the working tree differed."""
Lines = Sequence[Mapping[str, Any]]


def commits(lines: Lines, step: str, program: str = "") -> list[str]:
    """Commits with which a step ran (of one program, if named), in their order, each once."""
    own = [line for line in lines if line["step"] == step and (not program or line.get("program") == program)]
    return list(dict.fromkeys(str(line["commit"]) for line in own))


def told(out: Path, step: str, program: str = "") -> dict[str, Any]:
    """Says when a step goes on with another commit, or in a changed tree; returns what the log is to hold of that."""
    now, before = commit(), commits(log(out), step, program)
    others = [one for one in before if one != now]
    name = program or step
    if others:
        print(
            f"{name}: ATTENTION: begun with {', '.join(others)}, goes on with {now}: the score will say so", flush=True
        )
    if now.endswith(CHANGED):
        print(f"{name}: ATTENTION: the working tree differs from its commit: the score will say so", flush=True)
    return {"begun_with": others} if others else {}


def doubts(lines: Lines, programs: Sequence[str]) -> list[str]:
    """What keeps a score from being one of a single, known state of the code; empty where nothing does."""
    found = []
    for step, program, what in [("generate", "", "the cases"), *(("diagnose", one, one) for one in programs)]:
        own = commits(lines, step, program)
        verb = "were made" if step == "generate" else "was run"
        changed = [one for one in own if one.endswith(CHANGED)]
        if changed:
            found.append(f"{what} {verb} in a working tree that differed from its commit ({', '.join(changed)})")
        if len(own) > 1:
            found.append(f"{what} {verb} with several commits ({', '.join(own)})")
        if not own or any(not one.removesuffix(CHANGED) for one in own):
            found.append(f"{what} {verb} with a commit that is not known")
    return found
