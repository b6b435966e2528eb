"""Models built around another model: the base of extended, observed and probed models.

A wrapper has every public attribute of the model that it wraps. It may add states, inputs and parameters, always after
those of the wrapped model, and it may change the equations. Its equations get the longer records; the functions that
`split_states`, `split_inputs` and `split_parameters` return cut these into the wrapped model's record and a tuple of
the added values.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any

from seatruth.models.base import Equations, Model, record
from seatruth.models.first_slope import FirstSlope
from seatruth.models.parameter import Parameter
from seatruth.models.servo import Servo
from seatruth.trials.channel import Channel

Split = Callable[[Any], tuple[Any, tuple[Any, ...]]]
"""From a record of the wrapper to (record of the wrapped model, added values)."""

MODEL_ATTRIBUTES = tuple(name for name in Model.__annotations__ if not name.startswith("_"))
"""Every public attribute that a model declares, in the order of the class `Model`."""


def copy_attributes(source: Model, target: Model) -> None:
    """Gives `target` every public attribute of the model `source`."""
    for name in MODEL_ATTRIBUTES:
        setattr(target, name, getattr(source, name))


class ModelWrapper(Model):
    """A model around the model `base`.

    The constructor takes what the wrapper adds; `longest_step` (s) may only shorten that of the wrapped model, and
    `outputs` take the place of its outputs, which `make_output` must then compute. A subclass sets its own attributes
    first, calls this constructor last, and overrides `make_rhs`, `make_output` or `make_initial_state` to change the
    equations. Each of them returns a plain function, which the engine compiles: it must reach the functions of the
    wrapped model through local variables, not through `self`.

    Example:
        class WithLeak(ModelWrapper):
            '''A model whose first state leaks away, at a rate that is a parameter.'''

            def __init__(self, base: Model) -> None:
                super().__init__(base, parameters=[Parameter("leak", 0.0, "1/s")])

            def make_rhs(self) -> Equations:
                split, rhs = self.split_parameters(), self.base.rhs

                def leaking(s, i, p, e):
                    p, (leak,) = split(p)
                    first, *rest = rhs(s, i, p, e)
                    return (first - leak * s[0], *rest)

                return leaking
    """

    def __init__(
        self,
        base: Model,
        *,
        states: Sequence[Channel] = (),
        inputs: Sequence[Channel] = (),
        parameters: Sequence[Parameter] = (),
        outputs: Sequence[Channel] | None = None,
        hidden: Sequence[str] = (),
        follows: Mapping[str, tuple[str, float]] = MappingProxyType({}),
        slopes: Mapping[str, FirstSlope] = MappingProxyType({}),
        longest_step: float = float("inf"),
        title: str = "",
    ) -> None:
        self.base = base
        copy_attributes(base, self)
        self.title = title or base.title
        self.states = (*base.states, *states)
        self.inputs = (*base.inputs, *inputs)
        self.parameters = (*base.parameters, *parameters)
        self.outputs = base.outputs if outputs is None else tuple(outputs)
        self.hidden = (*base.hidden, *hidden)
        self.follows = {**base.follows, **follows}
        self.slopes = {**base.slopes, **slopes}
        self.longest_step = min(base.longest_step, longest_step)
        self.rhs, self.output, self.initial_state = self.make_rhs(), self.make_output(), self.make_initial_state()
        self._wrap_geometry()
        self.servos = self.make_servos()
        super().__init__()

    def make_rhs(self) -> Equations:
        """rhs(s, i, p, e) of this model; by default that of the wrapped model, where no states are added."""
        return self._with_own_records(self.base.rhs)

    def make_output(self) -> Equations | None:
        """output(s, i, p, e) of this model; by default that of the wrapped model."""
        return None if self.base.output is None else self._with_own_records(self.base.output)

    def make_initial_state(self) -> Equations | None:
        """initial_state(y, i, p) of this model; by default that of the wrapped model, where no states are added."""
        base, split_i, split_p = self.base.initial_state, self.split_inputs(), self.split_parameters()
        if base is None:
            return None

        def initial_state(y: Any, i: Any, p: Any) -> tuple[Any, ...]:
            return tuple(base(y, split_i(i)[0], split_p(p)[0]))

        return initial_state

    def make_servos(self) -> tuple[Servo, ...]:
        """Servos of this model; by default those of the wrapped model, with the same settings."""
        split_p = self.split_parameters()

        def around(settings: Callable[[Any], tuple[Any, Any]]) -> Callable[[Any], tuple[Any, Any]]:
            return lambda p: settings(split_p(p)[0])

        return tuple(replace(servo, settings=around(servo.settings)) for servo in self.base.servos)

    def complete(self, outputs: Mapping[str, float], inputs: Mapping[str, float]) -> dict[str, float]:
        """See `Model.complete`; what the wrapped model says."""
        return self.base.complete(outputs, inputs)

    def split_states(self) -> Split:
        """The function that cuts a record of this model's states."""
        return _split(record("States", self.base.states), len(self.base.states))

    def split_inputs(self) -> Split:
        """The function that cuts a record of this model's inputs."""
        return _split(record("Inputs", self.base.inputs), len(self.base.inputs))

    def split_parameters(self) -> Split:
        """The function that cuts a record of this model's parameters."""
        return _split(record("Parameters", self.base.parameters), len(self.base.parameters))

    def _with_own_records(self, function: Callable[..., Any]) -> Callable[..., Any]:
        """The wrapped model's function of (s, i, p, e) as one of this model's records."""
        split_s, split_i, split_p = self.split_states(), self.split_inputs(), self.split_parameters()

        def with_own_records(s: Any, i: Any, p: Any, e: Any) -> Any:
            return function(split_s(s)[0], split_i(i)[0], split_p(p)[0], e)

        return with_own_records

    def _wrap_geometry(self) -> None:
        """Dimensions, thrusts and drag of the wrapped model, as functions of this model's records."""
        dimensions, split_p = self.base.dimensions, self.split_parameters()
        if dimensions is not None:
            self.dimensions = lambda p: dimensions(split_p(p)[0])
        if self.base.thrust is not None:
            self.thrust = self._with_own_records(self.base.thrust)
        if self.base.thrusts is not None:
            self.thrusts = self._with_own_records(self.base.thrusts)
        if self.base.drag is not None:
            self.drag = self._with_own_records(self.base.drag)


def _split(kind: Any, count: int) -> Split:
    def split(values: Any) -> tuple[Any, tuple[Any, ...]]:
        values = tuple(values)
        return kind(*values[:count]), values[count:]

    return split
