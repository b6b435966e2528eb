"""What all backends share: parameters, initial states, and the shapes that are refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from known_models import Lag, step_record

from seatruth.simulate import Backend, simulator

BACKENDS: tuple[Backend, ...] = ("compiled", "reference")


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda sim: sim.outputs(np.ones(1), sim.initial_states), "theta has shape"),
        (lambda sim: sim.outputs(np.ones((2, 2)), sim.initial_states), "theta has shape"),
        (lambda sim: sim.states(np.ones((1, 1)), sim.initial_states), "theta has shape"),
        (lambda sim: sim.outputs(np.ones((2, 1)), np.ones((2, 2))), "x0 has shape"),
        (lambda sim: sim.squared_errors(np.ones((2, 1)), sim.initial_states, np.ones(2)), "weights have shape"),
    ],
)
def test_wrong_shapes_are_refused(backend: Backend, call: Any, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        call(simulator(Lag(), [step_record(5)], free=("k",), backend=backend))
