"""A black box whose inputs are recorded as orders: servos stand between these and what the simulator gets.

The engine moves the servos of equations within its steps. A black box integrates by itself, so the servos move before
it runs: from the recorded order to the input that acts, exactly at each sample.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Literal

import numpy as np

from seatruth.arrays import Array
from seatruth.models.base import Model, record
from seatruth.models.black_box import BlackBox
from seatruth.models.black_box_wrapper import BlackBoxWrapper
from seatruth.models.ports import Outside
from seatruth.models.servo import Servo, servo_state, stages
from seatruth.models.with_servos import Order, StatedSettings, WithServos, checked_orders, servo_parameters
from seatruth.trials.trial import Trial

_SAME = 1e-9
"""s: times closer than this are one; far below any sampling step, far above the rounding of times. Chosen here [S]."""


@dataclass(frozen=True, eq=False)
class ActingTrial(Trial):
    """A trial whose inputs are what the actuators do: no servo acts on them again.

    The outermost black box with servos makes it, and those inside find it.
    """


class ServoBlackBox(BlackBoxWrapper):
    """A black box with a servo in front of some of its inputs; `WithServos` is the same for equations.

    A servo starts at the first order. Between samples the simulator gets straight lines, or, where it holds its inputs
    (`BlackBox.hold`), the mean of what the actuator does.

    Args:
        base: the black box, which takes what the actuators do.
        orders: what is known of each servo, by input. Lag and rate limit become parameters, "delta_lag" and
            "delta_rate_limit".

    Raises:
        BadInput: the black box has no such input, or it has a servo already.

    Example:
        >>> from seatruth import BlackBox, Channel, Trial
        >>> from seatruth.models import Order, ServoBlackBox
        >>> def echo(trial, p, first_state):
        ...     return {"angle": trial.inputs["delta"]}
        >>> helm, angle = Channel("delta", "rad"), Channel("angle", "rad")
        >>> box = ServoBlackBox(
        ...     BlackBox("echo", echo, inputs=[helm], outputs=[angle], parameters=[]), {"delta": Order(rate_limit=0.1)}
        ... )
        >>> run = Trial("run", [0.0, 1.0, 2.0], {"delta": [0.0, 0.3, 0.3]}, {})
        >>> box.run(run, {"delta_rate_limit": 0.1}, None)[:, 0].round(3).tolist()
        [0.0, 0.1, 0.2]
    """

    def __init__(self, base: BlackBox, orders: Mapping[str, Order]) -> None:
        channels = checked_orders(base, orders)
        self.orders = dict(orders)
        super().__init__(
            base,
            self._around,
            parameters=[q for name, order in orders.items() for q in servo_parameters(channels[name], order)],
            title=f"{base.title}, with the servos of {', '.join(orders)}",
        )
        own = (Servo(name, servo_state(name), StatedSettings.of(name, order)) for name, order in orders.items())
        self.servos = (*base.servos, *own)
        self.delays = {**base.delays, **{name: order.delay for name, order in orders.items() if order.delay}}

    def _around(
        self,
        trial: Trial,
        parameters: dict[str, float],
        first_state: dict[str, float] | None,
        outside: Outside | None = None,
    ) -> Mapping[str, Array]:
        plain = {q.name: parameters[q.name] for q in self.base.parameters}
        y = self.base.run(behind_servos(self, trial, parameters), plain, first_state, outside)
        return {channel.name: y[:, k] for k, channel in enumerate(self.outputs)}

    def acting_inputs(self, trial: Trial, parameters: Mapping[str, float]) -> Trial:
        """See `BlackBox.acting_inputs`."""
        return self.base.acting_inputs(behind_servos(self, trial, parameters), parameters)


def with_servos(model: Model, orders: Mapping[str, Order]) -> Model:
    """Any model with servos in front of inputs that were recorded as orders.

    Raises:
        BadInput: see `WithServos` and `ServoBlackBox`.

    Example:
        >>> from seatruth import load_model
        >>> from seatruth.models import Order, with_servos
        >>> [servo.input for servo in with_servos(load_model("mmg"), {"delta": Order(lag=0.5)}).servos]
        ['delta']
    """
    return ServoBlackBox(model, orders) if isinstance(model, BlackBox) else WithServos(model, orders)


def behind_servos(box: BlackBox, trial: Trial, parameters: Mapping[str, float]) -> Trial:
    """The trial with the inputs behind all servos of a black box; itself where there are none or they have acted."""
    if isinstance(trial, ActingTrial) or not box.servos:
        return trial
    p = record("Parameters", box.parameters)(**{q.name: parameters[q.name] for q in box.parameters})
    columns = {
        servo.input: followed(
            trial.t, trial.inputs[servo.input], *servo.settings(p), box.delays.get(servo.input, 0.0), box.hold
        )
        for servo in box.servos
    }
    values = {one.name: getattr(trial, one.name) for one in fields(trial)}
    return ActingTrial(**{**values, "inputs": {**trial.inputs, **columns}})


def acting(model: Model, run: Trial, values: Mapping[str, float]) -> dict[str, Array]:
    """What the actuators behind a model's servos do along a run, (n,) by state, with these values of the parameters.

    A run starts at its first order. A section that begins under way has its actuators where they are by then.
    """
    if not model.servos:
        return {}
    p = record("Parameters", model.parameters)(**{q.name: values[q.name] for q in model.parameters})
    return {
        servo.state: followed(run.t, np.asarray(run.inputs[servo.input]), *servo.settings(p)) for servo in model.servos
    }


def followed(
    t: Array, order: Array, lag: float, slowness: float, delay: float = 0.0, hold: Literal["foh", "zoh"] = "foh"
) -> Array:
    """What an actuator does at the samples, (n,); its mean from each sample to the next where inputs are held.

    `t` (n,) s, `order` (n,) in the input's unit, `lag` and `delay` s, `slowness` s per unit of the input.

    Example:
        >>> import numpy as np
        >>> from seatruth.models.servo_black_box import followed
        >>> t, order = np.arange(4.0), np.array([0.0, 1.0, 1.0, 1.0])
        >>> followed(t, order, lag=0.0, slowness=2.0).round(3).tolist()
        [0.0, 0.5, 1.0, 1.0]
        >>> followed(t, order, lag=0.0, slowness=0.0, delay=1.0).tolist()
        [0.0, 0.0, 1.0, 1.0]
    """
    if len(t) < 2 or not (lag or slowness or delay):
        return np.array(order)
    if not (lag or slowness) and hold == "foh":
        return np.interp(t - delay, t, order)
    # The order has its corners and jumps at the samples, later by the dead time: between these times it is a line.
    late = t + delay
    late = late[late < t[-1]]
    after = np.searchsorted(t, late)
    late = late[np.minimum(late - t[after - 1], t[after] - late) > _SAME]
    edges = np.union1d(t, late)
    interval = np.searchsorted(t, edges[:-1], side="right") - 1
    length = np.diff(edges)
    if hold == "foh":
        at = np.interp(edges - delay, t, order)
        starts, ends = at[:-1], at[1:]
    else:
        middle = edges[:-1] + 0.5 * length - delay
        starts = ends = order[np.searchsorted(t, middle, side="right").clip(1, len(t)) - 1]
    z, found = float(order[0]), np.array(order)
    area = np.zeros(len(t) - 1)
    for k, h, now, later in zip(interval.tolist(), length.tolist(), starts.tolist(), ends.tolist()):
        first, half, z = stages(z, now, later, h, lag, slowness)
        area[k] += h * (first + 4.0 * half + z) / 6.0
        found[k + 1] = z
    return np.append(area / np.diff(t), z) if hold == "zoh" else found
