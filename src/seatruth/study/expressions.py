"""Ties and constraints are arithmetic: anything else in them is refused before it could be evaluated by anyone."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from seatruth.expression import Expression, Relation
from seatruth.models.parameter import Parameter
from seatruth.study.validation import Problems


def check(parameters: Sequence[Parameter], constraints: Sequence[str], problems: Problems) -> None:
    """Notes every tie and constraint that is not arithmetic over the parameters, and ties that go in circles."""
    names = [parameter.name for parameter in parameters]
    ties: dict[str, set[str]] = {}
    for parameter in parameters:
        if parameter.tie is not None:
            with problems.at("parameters", parameter.name, "tie"):
                ties[parameter.name] = arithmetic(parameter.tie, names)
    for name in ties:
        if name in _reached(name, ties):
            problems.add(("parameters", name, "tie"), f"the ties of {name!r} lead back to itself", "Free one of them.")
    for position, text in enumerate(constraints):
        with problems.at("model", "constraints", position):
            relation(text, names)


def arithmetic(text: str, names: Collection[str]) -> set[str]:
    """The names that an arithmetic expression uses; BadInput if it is anything else."""
    return set(Expression(text, names).names)


def relation(text: str, names: Collection[str]) -> set[str]:
    """The names that a relation between arithmetic expressions uses, as "Y_v * N_r > 0" or "0 < a < b"."""
    return set(Relation(text, names).names)


def _reached(start: str, ties: dict[str, set[str]]) -> set[str]:
    """Every parameter that a tie depends on, directly or through other ties."""
    found: set[str] = set()
    ahead = list(ties.get(start, ()))
    while ahead:
        name = ahead.pop()
        if name not in found:
            found.add(name)
            ahead.extend(ties.get(name, ()))
    return found
