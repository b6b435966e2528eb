"""What is wrong with a model's equations is found without a trial, and is the model's."""

from __future__ import annotations

from pathlib import Path
from typing import Any

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
