"""[actuators]: an input that was recorded as an order gets a servo, with what the study says of it."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from seatruth import BadInput, load_study
from seatruth.sample import copy_to
from seatruth.study import Study


def study(folder: Path, actuators: str, model: str = "") -> Study:
    copy_to(folder)
    text = (folder / "study.toml").read_text()
    (folder / "s.toml").write_text(text.replace("[channels]", f"[actuators]\n{actuators}\n{model}\n[channels]", 1))
    return load_study(folder / "s.toml")


def test_an_order_gets_a_servo(tmp_path: Path) -> None:
    found = study(
        tmp_path,
        'delta = { record = "order", rate_limit = "2.3 deg/s", lag = 0.4, delay = "200 ms" }\nn = "order"',
        "[parameters]\ndelta_lag = { vary = true, max = 2.0 }",
    )
    values = {parameter.name: parameter for parameter in found.parameters}
    assert values["delta_rate_limit"].value == pytest.approx(math.radians(2.3))
    assert (values["delta_lag"].value, values["delta_lag"].vary, values["delta_lag"].max) == (0.4, True, 2.0)
    assert [servo.input for servo in found.model.servos] == ["delta", "n"]
    assert dict(found.model.delays) == {"delta": pytest.approx(0.2)}
    assert "delta_acting" in {state.name for state in found.model.states}


def test_what_acted_needs_none(tmp_path: Path) -> None:
    assert study(tmp_path, 'delta = "acting"').model.servos == ()


@pytest.mark.parametrize(
    ("actuators", "said"),
    [
        ('rudder = { record = "order" }', "no input 'rudder'"),
        ("delta = { lag = 0.5 }", "'lag' belongs to a servo"),
        ('delta = { record = "order", rate_limit = "2 m" }', "rate_limit"),
        ('delta = { record = "order", lag = "soon" }', "no number with a unit"),
        ('delta = { record = "order", lag = "0 s" }', "a lag of 0 s is not possible"),
        ('delta = { record = "commanded" }', "record"),
    ],
)
def test_what_is_wrong_is_said_with_its_line(tmp_path: Path, actuators: str, said: str) -> None:
    with pytest.raises(BadInput, match=said) as refused:
        study(tmp_path, actuators)
    assert "line 1" in str(refused.value)
