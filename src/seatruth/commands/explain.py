"""`seatruth explain CODE`: what an error, a finding, an effect or a verdict means, and what to do about it."""

from __future__ import annotations

import dataclasses
from typing import Annotated

import typer

from seatruth.codes import Code, codes
from seatruth.commands.common import JsonFile, Result, say
from seatruth.commands.list_installed import effect_entry, show_details
from seatruth.errors import BadInput, nearest

_NEAR = 0.75
"""Likeness of a word to a code of which one letter in four is wrong, or two that are exchanged. [S]"""
_VERDICTS = {
    "effects": "A diagnosis names causes, each of which is one effect.",
    "inseparable": "A diagnosis names a set of effects that look alike in these trials: one of them acts.",
    "no_gap": "A diagnosis finds no cause, and these trials could have shown most effects: the model may be believed "
    "where it was tried.",
    "underpowered": "A diagnosis cannot decide: neither a cause nor its absence reaches its probability. It lists the "
    "smallest magnitudes that would have shown, and suggests what to sail.",
    "unknown": "A diagnosis finds that something acts which no effect of the library explains: it says where, and in "
    "what form.",
}
"""Kinds of verdict, which stand in results as codes do; docs/diagnosis.md says more."""


def explain(
    code: Annotated[
        str, typer.Argument(metavar="CODE", help="The word in brackets behind an error or a finding, or an effect.")
    ],
    json_file: JsonFile = None,
) -> Result:
    """Say what an error, a finding, an effect or a kind of verdict means, and what to do."""
    from seatruth.effects import available

    known, effects = codes(), available()
    if code in effects and code not in known:
        entry = effect_entry(effects[code])
        show_details(entry)
        return Result(entry)
    if code in _VERDICTS:
        say(f"{code} (verdict)", style="bold")
        say(_VERDICTS[code])
        return Result({"name": code, "kind": "verdict", "about": _VERDICTS[code], "causes": []})
    if code not in known:
        hint = (
            nearest(code, [*known, *effects, *_VERDICTS], likeness=_NEAR)
            or "All codes stand in the documentation, under Codes."
        )
        raise BadInput(f"there is no code {code!r}", where="explain", do=hint)
    _show(known[code])
    return Result(dataclasses.asdict(known[code]))


def _show(code: Code) -> None:
    say(f"{code.name} ({code.kind})", style="bold")
    if code.about:
        say(code.about)
    for cause in code.causes:
        say("")
        say(f"{cause.severity}: {cause.message}" if code.kind == "finding" else cause.message)
        if cause.remedy:
            say(f"  What to do: {cause.remedy}")
