"""The operations of the graph, with their meaning for plain numbers."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Final

COMPARISONS: Final[Mapping[str, str]] = {"lt": "olt", "le": "ole", "gt": "ogt", "ge": "oge", "eq": "oeq", "ne": "une"}
"""Comparisons, with the name of each among the predicates of LLVM's fcmp."""
UNARY: Final[Mapping[str, Callable[[float], float]]] = {
    "neg": lambda a: -a,
    "abs": abs,
    "sqrt": math.sqrt,
    "cbrt": math.cbrt,
    "sin": math.sin,
    "cos": math.cos,
    "tan": math.tan,
    "asin": math.asin,
    "acos": math.acos,
    "atan": math.atan,
    "sinh": math.sinh,
    "cosh": math.cosh,
    "tanh": math.tanh,
    "asinh": math.asinh,
    "acosh": math.acosh,
    "atanh": math.atanh,
    "exp": math.exp,
    "expm1": math.expm1,
    "log": math.log,
    "log1p": math.log1p,
    "log10": math.log10,
    "log2": math.log2,
    "floor": lambda a: float(math.floor(a)),
    "ceil": lambda a: float(math.ceil(a)),
    "trunc": lambda a: float(math.trunc(a)),
}
BINARY: Final[Mapping[str, Callable[[float, float], float]]] = {
    "add": lambda a, b: a + b,
    "sub": lambda a, b: a - b,
    "mul": lambda a, b: a * b,
    "div": lambda a, b: a / b,
    "pow": math.pow,
    "atan2": math.atan2,
    "hypot": math.hypot,
    "copysign": math.copysign,
    "fmod": math.fmod,
}
_RELATIONS: Final[Mapping[str, Callable[[float, float], bool]]] = {
    "lt": lambda a, b: a < b,
    "le": lambda a, b: a <= b,
    "gt": lambda a, b: a > b,
    "ge": lambda a, b: a >= b,
    "eq": lambda a, b: a == b,
    "ne": lambda a, b: a != b,
}


def fold(op: str, values: list[float]) -> float | bool | None:
    """The operation on constants; None where it has no finite result, which is then left to the run."""
    try:
        if op in UNARY:
            result = UNARY[op](values[0])
        elif op in BINARY:
            result = BINARY[op](values[0], values[1])
        elif op in _RELATIONS:
            return _RELATIONS[op](values[0], values[1])
        else:
            return None
    except (ValueError, OverflowError, ZeroDivisionError):
        return None
    return result if isinstance(result, float) and math.isfinite(result) else None
