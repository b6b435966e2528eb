"""Ties and constraints are arithmetic: anything else in them is refused before it could be evaluated by anyone."""

from __future__ import annotations

import ast
from collections.abc import Collection, Sequence

from seatruth.errors import BadInput, nearest
from seatruth.models.parameter import Parameter
from seatruth.studyfile.problems import Problems

FUNCTIONS = frozenset(
    (
        *("abs", "min", "max", "sqrt", "exp", "log", "sin", "cos", "tan", "asin", "acos", "atan", "atan2"),
        *("sinh", "cosh", "tanh", "hypot", "copysign"),
    )
)
_LONGEST = 500
_OPERATORS = (ast.Add, ast.Sub, ast.Mult, ast.Div, ast.Pow, ast.UAdd, ast.USub)
_RELATIONS = (ast.Lt, ast.LtE, ast.Gt, ast.GtE)


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
    return _walk(_parsed(text), names, text)


def relation(text: str, names: Collection[str]) -> set[str]:
    """The names that a relation between arithmetic expressions uses, as "Y_v * N_r > 0" or "0 < a < b"."""
    tree = _parsed(text)
    if not isinstance(tree, ast.Compare) or not all(isinstance(sign, _RELATIONS) for sign in tree.ops):
        raise BadInput(f"{text!r} is no relation", do='Compare with < <= > or >=, as "Y_v < N_v".')
    return set().union(*(_walk(side, names, text) for side in (tree.left, *tree.comparators)))


def _parsed(text: str) -> ast.expr:
    if len(text) > _LONGEST:
        raise BadInput(f"an expression of {len(text)} characters is too long", do="Shorten it.")
    try:
        return ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, MemoryError, RecursionError):
        raise BadInput(f"{text!r} is no arithmetic expression", do='Write it as "-0.5 * Y_v".') from None


def _walk(node: ast.expr, names: Collection[str], text: str) -> set[str]:
    if isinstance(node, ast.Constant) and isinstance(node.value, (int, float)) and not isinstance(node.value, bool):
        return set()
    if isinstance(node, ast.Name):
        if node.id in names:
            return {node.id}
        raise BadInput(f"{text!r} uses {node.id!r}, which is no parameter of the model", do=nearest(node.id, names))
    if isinstance(node, ast.BinOp) and isinstance(node.op, _OPERATORS):
        return _walk(node.left, names, text) | _walk(node.right, names, text)
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, _OPERATORS):
        return _walk(node.operand, names, text)
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and not node.keywords and node.args:
        if node.func.id not in FUNCTIONS:
            raise BadInput(f"{text!r} uses the function {node.func.id!r}", do=nearest(node.func.id, FUNCTIONS))
        return set().union(*(_walk(argument, names, text) for argument in node.args))
    raise BadInput(f"{text!r} holds more than arithmetic", do="Use numbers, parameters, + - * / ** and functions.")


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
