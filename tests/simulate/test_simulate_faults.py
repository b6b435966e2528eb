"""What is wrong with a model's equations is found without a trial, and is the model's."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from seatruth import BlackBox, Channel, Model, load_model
from seatruth.simulate.faults import fault_of

OWN = """
from seatruth import Channel, Model


class Own(Model):
    name = "own"
    states = outputs = (Channel("psi", "rad"), Channel("x", "m"))

    @staticmethod
    def rhs(s, i, p):
        return 0.1, {course} if s.psi > 1.0 else 1.0
"""


def test_a_name_that_a_file_lacks_is_told_with_its_line_and_its_import(tmp_path: Path) -> None:
    for course, do in (
        ("math.cos(s.psi)", 'Write "import math" at the top of the file.'),
        ("np.cos(s.psi)", 'Write "import numpy as np" at the top of the file.'),
        ("speed", "Define or import it in the model file."),
    ):
        (tmp_path / "own.py").write_text(OWN.format(course=course))
        fault = fault_of(load_model("own.py:Own", tmp_path))
        assert fault is not None
        assert fault.where == "model 'own', own.py, line 11"
        assert "rhs raises NameError" in fault.what
        assert fault.do == do


class Short(Model):
    """It forgets a rate."""

    name = "short"
    states = outputs = (Channel("u", "m/s"), Channel("r", "rad/s"))

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return (-s.u,)


def test_a_rate_too_few_is_a_fault_and_what_is_closed_is_none() -> None:
    fault = fault_of(Short())
    assert fault is not None
    assert "it returns 1 values, 2 are declared" in fault.what
    box = BlackBox("box", lambda trial, p, first: {}, inputs=[], outputs=[Channel("y", "m")], parameters=[])
    assert fault_of(box) is None


DECLARED = """
from seatruth import Channel, Model, Parameter
from seatruth.models import Dimensions, Thruster


class Own(Model):
    name = "own"
    states = outputs = (Channel("u", "m/s"),)
    inputs = (Channel("n", "rev/s"),)
    parameters = (Parameter("m", 9.0, "kg"),)
    actuators = (Thruster("port", "n", at=(0.0, 0.0, 0.0), towards=(1.0, 0.0, 0.0), full=9.0),)

    @staticmethod
    def rhs(s, i, p, e):
        return ((i.n - s.u + e.X) / p.m,)

    @staticmethod
    def {function}
"""


@pytest.mark.parametrize(
    ("function", "what", "do"),
    [
        ('dimensions(p): return Dimensions(3.0, 1.0, 0.2, p["m"], 1e3)', "dimensions cannot", "Write p.m, not p['m']"),
        ("dimensions(p): return 3.0, 1.0, 0.2", "missing 2 required positional arguments", ""),
        ("dimensions(p): return 3.0", "argument after * must be an iterable", ""),
        ("drag(s, i, p, e): return s.u * p.X_u", "drag cannot be compiled", ""),
        ("drag(s, i, p, e): return drag_of(s.u)", "drag raises NameError", "Define or import it"),
        ("thrust(s, i, p, e): return (i.n,)", "thrust cannot be compiled", ""),
        ("thrust(s, i, p): return i.n", "takes 3 positional arguments but 4 were given", ""),
        ("thrusts(s, i, p, e): return i.n, i.n", "it returns 2 values, 1 are declared", ""),
    ],
)
def test_what_is_declared_for_effects_is_tried_as_well(tmp_path: Path, function: str, what: str, do: str) -> None:
    (tmp_path / "own.py").write_text(DECLARED.format(function=function))
    fault = fault_of(load_model("own.py:Own", tmp_path))
    assert fault is not None
    assert what in fault.what
    assert "model 'own'" in fault.where
    assert fault.do.startswith(do)


def test_nothing_is_wrong_with_what_a_vehicle_declares_as_it_should(tmp_path: Path) -> None:
    for function in (
        "dimensions(p): return Dimensions(3.0, 1.0, 0.2, p.m, 1e3)",
        "dimensions(p): return 3.0, 1.0, 0.2, p.m, 1e3",
        "drag(s, i, p, e): return 2.0 if s.u > 1.0 else 1.0",
        "thrusts(s, i, p, e): return (i.n,)",
    ):
        (tmp_path / "own.py").write_text(DECLARED.format(function=function))
        assert fault_of(load_model("own.py:Own", tmp_path)) is None
