"""A user's own simulator as a model: a Python callable that turns a trial and parameters into output records."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, Literal

import numpy as np

from seatruth.arrays import Array
from seatruth.errors import BadInput, PluginError, SeatruthError, nearest
from seatruth.models.actuators import Rudder, Thruster, problem_with, shown_thrusts
from seatruth.models.base import Model, check_kind, whole_name
from seatruth.models.geometry import Dimensions
from seatruth.models.parameter import Parameter
from seatruth.models.ports import Outside, Ports, as_ports
from seatruth.trials.channel import Channel
from seatruth.trials.trial import Trial

Function = Callable[..., Mapping[str, Any]]
"""`function(trial, parameters, first_state)`, with `outside` as a fourth argument where there are ports."""


class RunFailed(PluginError):
    """The function of a black box raised in one run, which may be the parameters' fault, and not its own."""


class BlackBox(Model):
    """A simulator that seatruth can run but not look into.

    Args:
        name: its name.
        function: `function(trial, parameters, first_state)` returns the outputs by name, each (n,) on the trial's own
            time axis. `parameters` holds all parameters by name, `first_state` the states at the trial's first sample
            by name, or None where no states are declared. It must not change the trial and must give the same answer
            to the same question. Numbers that are not finite mean that the run diverged.
        inputs, outputs: its channels.
        parameters: its parameters.
        states: states that a trial can start; each is an output of the same name.
        kind: "ship", "auv", "glider" or "planing": which effects can act on it.
        title, source: for lists and reports.
        ports: which outside forces and which current it takes, as `Ports` or {"force": ["X", "Y", "N"], "current":
            ["north", "east"]}. The function then gets a fourth argument, `outside(t, outputs)`. It calls that at each
            of its steps, with the time (s) and its outputs by name, and adds what it gets: {"X": N, ..., "east": m/s}.
        dimensions: the vehicle's size, which effects of wind, waves and hull need.
        actuators: what drives and steers it, as models of equations name it: effects on rudders and thrusters find its
            inputs by them. Where each thruster names the output that is its `force`, effects on that force act as
            well; a subclass may declare `thrusts` instead, which computes them from its outputs.

    Derivatives are finite differences.

    Raises:
        BadInput: the declaration contradicts itself.

    Example:
        >>> from seatruth import BlackBox, Channel, Parameter, Trial
        >>> def line(trial, p, first_state):
        ...     return {"y": p["a"] * trial.t}
        >>> slope = Parameter("a", 2.0, "m/s")
        >>> box = BlackBox("line", line, inputs=[], outputs=[Channel("y", "m")], parameters=[slope])
        >>> box.run(Trial("run", [0.0, 1.0], {}, {}), {"a": 2.0}, None)[:, 0].tolist()
        [0.0, 2.0]
    """

    def __init__(
        self,
        name: str,
        function: Function,
        *,
        inputs: Sequence[Channel],
        outputs: Sequence[Channel],
        parameters: Sequence[Parameter],
        states: Sequence[Channel] = (),
        kind: str = "",
        title: str = "",
        source: str = "",
        ports: Ports | Mapping[str, Sequence[str]] | None = None,
        dimensions: Dimensions | None = None,
        actuators: Sequence[Rudder | Thruster] = (),
    ) -> None:
        self.name, self.function = name, function
        self.inputs, self.outputs = tuple(inputs), tuple(outputs)
        self.parameters, self.states = tuple(parameters), tuple(states)
        self.kind, self.title, self.source = kind, title or f"black box {name}", source
        self.ports = as_ports(ports)
        if dimensions is not None:
            self.dimensions = _Constant(dimensions)
        if actuators:  # else what a subclass declares
            self.actuators = tuple(actuators)
        shown = shown_thrusts(self.actuators)
        if shown is not None:
            self.thrusts = shown
        self._check()

    takes_environment = takes_current = False
    base: BlackBox | None = None
    """The black box that it wraps, where it wraps one."""
    hold: Literal["foh", "zoh"] = "foh"
    """How it takes inputs between samples: as straight lines, or held. Servos in front of it give it what suits."""

    @property
    def innermost(self) -> BlackBox:
        """The black box without what effects, sensors and processes put around it."""
        innermost = self
        while innermost.base is not None:
            innermost = innermost.base
        return innermost

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        """A black box has no equations: it is simulated as a whole, by `run`."""
        raise PluginError("a black box has no equations", do="Simulate it with `run`.")

    succeeded: Mapping[str, int] = MappingProxyType({})
    """Runs in this process that gave outputs, by trial."""
    failed: Mapping[str, int] = MappingProxyType({})
    """Runs in this process that raised once their trial had given outputs, by what they raised: they have diverged."""

    def run(
        self,
        trial: Trial,
        parameters: Mapping[str, float],
        first_state: Mapping[str, float] | None,
        outside: Outside | None = None,
    ) -> Array:
        """The simulated outputs, shape (n, n_outputs) in the order of `outputs`; checked, copied.

        `outside` is what acts through the ports; nothing where None. Raises RunFailed if the function raises, and
        PluginError if it returns something else than one (n,) array an output.
        """
        where = f"model {self.name!r}, trial {trial.name!r}"
        more = (outside or self.ports.nothing,) if self.ports else ()
        try:
            result = self.function(trial, dict(parameters), None if first_state is None else dict(first_state), *more)
        except SeatruthError:
            raise
        except Exception as problem:
            raise RunFailed(
                f"its function raised {type(problem).__name__}: {problem}", where=where, do="Correct the model file."
            ) from problem
        if not isinstance(result, Mapping):
            raise PluginError(f"its function returned {type(result).__name__}, not a dict of outputs", where=where)
        simulated = np.empty((len(trial), len(self.outputs)))
        for column, output in enumerate(self.outputs):
            if output.name not in result:
                raise PluginError(f"its function returned no {output.name!r}", where=where)
            try:
                values = np.asarray(result[output.name], dtype=np.float64)
            except (TypeError, ValueError):
                raise PluginError(f"its {output.name!r} holds something that is no number", where=where) from None
            if values.shape != (len(trial),):
                raise PluginError(
                    f"its {output.name!r} has shape {values.shape}, the trial has ({len(trial)},)", where=where
                )
            simulated[:, column] = values
        name = whole_name(trial.name)
        self.succeeded = {**self.succeeded, name: self.succeeded.get(name, 0) + 1}
        return simulated

    def acting_inputs(self, trial: Trial, parameters: Mapping[str, float]) -> Trial:
        """The trial with the inputs that reach the simulator, behind all servos and effects."""
        return trial

    def _check(self) -> None:
        where = f"model {self.name!r}"
        if not callable(self.function):
            raise BadInput("its function cannot be called", where=where)
        if not self.outputs:
            raise BadInput("it declares no outputs", where=where)
        check_kind(self.kind, where)
        for label in ("states", "inputs", "outputs", "parameters"):
            names = [field.name for field in getattr(self, label)]
            twice = sorted({n for n in names if names.count(n) > 1})
            if twice:
                raise BadInput(f"{label} lists {twice[0]!r} twice", where=where)
            bad = [n for n in names if not n.isidentifier() or n.startswith("_")]
            if bad:
                raise BadInput(f"{bad[0]!r} cannot name one of its {label}", where=where, do="Use an identifier.")
        inputs, parameters = {one.name: one.unit for one in self.inputs}, {one.name for one in self.parameters}
        units = {output.name: output.unit for output in self.outputs}
        wrong = problem_with(self.actuators, inputs, parameters, self.thrusts is not None, units)
        if wrong:
            raise BadInput(wrong, where=where)
        known = [output.name for output in self.outputs]
        for state in self.states:
            if state.name not in known:
                hint = nearest(state.name, known)
                raise BadInput(f"state {state.name!r} is not an output, so no trial can start it", where=where, do=hint)


class _Constant:
    """A size that no parameter changes. A class, as a function made inside a constructor cannot be pickled."""

    def __init__(self, dimensions: Dimensions) -> None:
        self._dimensions = dimensions

    def __call__(self, p: Any) -> Dimensions:
        return self._dimensions
