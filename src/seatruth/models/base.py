"""What a simulator believes about a vehicle: the Model interface.

A model is plain equations. `rhs`, `output` and `initial_state` are static functions of named tuples:

    s   the states             s.u, s.v, s.r, ...
    i   the inputs             i.delta, i.n, ...
    p   the parameters         p.Y_v, p.m, ...
    e   the environment        e.t, e.u_c, e.X, ... (optional last argument of rhs and output)

An instance's `rhs` and `output` always take all four: where e is left out of the declaration, the instance adds it.
They return tuples in the order of `states` and `outputs`. They may call other plain functions, and arithmetic,
comparisons, `abs`, `min`, `max`, and the functions of `math` or NumPy's scalar ones (sin, cos, tan, sinh, cosh, tanh,
asin, acos, atan, atan2, exp, log, sqrt, hypot, copysign, pi). `if` expressions and statements work; the engine
compiles the same functions for populations and takes exact derivatives from them.
"""

from __future__ import annotations

import inspect
import math
from collections import namedtuple
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

from seatruth.errors import BadInput, PluginError, nearest
from seatruth.models.actuators import Rudder, Thruster, problem_with
from seatruth.models.first_slope import FirstSlope
from seatruth.models.geometry import Dimensions
from seatruth.models.moving_water import carried_by_water, in_moving_water
from seatruth.models.parameter import Parameter
from seatruth.models.servo import Servo
from seatruth.trials.channel import Channel, Hold


class Environment(NamedTuple):
    """What acts on the vehicle from outside its own equations; all zero unless an effect sets it.

    `t` s. `trial`: the place of the trial among `Model.trials`, -1 for any other. `u_c, v_c, w_c` m/s: current in body
    axes, and `du_c, dv_c, dw_c` m/s2 its rate of change seen in those axes (a steady current has du_c = r v_c - q w_c
    and so on). `X, Y, Z` N and `K, M, N` N m: extra force and moment in body axes about the model's origin.
    `u_dot ... r_dot` m/s2, rad/s2: accelerations that are added to those of the equations from outside, which an output
    of accelerations must add too (`models.observed` does).
    """

    t: Any = 0.0
    trial: Any = -1.0
    u_c: Any = 0.0
    v_c: Any = 0.0
    w_c: Any = 0.0
    du_c: Any = 0.0
    dv_c: Any = 0.0
    dw_c: Any = 0.0
    X: Any = 0.0
    Y: Any = 0.0
    Z: Any = 0.0
    K: Any = 0.0
    M: Any = 0.0
    N: Any = 0.0
    u_dot: Any = 0.0
    v_dot: Any = 0.0
    w_dot: Any = 0.0
    p_dot: Any = 0.0
    q_dot: Any = 0.0
    r_dot: Any = 0.0


KINDS: Mapping[str, str] = MappingProxyType(
    {
        "": "any",
        "ship": "any vessel at the surface, as a USV",
        "auv": "any submerged vehicle with propellers, as an ROV",
        "glider": "an underwater glider",
        "planing": "a planing craft",
        "formula": "a formula over a table, no vehicle",
    }
)
"""Kinds of vehicles, each with what it holds."""
Equations = Callable[..., tuple[Any, ...]]
SECTION = " §"
"""Between the name of a trial and the number of a section of it."""
OTHER_TRIAL = -1.0
"""`e.trial` of a trial that is not among `Model.trials`."""


def whole_name(name: str) -> str:
    """Name of the trial of which this is one, or a section.

    Example:
        >>> whole_name("turn §2"), whole_name("turn § 35 deg")
        ('turn', 'turn § 35 deg')
    """
    whole, mark, number = name.rpartition(SECTION)
    return whole if mark and number.isdigit() else name


class Model:
    """Base of every model: names and units as class attributes, equations as static functions.

    Subclasses set `name`, `title`, `kind`, `source`, `states`, `inputs`, `outputs`, `parameters` and define
    `rhs(s, i, p[, e])`; `output(s, i, p[, e])` unless every output is a state of the same name; and
    `initial_state(y, i, p)`, where y and i are the outputs and inputs at the start of a trial, unless every state is
    an output of the same name. Creating an instance checks the declaration.

    For effects only, all optional: `dimensions(p)` gives the vehicle's size, `thrust(s, i, p, e)` the thrust of its
    propeller (N, forwards), `actuators` the rudders and thrusters by name, `thrusts(s, i, p, e)` the force of each
    thruster (N, in their order), `drag(s, i, p, e)` its drag in straight motion (N, positive against forward motion),
    and `standard` the standard channel and the sign of channels that have names or axes of their own
    (`{"v_y": ("w", -1)}`).

    Raises:
        BadInput: the declaration is not complete or contradicts itself.

    Example:
        >>> from seatruth import Channel, Model, Parameter
        >>> class Yaw(Model):
        ...     name = "yaw"
        ...     states = outputs = (Channel("r", "rad/s"),)
        ...     inputs = (Channel("delta", "rad"),)
        ...     parameters = (Parameter("K", 0.2, "1/s"), Parameter("T", 8.0, "s"))
        ...
        ...     @staticmethod
        ...     def rhs(s, i, p):
        ...         return ((p.K * i.delta - s.r) / p.T,)
        >>> Yaw().nominal()
        {'K': 0.2, 'T': 8.0}
    """

    name: str = ""
    title: str = ""
    kind: str = ""
    """One of `KINDS`: which effects can act on it."""
    source: str = ""
    states: tuple[Channel, ...] = ()
    inputs: tuple[Channel, ...] = ()
    outputs: tuple[Channel, ...] = ()
    parameters: tuple[Parameter, ...] = ()

    hidden: tuple[str, ...] = ()
    """States that start where `initial_state` says and are never free: a filter's, a delay's."""
    follows: Mapping[str, tuple[str, float]] = MappingProxyType({})
    """Hidden states whose start moves with that of a state: its name, and +1 or -1."""
    slopes: Mapping[str, FirstSlope] = MappingProxyType({})
    """Hidden states that begin along the motion of an output: what is added to `initial_state`."""
    longest_step: float = math.inf
    """s: the longest integration step that its quickest part allows; samples further apart take several."""

    actuators: tuple[Rudder | Thruster, ...] = ()
    """What drives and steers it, so that effects on actuators find its inputs and know where thrusters push."""
    servos: tuple[Servo, ...] = ()
    """Actuators between their recorded order and what acts: the engine solves them, and the equations get what acts. In
    front of a black box they act before it runs; it has no states for them."""
    delays: Mapping[str, float] = MappingProxyType({})
    """s: dead time of an order, by input."""
    holds: Mapping[str, Hold] = MappingProxyType({})
    """Between samples, "foh" (lines) or "zoh" (held), of inputs that have a rule of their own."""
    linear: tuple[str, ...] = ()
    """Inputs that change in straight lines between samples even where recorded inputs are held: missing forces."""
    trials: tuple[str, ...] = ()
    """Names of the trials that its equations tell apart by `e.trial`: those of effects with values for each trial."""

    rhs: Equations
    output: Equations | None = None
    initial_state: Equations | None = None
    dimensions: Callable[[Any], Dimensions] | None = None
    thrust: Callable[[Any, Any, Any, Any], Any] | None = None
    drag: Callable[[Any, Any, Any, Any], Any] | None = None
    thrusts: Callable[[Any, Any, Any, Any], tuple[Any, ...]] | None = None
    standard: Mapping[str, tuple[str, int]] = MappingProxyType({})
    takes_environment: bool = True
    """Whether outside forces can act on it; an instance sets False where its rhs is declared without e."""
    takes_current: bool = True
    """Whether a current can act on it; False where its rhs is declared without e and it has no velocity ahead."""

    def __init__(self) -> None:
        _check(self)
        _normalise(self)

    def __getstate__(self) -> dict[str, Any]:
        """Without the functions that `_normalise` makes: these are closures, which cannot be pickled."""
        return {name: value for name, value in vars(self).items() if not hasattr(value, _DECLARED)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        _normalise(self)

    def parameter(self, name: str) -> Parameter:
        """One parameter's declaration, by name."""
        for parameter in self.parameters:
            if parameter.name == name:
                return parameter
        known = [parameter.name for parameter in self.parameters]
        raise BadInput(f"model {self.name!r} has no parameter {name!r}", do=nearest(name, known))

    def nominal(self) -> dict[str, float]:
        """Nominal value of every parameter."""
        return {parameter.name: parameter.value for parameter in self.parameters}

    def standard_of(self, channel: str) -> tuple[str, int]:
        """The standard channel for which one of its channels stands, and the sign: the standard one is that times it.

        Example:
            >>> from seatruth.models import load_model
            >>> load_model("torpedo").standard_of("psi")
            ('psi', 1)
        """
        return self.standard.get(channel, (channel, 1))

    def number_of(self, trial: str) -> float:
        """`e.trial` of a trial, or of a section of it, by its name."""
        whole = trial if trial in self.trials else whole_name(trial)
        return float(self.trials.index(whole)) if whole in self.trials else OTHER_TRIAL

    def first_state(
        self, outputs: Mapping[str, float], inputs: Mapping[str, float], parameters: Mapping[str, float]
    ) -> tuple[float, ...]:
        """Initial state (n_states,) from outputs and inputs at the start of a trial; `complete` adds missing ones."""
        outputs = self.complete(outputs, inputs)
        if self.initial_state is None:
            return tuple(float(outputs[state.name]) for state in self.states)
        y = record("Outputs", self.outputs)(**{c.name: outputs[c.name] for c in self.outputs})
        i = record("Inputs", self.inputs)(**{c.name: inputs[c.name] for c in self.inputs})
        p = record("Parameters", self.parameters)(**{q.name: parameters[q.name] for q in self.parameters})
        state = call(type(self).__name__, "initial_state", self.initial_state, y, i, p)
        return tuple(float(x) for x in state)

    def complete(self, outputs: Mapping[str, float], inputs: Mapping[str, float]) -> dict[str, float]:
        """Every output at the start of a trial: those recorded as they are, the others zero."""
        return {channel.name: float(outputs.get(channel.name, 0.0)) for channel in self.outputs}

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><td>{q.name}</td><td>{q.value:g}</td><td>{q.unit}</td><td>{q.source}</td></tr>"
            for q in self.parameters
        )
        return (
            f"<p><b>{self.name}</b>: {self.title}<br>states {_names(self.states)}; inputs {_names(self.inputs)}; "
            f"outputs {_names(self.outputs)}</p><table><tr><th>parameter</th><th>value</th><th>unit</th>"
            f"<th>source</th></tr>{rows}</table>"
        )


def record(title: str, fields: tuple[Channel, ...] | tuple[Parameter, ...]) -> Any:
    """The named tuple type that carries these fields through a model's equations."""
    return namedtuple(title, [field.name for field in fields])


def call(owner: str, role: str, function: Equations, *arguments: Any) -> tuple[Any, ...]:
    """Calls a model's function and turns anything it raises into one clear message."""
    try:
        return tuple(function(*arguments))
    except Exception as problem:
        raise PluginError(
            f"{role} raised {type(problem).__name__}: {problem}", where=f"model {owner}", do="Correct the model file."
        ) from problem


_DECLARED = "_declared_without_environment"
"""Attribute of a function made by `_normalise`: the function of (s, i, p) that it stands for."""


def _normalise(model: Model) -> None:
    """Gives `rhs` and `output` their one form (s, i, p, e), and water that moves to an `rhs` that does not know it."""
    for role in ("rhs", "output"):
        function = getattr(model, role)
        if function is None or hasattr(function, _DECLARED):
            continue
        own = role == "rhs" and role not in vars(model)
        if _takes(function, 4):
            if own and carried_by_water(model, knows_water=True):
                model.rhs = _standing_for(function, in_moving_water(model, function))
            continue
        if not _takes(function, 3):
            raise BadInput(
                f"its {role} cannot be called with (s, i, p) or (s, i, p, e)",
                where=f"model {model.name!r}",
                do="Give it three or four arguments.",
            )
        ignoring = _ignoring_environment(function)
        if own and carried_by_water(model, knows_water=False):
            ignoring = _standing_for(function, in_moving_water(model, ignoring))
        elif role == "rhs":
            model.takes_current = False
        setattr(model, role, ignoring)
        if role == "rhs":
            model.takes_environment = False


def _ignoring_environment(function: Equations) -> Equations:
    def equations(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        return function(s, i, p)

    return _standing_for(function, equations)


def _standing_for(declared: Equations, made: Equations) -> Equations:
    setattr(made, _DECLARED, declared)
    return made


def _takes(function: Equations, count: int) -> bool:
    """Whether a function can be called with this many arguments."""
    try:
        inspect.signature(function).bind(*range(count))
    except TypeError:
        return False
    return True


def _names(fields: tuple[Channel, ...]) -> str:
    return ", ".join(field.name for field in fields)


def check_kind(kind: str, where: str) -> None:
    """BadInput unless it is one of `KINDS`."""
    if kind not in KINDS:
        known = "; ".join(f"{name!r}: {what}" for name, what in KINDS.items() if name)
        raise BadInput(f"its kind {kind!r} is not known", where=where, do=f"Use {known}. Or leave it empty.")


def _check(model: Model) -> None:
    where = f"model {model.name or type(model).__name__!r}"
    check_kind(model.kind, where)
    for label in ("states", "inputs", "outputs", "parameters"):
        names = [field.name for field in getattr(model, label)]
        twice = sorted({n for n in names if names.count(n) > 1})
        if twice:
            raise BadInput(f"{label} lists {twice[0]!r} twice", where=where)
        bad = [n for n in names if not n.isidentifier() or n.startswith("_")]
        if bad:
            raise BadInput(f"{bad[0]!r} cannot name one of its {label}", where=where, do="Use an identifier.")
    if not model.states or not model.outputs:
        raise BadInput("it declares no states or no outputs", where=where)
    if not callable(getattr(model, "rhs", None)):
        raise BadInput("it has no rhs(s, i, p)", where=where, do="Define rhs as a static function.")
    inputs, parameters = {one.name: one.unit for one in model.inputs}, {one.name for one in model.parameters}
    wrong = problem_with(model.actuators, inputs, parameters, model.thrusts is not None)
    if wrong:
        raise BadInput(wrong, where=where)
    for role in ("rhs", "output", "initial_state", "dimensions", "thrust", "thrusts", "drag"):
        function = inspect.getattr_static(type(model), role, None)
        if inspect.isfunction(function):
            first = next(iter(inspect.signature(function).parameters), "")
            if first != "self":
                raise BadInput(
                    f"its {role} starts with {first!r}, not self", where=where, do="Put @staticmethod above it."
                )
    state_names = {state.name for state in model.states}
    missing = [c.name for c in model.outputs if c.name not in state_names]
    if model.output is None and missing:
        raise BadInput(f"output {missing[0]!r} is not a state and there is no output(s, i, p)", where=where)
    output_names = {c.name for c in model.outputs}
    unset = [s.name for s in model.states if s.name not in output_names]
    if model.initial_state is None and unset:
        raise BadInput(f"state {unset[0]!r} is not an output and there is no initial_state(y, i, p)", where=where)
