"""`seatruth explain CODE`: what an error, a finding or an effect means, and what to do about it."""

from __future__ import annotations

import dataclasses
from typing import Annotated

import typer

from seatruth.codes import Code, codes
from seatruth.commands.common import JsonFile, Result, say
from seatruth.commands.list_installed import effect_entry, show_details
from seatruth.errors import BadInput, nearest


def explain(
    code: Annotated[
        str, typer.Argument(metavar="CODE", help="The word in brackets behind an error or a finding, or an effect.")
    ],
    json_file: JsonFile = None,
) -> Result:
    """Say what an error, a finding or an effect means, and what to do."""
    from seatruth.effects import available

    known, effects = codes(), available()
    if code in effects and code not in known:
        entry = effect_entry(effects[code])
        show_details(entry)
        return Result(entry)
    if code not in known:
        hint = nearest(code, [*known, *effects]) or "All codes stand in the documentation, under Codes."
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
