"""From a model's plain functions to the graph of its equations.

The functions run on nodes instead of numbers. `math`, NumPy's scalar functions, `abs`, `min` and `max` are replaced by
functions of nodes, in the model's own functions and in every plain Python function that they call. An `if` on a
variable is followed both ways, and the results are merged where its function returns (`branches`).
"""

from __future__ import annotations

import builtins
import math
import sysconfig
import types
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from seatruth.errors import PluginError, SeatruthError
from seatruth.models.base import Environment, Model, record
from seatruth.models.servo import Servo, stages
from seatruth.models.user_file import name_missing
from seatruth.simulate.compiler.branches import every_way, merging
from seatruth.simulate.compiler.graph import Graph
from seatruth.simulate.compiler.node import BOTH, LANE, ROW, Node, NotTraceable
from seatruth.simulate.compiler.operations import BINARY, UNARY

_OPERATORS = ("neg", "add", "sub", "mul", "div")
_NUMPY_NAMES = {
    **{"arcsin": "asin", "arccos": "acos", "arctan": "atan", "arcsinh": "asinh", "arccosh": "acosh"},
    **{"arctanh": "atanh", "arctan2": "atan2", "absolute": "abs", "fabs": "abs", "power": "pow"},
}
_BRACKETS = "tuple indices must be integers"
_BY_NAME = "Write p.m, not p['m']: states, inputs and parameters are attributes."
_STDLIB = sysconfig.get_paths()["stdlib"]
_CONVERSIONS = ("float64", "float32", "asarray", "array", "real")


class Driven(NamedTuple):
    """An input behind a servo, in the equations of a kernel.

    `state` holds where the servo stands, `acting` is the leaf that the rates and the outputs read instead of the input.
    `start`, `middle`, `end` are its values in a step: functions of `state`, parameters, and leaves of the step, which
    are its orders at the start and the end and its length.
    """

    state: Node
    acting: Node
    start: Node
    middle: Node
    end: Node


@dataclass(frozen=True)
class Equations:
    """What a model computes: `rates` (S,) and `outputs` (D,) over leaves state, input, parameter, time, trial.

    In place of the inputs in `driven` they have leaves of their own. `orders` and `later` (I,) are leaves of the inputs
    at the start and the end of a step, `length` of its duration: what `driven` depends on.
    """

    graph: Graph
    rates: tuple[Node, ...]
    outputs: tuple[Node, ...]
    states: tuple[Node, ...]
    inputs: tuple[Node, ...]
    parameters: tuple[Node, ...]
    time: Node
    trial: Node
    driven: tuple[Driven, ...]
    orders: tuple[Node, ...]
    later: tuple[Node, ...]
    length: Node


def trace(model: Model) -> Equations:
    """The equations of a model; PluginError, with the file and line, where they cannot be compiled."""
    graph = Graph()
    states = tuple(graph.leaf("state", k, BOTH) for k in range(len(model.states)))
    inputs = tuple(graph.leaf("input", k, ROW) for k in range(len(model.inputs)))
    parameters = tuple(graph.leaf("parameter", k, LANE) for k in range(len(model.parameters)))
    time = graph.leaf("time", 0, ROW)
    orders = tuple(graph.leaf("order", k, ROW) for k in range(len(model.inputs)))
    later = tuple(graph.leaf("later order", k, ROW) for k in range(len(model.inputs)))
    length = graph.leaf("length", 0, ROW)
    s = record("States", model.states)(*states)
    acting = {servo.input: graph.leaf("acting", k, BOTH) for k, servo in enumerate(model.servos)}
    i = record("Inputs", model.inputs)(*(acting.get(c.name, leaf) for c, leaf in zip(model.inputs, inputs)))
    p = record("Parameters", model.parameters)(*parameters)
    number = graph.leaf("trial", 0, ROW)
    e = Environment(t=time, trial=number)
    given = (s, i, p, e)

    def run(role: str, function: Callable[..., Any], size: int) -> tuple[Node, ...]:
        first, second = (explored(graph, model, role, Shims(graph).rebuilt(function), given, size) for _ in range(2))
        # Equal nodes are one object, so the same equations give the same nodes.
        if any(a is not b for a, b in zip(first, second)):
            raise PluginError(
                f"{role} gives other equations each time it runs: random numbers, or something that it changes itself",
                where=f"model {model.name!r}",
                do="Let it depend on states, inputs and parameters alone.",
            )
        return first

    rates = run("rhs", model.rhs, len(states))
    if model.output is None:
        named = {channel.name: node for channel, node in zip(model.states, states)}
        outputs = tuple(named[channel.name] for channel in model.outputs)
    else:
        outputs = run("output", model.output, len(model.outputs))
    driven = []
    for servo in model.servos:
        column = [channel.name for channel in model.inputs].index(servo.input)
        z = getattr(s, servo.state)
        step = (z, orders[column], later[column], length)
        values = run(f"servo of {servo.input}", _step_of(servo, step), 3)
        driven.append(Driven(z, acting[servo.input], *values))
    graph.open_for_derivatives()
    return Equations(
        graph, rates, outputs, states, inputs, parameters, time, number, tuple(driven), orders, later, length
    )


def _step_of(servo: Servo, step: tuple[Node, Node, Node, Node]) -> Callable[..., tuple[Node, ...]]:
    """What the servo gives in a step, as a function of what a model's equations get."""
    settings = servo.settings

    def values(s: Any, i: Any, p: Any, e: Any) -> tuple[Node, ...]:
        return stages(*step, *settings(p))

    return values


def explored(
    graph: Graph, model: Model, role: str, function: Callable[..., Any], arguments: tuple[Any, ...], size: int | None
) -> tuple[Node, ...]:
    """The values of a function, run along every way through its conditions, merged; any number where `size` is None.

    PluginError, with the file and line, where it cannot be compiled or gives another number.
    """
    graph.path, graph.planned, graph.asked = [], (), 0

    def values() -> tuple[Node, ...]:
        returned = function(*arguments)
        if returned is None or isinstance(returned, (Node, int, float)):
            what = "nothing" if returned is None else "one bare value"
            raise NotTraceable(f"it returns {what}, not a tuple{f' of {size}' if size is not None else ''}")
        found = tuple(returned)
        if size is not None and len(found) != size:
            raise NotTraceable(f"it returns {len(found)} values, {size} are declared")
        return tuple(graph.number(value) for value in found)

    def merge(condition: Node, yes: tuple[Node, ...], no: tuple[Node, ...]) -> tuple[Node, ...]:
        return tuple(graph.select(condition, a, b) for a, b in zip(yes, no))

    try:
        return every_way(graph, values, merge)
    except SeatruthError:
        raise
    except SystemExit:
        raise PluginError(
            f"{role} ends the program", where=f"model {model.name!r}", do="Raise nothing in it."
        ) from None
    except NameError as problem:
        raise PluginError(
            f"{role} raises {type(problem).__name__}: {problem}",
            where=_place(model, problem),
            do=name_missing(problem),
        ) from problem
    except Exception as problem:
        raise PluginError(
            f"{role} cannot be compiled: {_reason(problem)}",
            where=_place(model, problem),
            do=_BY_NAME
            if _BRACKETS in str(problem)
            else "Use arithmetic, comparisons, `if`, and the functions of `math`, or wrap the model as a BlackBox.",
        ) from problem


def _reason(problem: Exception) -> str:
    if isinstance(problem, NotTraceable):
        return str(problem)
    if "'Node'" in str(problem):
        return "it gives a variable to a function that needs plain numbers"
    return f"{type(problem).__name__}: {problem}"


def _place(model: Model, problem: Exception) -> str:
    """The line of the model's own code that failed: the last one outside the engine and the libraries."""
    place = f"model {model.name!r}"
    step = problem.__traceback__
    line = ""
    while step is not None:
        file = Path(step.tb_frame.f_code.co_filename)
        own = file.parent != Path(__file__).parent and "site-packages" not in file.parts
        if own and not file.is_relative_to(_STDLIB):
            line = f"{file.name}, line {step.tb_lineno}"
        step = step.tb_next
    return f"{place}, {line}" if line else place


class Shims:
    """Functions of nodes in place of those of `math`, NumPy and Python, and copies of functions that use them."""

    def __init__(self, graph: Graph) -> None:
        self.graph = graph
        self._rebuilt: dict[int, Any] = {}
        self.functions: dict[str, Callable[..., Any]] = {
            **{op: self._function(op) for op in (*UNARY, *BINARY) if op not in _OPERATORS},
            **{"fabs": self._function("abs"), "min": self._extreme(graph.smaller), "max": self._extreme(graph.larger)},
            **{"minimum": self._extreme(graph.smaller), "maximum": self._extreme(graph.larger)},
            **{
                "log": self._log,
                "sign": self._sign,
                "where": self._where,
                "clip": self._clip,
                "square": lambda a: a * a,
            },
            **{"degrees": lambda a: a * (180.0 / math.pi), "radians": lambda a: a * (math.pi / 180.0)},
            **{"deg2rad": lambda a: a * (math.pi / 180.0), "rad2deg": lambda a: a * (180.0 / math.pi)},
        }
        for theirs, ours in _NUMPY_NAMES.items():
            self.functions[theirs] = self.functions[ours]
        self._objects: dict[int, Any] = {}
        for module in (math, np):
            for name, function in self.functions.items():
                if hasattr(module, name):
                    self._objects[id(getattr(module, name))] = function
        for name in ("abs", "min", "max", "pow"):
            self._objects[id(getattr(builtins, name))] = self.functions[name]
        for plain in (float, *(getattr(np, name) for name in _CONVERSIONS)):
            self._objects.setdefault(id(plain), _conversion(plain))

    def rebuilt(self, function: Any) -> Any:
        """A copy of a Python function whose names lead to functions of nodes."""
        if not isinstance(function, types.FunctionType):
            return self._objects.get(id(function), function)
        known = self._rebuilt.get(id(function))
        if known is not None:
            return known
        names = _names(function.__code__)
        space: dict[str, Any] = {
            "__builtins__": {**vars(builtins), "__import__": self._imported},
            "__name__": function.__module__,
            "__package__": function.__globals__.get("__package__"),
        }
        copy = types.FunctionType(
            function.__code__, space, function.__name__, function.__defaults__, self._cells(function)
        )
        copy.__kwdefaults__ = function.__kwdefaults__
        merged = merging(self.graph, copy)
        self._rebuilt[id(function)] = merged  # before its names are looked into: it may call itself
        for name in names:
            if name in function.__globals__:
                space[name] = self._value(function.__globals__[name])
            elif hasattr(builtins, name):
                space[name] = self._value(getattr(builtins, name))
        return merged

    def _imported(self, *args: Any, **options: Any) -> Any:
        """What an `import` inside a function gives: the module, whose functions are those of nodes."""
        return self._value(builtins.__import__(*args, **options))

    def _cells(self, function: types.FunctionType) -> tuple[types.CellType, ...] | None:
        if function.__closure__ is None:
            return None
        cells = []
        for cell in function.__closure__:
            try:
                cells.append(types.CellType(self._value(cell.cell_contents)))
            except ValueError:  # not yet filled
                cells.append(cell)
        return tuple(cells)

    def _value(self, value: Any) -> Any:
        if isinstance(value, (types.ModuleType, Model)) or (isinstance(value, type) and issubclass(value, Model)):
            return _Namespace(self, value)  # a model may call the functions of another one
        if isinstance(value, types.MethodType):
            return types.MethodType(self.rebuilt(value.__func__), value.__self__)
        if isinstance(value, staticmethod):
            return self.rebuilt(value.__func__)
        if isinstance(value, (list, tuple)) and any(callable(item) for item in value) and type(value) in (list, tuple):
            return type(value)(self._value(item) for item in value)
        return self.rebuilt(value) if callable(value) else value

    def _function(self, op: str) -> Callable[..., Any]:
        plain = UNARY.get(op) or BINARY[op]

        def apply(*args: Any) -> Any:
            if not any(isinstance(a, Node) for a in args):
                return plain(*args)
            return self.graph.make(op, *(self.graph.node(a) for a in args))

        apply.__name__ = op
        return apply

    def _extreme(self, pick: Callable[[Node, Node], Node]) -> Callable[..., Any]:
        def apply(*args: Any) -> Any:
            items = list(args[0]) if len(args) == 1 else list(args)
            result = self.graph.node(items[0])
            for item in items[1:]:
                result = pick(result, self.graph.node(item))
            return result.value if result.op == "constant" else result

        return apply

    def _log(self, a: Any, base: Any = None) -> Any:
        result = self.graph.make("log", self.graph.node(a))
        return result if base is None else result / self.graph.make("log", self.graph.node(base))

    def _sign(self, a: Any) -> Node:
        node = self.graph.node(a)
        return self.graph.select(
            node > 0.0, self.graph.node(1.0), self.graph.select(node < 0.0, self.graph.node(-1.0), self.graph.node(0.0))
        )

    def _where(self, condition: Any, yes: Any, no: Any) -> Any:
        if not isinstance(condition, Node):
            return yes if condition else no
        return self.graph.select(condition, self.graph.node(yes), self.graph.node(no))

    def _clip(self, a: Any, low: Any, high: Any) -> Node:
        node = self.graph.node(a)
        return self.graph.smaller(self.graph.larger(node, self.graph.node(low)), self.graph.node(high))


class _Namespace:
    """A module or a model whose functions are those of nodes."""

    def __init__(self, shims: Shims, holder: Any) -> None:
        self._shims, self._holder = shims, holder

    def __getattr__(self, name: str) -> Any:
        return self._shims._value(getattr(self._holder, name))


def _conversion(plain: Callable[..., Any]) -> Callable[..., Any]:
    """A conversion that leaves a node as it is."""

    def convert(value: Any = 0.0, *rest: Any, **options: Any) -> Any:
        if isinstance(value, Node):
            return value
        if isinstance(value, Sequence) and not isinstance(value, str) and _holds_node(value):
            return np.array(value, dtype=object)
        return plain(value, *rest, **options)

    return convert


def _holds_node(value: Any) -> bool:
    if isinstance(value, Node):
        return True
    return isinstance(value, (list, tuple)) and any(_holds_node(item) for item in value)


def _names(code: types.CodeType) -> set[str]:
    """Every global name that a function or a function inside it uses."""
    names = set(code.co_names)
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            names |= _names(constant)
    return names
