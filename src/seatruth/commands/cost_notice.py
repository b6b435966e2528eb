"""What a command says of an expensive simulator before it starts: how many runs, and how long."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from seatruth.commands.common import note
from seatruth.errors import BadInput
from seatruth.models.isolated import isolated_in
from seatruth.study import Study

if TYPE_CHECKING:
    from seatruth.effects import Effect


def say_cost(
    study: Study,
    effects: Sequence[Effect | str] | None,
    what: str = "",
    *,
    evaluations: int | None = None,
    threads: int | None = None,
) -> list[dict[str, Any]]:
    """Says what a search will cost, on standard error, and gives it as `--json` has it; nothing for equations.

    `what` is "identify" or "diagnose"; both where it is empty.
    """
    if isolated_in(study.model) is None:
        return []
    from seatruth.cost_forecast import forecast

    try:
        found = forecast(study, effects, evaluations=evaluations, threads=threads)
    except BadInput:  # the command itself says what is wrong
        return []
    shown = [one for one in found if what in ("", one.what)]
    for one in shown:
        note(str(one))
    return [{**asdict(one), "seconds": one.seconds} for one in shown]
