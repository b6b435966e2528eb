"""Random models in the compiled engine against plain Python: rates and their derivatives.

A model is a text of equations, made from arithmetic, functions, comparisons (also as numbers), conditions, loops and
tables. What Python computes is the truth; a point at which Python has no value, or whose equations are ill-conditioned
there, says nothing.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from seatruth.models.base import Model, record
from seatruth.models.parameter import Parameter
from seatruth.simulate import evaluate_rhs, evaluate_rhs_jacobian
from seatruth.trials.channel import Channel

POINTS = 12
"""States at which each model is compared. Chosen here [S]."""
ROUNDING = 1e-9
"""Largest difference from Python, over the size of the value and of what it is made from. Chosen here [S]: the engine's
functions are within 1e-14, and equations of depth five amplify that."""
_STEP = 1e-6
"""Relative step of the central differences that check derivatives. Chosen here [S]."""
_SLOPE = 1e-4
"""Largest difference of a derivative from them. Chosen here [S]: the differences themselves have errors of 1e-6."""
_LEAVES = ("s.x", "s.y", "p.a", "p.b", "i.u", "0.5", "2.0", "-1.5", "1", "3")
_UNARY = ("-{}", "abs({})", "math.sin({})", "math.cos({})", "math.tanh({})", "math.atan({})", "math.exp(-abs({}))")
_SAFE = ("math.sqrt(abs({}))", "math.log(1 + abs({}))", "({})**2", "({})**3", "float({})", "math.copysign(1.5, {})")
_BINARY = ("({} + {})", "({} - {})", "({} * {})", "({} / (1.5 + abs({})))", "min({}, {})", "max({}, {})")
_MORE = ("math.atan2({}, {})", "math.hypot({}, {})", "({} % (2 + abs({})))", "abs({})**(0.5 + abs(math.sin({})))")
_TESTS = ("<", "<=", ">", ">=", "==", "!=")
_STATES, _INPUTS = (Channel("x", "1"), Channel("y", "1")), (Channel("u", "1"),)
_PARAMETERS = (Parameter("a", 1.0), Parameter("b", 1.0))
Plain = Callable[[Any, Any, Any], "tuple[float, float] | None"]


class Writer:
    """Writes random equations from a seed."""

    def __init__(self, seed: int) -> None:
        self._pick = random.Random(seed)

    def number(self, depth: int) -> str:
        """An expression that is a number; a comparison counts as one, as Python has it."""
        r = self._pick
        if depth == 0 or r.random() < 0.15:
            return r.choice(_LEAVES)
        kind = r.random()
        if kind < 0.3:
            return r.choice((*_UNARY, *_SAFE)).format(self.number(depth - 1))
        if kind < 0.65:
            return r.choice((*_BINARY, *_MORE)).format(self.number(depth - 1), self.number(depth - 1))
        if kind < 0.8:
            return f"({self.number(depth - 1)} if {self.truth(depth - 1)} else {self.number(depth - 1)})"
        if kind < 0.93:
            return f"({self.truth(depth - 1)} {r.choice('+-*')} {self.truth(depth - 1)})"
        if kind < 0.97:
            return f"({self.number(depth - 1)}, {self.number(depth - 1)})[{self.comparison(depth - 1)}]"
        return f"sum([{self.number(depth - 1)}, {self.truth(depth - 1)}, 1.0])"

    def comparison(self, depth: int) -> str:
        left, right = self.number(max(depth - 1, 0)), self.number(max(depth - 1, 0))
        return f"({left} {self._pick.choice(_TESTS)} {right})"

    def truth(self, depth: int) -> str:
        """A comparison, or several in logic."""
        kind = self._pick.random()
        if depth <= 1 or kind < 0.6:
            return self.comparison(depth)
        if kind < 0.7:
            return f"(not {self.comparison(depth - 1)})"
        if kind < 0.8:
            return f"(-1 < {self.number(depth - 1)} < 1.5)"
        word = self._pick.choice(("and", "or", "&", "|", "^"))
        return f"({self.comparison(depth - 1)} {word} {self.comparison(depth - 1)})"

    def equations(self) -> str:
        """The body of a `rhs` with two states; a third of them with a condition or a loop as statements."""
        r = self._pick
        kind = r.random()
        if kind < 0.15:
            body = f"    v = {self.number(2)}\n    if {self.truth(2)}:\n        v = {self.number(2)}\n"
            return f"{body}    return v, {self.number(2)} + v"
        if kind < 0.3:
            body = f"    v = 0\n    for k in range({r.randint(2, 5)}):\n        v = v + {self.number(2)} / (1 + k)\n"
            return f"{body}    return v, {self.truth(2)}"
        return f"    return {self.number(4)}, {self.number(3)}"


@dataclass(frozen=True)
class Difference:
    """A model that the engine computes otherwise than Python."""

    source: str
    what: str


def compare(seed: int) -> Difference | None:
    """Writes the model of a seed and compares it; None where all agrees."""
    source = f"def rhs(s, i, p):\n{Writer(seed).equations()}\n"
    space: dict[str, Any] = {"math": math}
    exec(compile(source, f"<model {seed}>", "exec"), space)
    model = _model(space["rhs"])
    draw = np.random.default_rng(seed)
    states, inputs = draw.normal(0.0, 1.2, (POINTS, 2)), draw.normal(0.0, 1.2, (POINTS, 1))
    theta = draw.normal(0.5, 1.0, 2)
    plain = _plain(space["rhs"])
    found = evaluate_rhs(model, theta, ["a", "b"], {}, states, inputs, threads=1)
    slopes = evaluate_rhs_jacobian(model, theta, ["a", "b"], {}, states, inputs, threads=1)
    for row in range(POINTS):
        truth = plain(states[row], inputs[row], theta)
        if truth is None:
            continue
        for k in range(2):
            off = abs(found[row, k] - truth[k])
            if not off <= ROUNDING * (1.0 + abs(truth[k])) and not _loose(
                plain, states[row], inputs[row], theta, k, off
            ):
                return Difference(source, f"rate {k}: {found[row, k]!r} instead of {truth[k]!r} at {states[row]!r}")
            for column in range(2):
                slope = _slope(plain, states[row], inputs[row], theta, k, column)
                if slope is not None and not abs(slopes[row, k, column] - slope) <= _SLOPE * (1.0 + abs(slope)):
                    what = f"derivative of rate {k}: {slopes[row, k, column]!r} instead of {slope!r} at {states[row]!r}"
                    return Difference(source, what)
    return None


def _model(rhs: Callable[..., Any]) -> Model:
    class Random(Model):
        name = "random"
        states = outputs = _STATES
        inputs = _INPUTS
        parameters = _PARAMETERS

    Random.rhs = staticmethod(rhs)
    return Random()


def _plain(rhs: Callable[..., Any]) -> Plain:
    states, inputs, parameters = record("S", _STATES), record("I", _INPUTS), record("P", _PARAMETERS)

    def rates(x: Any, u: Any, theta: Any) -> tuple[float, float] | None:
        try:
            # Python's own numbers: NumPy's neither raise nor know that True is 1.
            values = rhs(states(*map(float, x)), inputs(float(u[0])), parameters(*map(float, theta)))
            found = float(values[0]), float(values[1])
        except (ArithmeticError, ValueError):
            return None
        return found if all(map(math.isfinite, found)) else None

    return rates


def _loose(plain: Plain, x: Any, u: Any, theta: Any, k: int, off: float) -> bool:
    """Whether rounding of the variables alone moves Python's value as much: a jump, or cancellation."""
    values = [plain(x * (1.0 + e), u * (1.0 + f), theta * (1.0 + e)) for e in (-1e-13, 1e-13) for f in (-1e-13, 1e-13)]
    known = [value[k] for value in values if value is not None]
    return len(known) < 4 or max(known) - min(known) >= 0.01 * off


def _slope(plain: Plain, x: Any, u: Any, theta: Any, k: int, column: int) -> float | None:
    """Derivative by central differences; None beside a kink or a jump, where two steps disagree."""
    found = []
    for size in (_STEP, 4 * _STEP):
        step = np.zeros(2)
        step[column] = size
        up, down = plain(x, u, theta + step), plain(x, u, theta - step)
        if up is None or down is None:
            return None
        found.append((up[k] - down[k]) / (2 * size))
    return found[0] if abs(found[0] - found[1]) <= 0.1 * _SLOPE * (1.0 + abs(found[0])) else None
