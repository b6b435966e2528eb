"""Arithmetic written by a user (expressions of parameters, constraints, formulas): parsed, never run as code.

    Expression("-0.5 * Y_v", names=["Y_v", "N_v"]).evaluate({"Y_v": 3.0})
    Relation("Y_v * N_r > 0", names=...).holds(values)

Only numbers, known names, + - * / ** and a few functions exist. Values may be numbers or arrays, real or complex: on
complex numbers every function continues the real one (abs, min, max and copysign decide by real parts), so that
derivatives can be taken by complex step without any cancellation.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Collection, Mapping
from typing import Any

import numpy as np

from seatruth.errors import BadInput, nearest

Values = Mapping[str, Any]
Evaluate = Callable[[Values], Any]

_LONGEST = 500
_DEEPEST = 200
_TINY = 1e-30
"""The complex step: so small that its square vanishes beside anything."""


def _real(value: Any) -> Any:
    return np.real(value)


def _abs(x: Any) -> Any:
    return np.where(_real(x) < 0, -x, x) if np.iscomplexobj(x) else np.abs(x)


def _least(*values: Any) -> Any:
    found = values[0]
    for value in values[1:]:
        found = np.where(_real(value) < _real(found), value, found)
    return found


def _most(*values: Any) -> Any:
    found = values[0]
    for value in values[1:]:
        found = np.where(_real(value) > _real(found), value, found)
    return found


def _atan2(y: Any, x: Any) -> Any:
    if not (np.iscomplexobj(x) or np.iscomplexobj(y)):
        return np.arctan2(y, x)
    # d atan2 = (x dy - y dx) / (x^2 + y^2), as the imaginary parts are infinitesimal
    a, b = _real(y), _real(x)
    return np.arctan2(a, b) + 1j * (b * np.imag(y) - a * np.imag(x)) / (a * a + b * b)


def _hypot(x: Any, y: Any) -> Any:
    return np.sqrt(x * x + y * y) if np.iscomplexobj(x) or np.iscomplexobj(y) else np.hypot(x, y)


def _copysign(x: Any, y: Any) -> Any:
    return _abs(x) * np.copysign(1.0, _real(y))


def _power(base: Any, exponent: Any) -> Any:
    if isinstance(exponent, float) and abs(exponent) <= 8 and exponent == int(exponent):
        exponent = int(exponent)  # whole powers by multiplication: exact for negative bases, complex ones too
    if isinstance(exponent, int):
        return np.asarray(base) ** exponent if exponent >= 0 else 1.0 / np.asarray(base) ** -exponent
    return np.asarray(base) ** exponent


_FUNCTIONS: dict[str, tuple[Callable[..., Any], int | None]] = {
    "abs": (_abs, 1),
    "min": (_least, None),
    "max": (_most, None),
    "sqrt": (np.sqrt, 1),
    "exp": (np.exp, 1),
    "log": (np.log, 1),
    "sin": (np.sin, 1),
    "cos": (np.cos, 1),
    "tan": (np.tan, 1),
    "asin": (np.arcsin, 1),
    "acos": (np.arccos, 1),
    "atan": (np.arctan, 1),
    "atan2": (_atan2, 2),
    "sinh": (np.sinh, 1),
    "cosh": (np.cosh, 1),
    "tanh": (np.tanh, 1),
    "hypot": (_hypot, 2),
    "copysign": (_copysign, 2),
}
FUNCTIONS = frozenset(_FUNCTIONS)
CONSTANTS = {"pi": math.pi}

_OPERATORS: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: np.add,
    ast.Sub: np.subtract,
    ast.Mult: np.multiply,
    ast.Div: np.divide,
}
_RELATIONS: dict[type[ast.cmpop], Callable[[Any, Any], Any]] = {
    ast.Lt: np.less,
    ast.LtE: np.less_equal,
    ast.Gt: np.greater,
    ast.GtE: np.greater_equal,
}


class Expression:
    """An arithmetic expression over known names.

    `names` are those that it uses, in the order in which they first stand. Raises BadInput for anything that is no
    arithmetic, for unknown names (`what` says what they should have been) and for functions that do not exist.
    """

    def __init__(self, text: str, names: Collection[str], *, what: str = "parameter of the model") -> None:
        self.text = text.strip()
        parser = _Parser(text, names, what)
        self._evaluate = parser.compiled(_parsed(text), 0)
        self.names = tuple(parser.used)

    def evaluate(self, values: Values) -> Any:
        """The expression's value(s): numbers or arrays that fit together. Not-a-number where it has no value."""
        with np.errstate(all="ignore"):
            return self._evaluate(values)

    def derivative(self, values: Values, name: str) -> Any:
        """The exact derivative by one name at real values (complex step)."""
        moved = {**values, name: np.asarray(values[name]) + 1j * _TINY}
        return np.imag(self.evaluate(moved)) / _TINY

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.text!r})"


class Relation:
    """Relations between arithmetic expressions, as "Y_v * N_r > 0" or "0 < a < b"; all of them must hold."""

    def __init__(self, text: str, names: Collection[str], *, what: str = "parameter of the model") -> None:
        self.text = text.strip()
        tree = _parsed(text)
        if not isinstance(tree, ast.Compare) or not all(type(sign) in _RELATIONS for sign in tree.ops):
            raise BadInput(f"{text!r} is no relation", do='Compare with < <= > or >=, as "Y_v < N_v".')
        parser = _Parser(text, names, what)
        self._sides = [parser.compiled(side, 0) for side in (tree.left, *tree.comparators)]
        self._signs = [_RELATIONS[type(sign)] for sign in tree.ops]
        self.names = tuple(parser.used)

    def holds(self, values: Values) -> Any:
        """Whether it holds: bool, or an array of them. False where a side is not a number."""
        with np.errstate(all="ignore"):
            sides = [side(values) for side in self._sides]
            found: Any = True
            for sign, left, right in zip(self._signs, sides, sides[1:]):
                found = np.logical_and(found, sign(left, right))
        return found

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.text!r})"


def equation(text: str) -> tuple[str, str]:
    """The two sides of "D = a * x + b": the name on the left and the expression on the right."""
    name, sign, right = text.partition("=")
    if not sign or not name.strip().isidentifier():
        raise BadInput(f"{text!r} is no equation", do='Write it as "D = a1 * Fr + a2".')
    return name.strip(), right.strip()


def names_in(text: str) -> tuple[str, ...]:
    """Every name that an expression holds, functions and constants apart, in order; BadInput if it does not parse."""
    nodes = [node for node in ast.walk(_parsed(text)) if isinstance(node, ast.Name)]
    nodes.sort(key=lambda node: (node.lineno, node.col_offset))
    return tuple(dict.fromkeys(node.id for node in nodes if node.id not in FUNCTIONS and node.id not in CONSTANTS))


class _Parser:
    """Turns a syntax tree of arithmetic into nested functions, and refuses every other tree."""

    def __init__(self, text: str, names: Collection[str], what: str) -> None:
        self.text, self.names, self.what = text, names, what
        self.used: dict[str, None] = {}

    def compiled(self, node: ast.expr, depth: int) -> Evaluate:
        if depth > _DEEPEST:
            raise BadInput("the expression is nested too deeply", do="Shorten it.")
        if isinstance(node, ast.Constant) and isinstance(node.value, (int, float)) and not isinstance(node.value, bool):
            return self._number(node.value)
        if isinstance(node, ast.Name):
            return self._name(node.id)
        if isinstance(node, ast.BinOp):
            return self._operation(node, depth)
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.UAdd, ast.USub)):
            inner = self.compiled(node.operand, depth + 1)
            return inner if isinstance(node.op, ast.UAdd) else lambda values: -inner(values)
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and not node.keywords and node.args:
            return self._call(node.func.id, node.args, depth)
        raise self._refused()

    def _refused(self, do: str = "Use numbers, names, + - * / ** and functions.") -> BadInput:
        return BadInput(f"{self.text!r} holds more than arithmetic", do=do)

    def _number(self, value: float) -> Evaluate:
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
        if not math.isfinite(number):
            raise BadInput(f"{self.text!r} holds a number that is too large")
        return lambda values: number

    def _name(self, name: str) -> Evaluate:
        if name in self.names:
            self.used[name] = None
            return lambda values: values[name]
        if name in CONSTANTS:
            return self._number(CONSTANTS[name])
        raise BadInput(f"{self.text!r} uses {name!r}, which is no {self.what}", do=nearest(name, self.names))

    def _operation(self, node: ast.BinOp, depth: int) -> Evaluate:
        if isinstance(node.op, ast.BitXor):
            raise self._refused("Write ** for powers.")
        left, right = self.compiled_pair(node, depth)
        if isinstance(node.op, ast.Pow):
            return lambda values: _power(left(values), right(values))
        if type(node.op) not in _OPERATORS:
            raise self._refused()
        operate = _OPERATORS[type(node.op)]
        return lambda values: operate(left(values), right(values))

    def compiled_pair(self, node: ast.BinOp, depth: int) -> tuple[Evaluate, Evaluate]:
        return self.compiled(node.left, depth + 1), self.compiled(node.right, depth + 1)

    def _call(self, name: str, arguments: list[ast.expr], depth: int) -> Evaluate:
        if name not in _FUNCTIONS:
            raise BadInput(f"{self.text!r} uses the function {name!r}", do=nearest(name, FUNCTIONS))
        function, count = _FUNCTIONS[name]
        if count is not None and len(arguments) != count:
            raise BadInput(f"{self.text!r} gives {name!r} {len(arguments)} values", do=f"It takes {count}.")
        inner = [self.compiled(argument, depth + 1) for argument in arguments]
        return lambda values: function(*(argument(values) for argument in inner))


def _parsed(text: str) -> ast.expr:
    if len(text) > _LONGEST:
        raise BadInput(f"an expression of {len(text)} characters is too long", do="Shorten it.")
    try:
        return ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, MemoryError, RecursionError):
        raise BadInput(f"{text!r} is no arithmetic expression", do='Write it as "-0.5 * Y_v".') from None
