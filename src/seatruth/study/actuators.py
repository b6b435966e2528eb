"""What a study says of the actuators: whether a log holds what they did or what they were ordered, and their servos."""

from __future__ import annotations

from collections.abc import Mapping

from seatruth.errors import nearest
from seatruth.models.base import Model
from seatruth.models.servo_black_box import with_servos
from seatruth.models.with_servos import Order
from seatruth.study.quantity import positive
from seatruth.study.schema_trials import ActuatorTable
from seatruth.study.validation import Problems

_OF_A_SERVO = ("lag", "rate_limit", "delay")


def with_actuators(model: Model, stated: Mapping[str, ActuatorTable], problems: Problems) -> Model:
    """The model with a servo in front of each input that was recorded as an order; notes what is wrong."""
    channels = {channel.name: channel for channel in model.inputs}
    orders: dict[str, Order] = {}
    for name, table in stated.items():
        path = ("actuators", name)
        if name not in channels:
            problems.add(path, f"the model has no input {name!r}", nearest(name, channels))
            continue
        given = [key for key in _OF_A_SERVO if getattr(table, key) is not None]
        if table.record == "acting":
            if given:
                what = f"{given[0]!r} belongs to a servo, and the record holds what the actuator did"
                problems.add((*path, given[0]), what, 'Remove it, or say record = "order".')
            continue
        values = {}
        for key in given:
            with problems.at(*path, key):
                unit = f"{channels[name].unit}/s" if key == "rate_limit" else "s"
                values[key] = positive(getattr(table, key), unit, f"a {key.replace('_', ' ')}")
        orders[name] = Order(**values)
    return with_servos(model, orders) if orders and not problems else model
