"""Expressions of parameters and constraints are arithmetic; anything else is refused before it is evaluated."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from seatruth.expression import Expression, Relation
from seatruth.models.parameter import Parameter
from seatruth.study.validation import Problems


def check(parameters: Sequence[Parameter], constraints: Sequence[str], problems: Problems) -> None:
    """Notes every `expr` and constraint that is not arithmetic over the parameters, and circular expressions."""
    names = [parameter.name for parameter in parameters]
    used: dict[str, set[str]] = {}
    for parameter in parameters:
        if parameter.expr is not None:
            with problems.at("parameters", parameter.name, "expr"):
                used[parameter.name] = arithmetic(parameter.expr, names)
    for name in used:
        if name in _reached(name, used):
            problems.add(
                ("parameters", name, "expr"), f"the expression of {name!r} leads back to itself", "Free one of them."
            )
    for position, text in enumerate(constraints):
        with problems.at("model", "constraints", position):
            relation(text, names)


def arithmetic(text: str, names: Collection[str]) -> set[str]:
    """The names that an arithmetic expression uses; BadInput if it is anything else."""
    return set(Expression(text, names).names)


def relation(text: str, names: Collection[str]) -> set[str]:
    """The names that a relation between arithmetic expressions uses, as "Y_v * N_r > 0" or "0 < a < b"."""
    return set(Relation(text, names).names)


def _reached(start: str, used: dict[str, set[str]]) -> set[str]:
    """Every parameter on which an expression depends, directly or through other expressions."""
    reached: set[str] = set()
    ahead = list(used.get(start, ()))
    while ahead:
        name = ahead.pop()
        if name not in reached:
            reached.add(name)
            ahead.extend(used.get(name, ()))
    return reached
