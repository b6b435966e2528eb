"""A model whose inputs are recorded as orders, with the servos between these and what acts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from seatruth.errors import BadInput, nearest
from seatruth.models.base import Equations, Model
from seatruth.models.black_box import BlackBox
from seatruth.models.parameter import Parameter
from seatruth.models.servo import Servo, servo_state
from seatruth.models.wrapper import ModelWrapper
from seatruth.trials.channel import Channel

_SPREAD = 10.0
"""Bounds of a servo's parameter, over and under its stated value: an order of magnitude. Chosen here [S]."""


@dataclass(frozen=True)
class Order:
    """What is known of the servo of an input that was recorded as an order.

    `lag` s and `rate_limit` (unit of the input, a second) become parameters of the model, "delta_lag" and
    "delta_rate_limit"; None stands for a servo without. `delay` s is its dead time.
    """

    lag: float | None = None
    rate_limit: float | None = None
    delay: float = 0.0


class WithServos(ModelWrapper):
    """A model with a servo in front of some of its inputs, under the names that these have in the model.

    Args:
        base: the model, which takes what the actuators do.
        orders: what is known of each servo, by input.
        start_free: whether a fit may move where the actuators stand at the start; else they stand at the first order.

    Raises:
        BadInput: the model has no such input, it has a servo already, or the model is a black box (`ServoBlackBox`).

    Example:
        >>> from seatruth.models import load_model
        >>> from seatruth.models.with_servos import Order, WithServos
        >>> ship = WithServos(load_model("mmg"), {"delta": Order(lag=0.5, rate_limit=0.28)})
        >>> ship.states[-1].name, [parameter.name for parameter in ship.parameters[-2:]]
        ('delta_acting', ['delta_lag', 'delta_rate_limit'])
    """

    def __init__(self, base: Model, orders: Mapping[str, Order], *, start_free: bool = True) -> None:
        if isinstance(base, BlackBox):
            what = f"model {base.name!r} is a black box, which has no equations to wrap"
            raise BadInput(what, do="Take `with_servos` or `ServoBlackBox`.")
        channels = checked_orders(base, orders)
        self.orders = dict(orders)
        states = [
            Channel(servo_state(name), channels[name].unit, f"{channels[name].description or name}, as it acts")
            for name in orders
        ]
        super().__init__(
            base,
            states=states,
            parameters=[
                parameter for name, order in orders.items() for parameter in servo_parameters(channels[name], order)
            ],
            hidden=[] if start_free else [state.name for state in states],
            title=f"{base.title}, with the servos of {', '.join(orders)}",
        )
        self.delays = {**base.delays, **{name: order.delay for name, order in orders.items() if order.delay}}

    def make_rhs(self) -> Equations:
        rhs, still = self._with_own_records(self.base.rhs), (0.0,) * len(self.orders)

        def with_servos(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
            return (*rhs(s, i, p, e), *still)  # the engine moves the servos

        return with_servos

    def make_initial_state(self) -> Equations:
        base, split = self.base.initial_state, self.split_parameters()
        names, orders = [channel.name for channel in self.base.states], tuple(self.orders)

        def initial_state(y: Any, i: Any, p: Any) -> tuple[Any, ...]:
            first = tuple(getattr(y, name) for name in names) if base is None else tuple(base(y, i, split(p)[0]))
            return (*first, *(getattr(i, name) for name in orders))

        return initial_state

    def make_servos(self) -> tuple[Servo, ...]:
        own = [Servo(name, servo_state(name), StatedSettings.of(name, order)) for name, order in self.orders.items()]
        return (*super().make_servos(), *own)


def with_servos_at(model: Model, inputs: Sequence[str]) -> Model:
    """The model with a servo in front of each of these inputs; new ones do nothing until an effect slows them."""
    present = {servo.input for servo in model.servos}
    missing = [name for name in dict.fromkeys(inputs) if name not in present]
    return WithServos(model, {name: Order() for name in missing}, start_free=False) if missing else model


def checked_orders(base: Model, orders: Mapping[str, Order]) -> dict[str, Channel]:
    """The model's inputs by name. BadInput where an order is of none of them, or of one that has a servo."""
    channels = {channel.name: channel for channel in base.inputs}
    present = {servo.input for servo in base.servos}
    for name in orders:
        if name not in channels:
            raise BadInput(f"model {base.name!r} has no input {name!r}", do=nearest(name, channels))
        if name in present:
            raise BadInput(f"input {name!r} of model {base.name!r} has a servo already")
    return channels


def servo_parameters(channel: Channel, order: Order) -> list[Parameter]:
    """The parameters of the servo of an input: what is stated of it, with bounds to either side."""
    source = "stated in the study; bounds [S] an order of magnitude to either side"
    found = []
    for name, value, unit, what in (
        ("lag", order.lag, "s", "lag of the servo"),
        ("rate_limit", order.rate_limit, f"{channel.unit}/s", "its fastest rate"),
    ):
        if value is not None:
            low, high = value / _SPREAD, value * _SPREAD
            found.append(Parameter(f"{channel.name}_{name}", value, unit, low, high, source=source, description=what))
    return found


@dataclass(frozen=True)
class StatedSettings:
    """`Servo.settings` by the parameters of a stated servo: their names, empty where it has none."""

    lag: str
    rate_limit: str

    @classmethod
    def of(cls, name: str, order: Order) -> StatedSettings:
        """Of the servo of the input `name`."""
        return cls(*("" if getattr(order, key) is None else f"{name}_{key}" for key in ("lag", "rate_limit")))

    def __call__(self, p: Any) -> tuple[Any, Any]:
        """Lag (s) and slowness (s per unit of the input)."""
        lag = getattr(p, self.lag) if self.lag else 0.0
        return lag, 1.0 / getattr(p, self.rate_limit) if self.rate_limit else 0.0
