"""What a command says of an expensive simulator before it starts: how many runs, and how long."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from seatruth.commands.common import note
from seatruth.errors import BadInput
from seatruth.models.black_box import BlackBox
from seatruth.models.isolated import isolated_in
from seatruth.study import Study

if TYPE_CHECKING:
    from seatruth.effects import Effect


_SHORT = 10.0
"""s: a search with a function of Python that takes less is not announced. Chosen here [S]."""


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
    if not isinstance(study.model, BlackBox):
        return []
    from seatruth.cost_forecast import forecast

    try:
        found = forecast(study, effects, evaluations=evaluations, threads=threads)
    except BadInput:  # the command itself says what is wrong
        return []
    shown = [one for one in found if what in ("", one.what)]
    own = isolated_in(study.model) is not None
    for one in shown if own else [one for one in shown if not one.seconds < _SHORT]:
        note(str(one))
    return [{**asdict(one), "seconds": one.seconds} for one in shown]
