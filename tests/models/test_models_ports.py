"""Ports: which components there are, and what a black box gets through them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from seatruth.errors import BadInput
from seatruth.models import BlackBox, Channel, Ports
from seatruth.models.ports import as_ports, unit_of
from seatruth.trials import Trial


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"force": ["X", "y"]}, "no component 'y'"),
        ({"force": ["X", "X"]}, "twice"),
        ({"forces": ["X"]}, "no port 'forces'"),
        ({"force": "X"}, r"force = \[\"X\"\]"),
        ({"current": ["north", "v_c"]}, "earth axes and in body axes"),
    ],
)
def test_wrong_ports_are_refused(given: Any, message: str) -> None:
    with pytest.raises(BadInput, match=message):
        as_ports(given)


def test_units_and_nothing() -> None:
    ports = as_ports({"force": ["N"], "current": ["u_c"]})
    assert [unit_of(name) for name in ports.components] == ["N*m", "m/s"]
    assert ports.nothing(0.0, {}) == {"N": 0.0, "u_c": 0.0}
    assert ports
    assert not Ports()


def test_a_black_box_asks_for_what_acts_outside() -> None:
    def run(trial: Trial, p: dict[str, float], first: Any, outside: Any) -> dict[str, Any]:
        u = [0.0]
        for k in range(1, len(trial)):
            u.append(u[-1] + outside(float(trial.t[k - 1]), {"u": u[-1]})["X"] / p["m"])
        return {"u": u}

    box = BlackBox(
        "cart",
        run,
        inputs=[],
        outputs=[Channel("u", "m/s")],
        parameters=[],
        ports={"force": ["X"]},
    )
    trial = Trial("run", np.arange(4.0), {}, {})
    assert box.run(trial, {"m": 2.0}, None)[:, 0].tolist() == [0.0, 0.0, 0.0, 0.0]
    pushed = box.run(trial, {"m": 2.0}, None, lambda t, y: {"X": 4.0 - 2.0 * y["u"]})
    assert pushed[:, 0].tolist() == [0.0, 2.0, 2.0, 2.0]
    assert box.innermost is box
