"""Trials cut into segments: where an actuator behind a servo stands when a segment begins."""

from __future__ import annotations

import numpy as np
import pytest
from known_runs import Yaw

from seatruth import identify
from seatruth.costs.options import TrajectoryOptions
from seatruth.models import Order, with_servos
from seatruth.models.servo_black_box import acting
from seatruth.simulate import simulator
from seatruth.study import Study
from seatruth.trials.trial import Trial, Trials

TRUE = {"K": 0.25, "T": 6.0, "c": 20.0, "delta_lag": 2.0}


def ordered(stated: float, segments: float | None) -> Study:
    """A ship whose rudder follows its orders with a lag; they change every 5 s, and segments begin in between."""
    model = with_servos(Yaw(), {"delta": Order(lag=stated)})
    t = np.arange(0.0, 120.0, 0.5)
    orders = 0.3 * np.random.default_rng(3).uniform(-1.0, 1.0, 30)[(t // 5.0).astype(int)]
    run = Trial("run", t, {"delta": orders}, {"psi": np.zeros_like(t), "r": np.zeros_like(t)})
    sim = simulator(model, [run], values={**model.nominal(), **TRUE})
    y = sim.outputs(np.zeros((1, 0)), sim.initial_states).y[0]
    parameters = tuple(q.replace(vary=q.name in TRUE) for q in model.parameters)
    options = TrajectoryOptions(segments=segments)
    seen = Trial("run", t, {"delta": orders}, {"psi": y[:, 0], "r": y[:, 1]})
    return Study("ordered", model, Trials([seen]), parameters=parameters, noise={"psi": 0.01, "r": 0.002}, cost=options)


@pytest.mark.parametrize(("stated", "segments"), [(2.0, None), (2.0, 7.0), (1.6, 12.0)])
def test_segments_find_the_lag_that_whole_trials_find(stated: float, segments: float | None) -> None:
    """Where each segment began at its first order, the time constant of 6 s was 10 s, and the lag of 2 s 1.4 s."""
    study = ordered(stated, segments)
    found = identify(study).values
    if stated == TRUE["delta_lag"]:
        assert {name: found[name] for name in TRUE} == pytest.approx(TRUE, rel=1e-3)
    else:  # half of what a stated lag is off stays in the starts of segments
        assert found["delta_lag"] == pytest.approx(TRUE["delta_lag"], rel=0.1)


def test_an_actuator_is_where_the_orders_of_the_whole_run_have_brought_it() -> None:
    study = ordered(2.0, None)
    (moved,) = acting(study.model, study.trials[0], study.space.nominal()).values()
    t, orders = study.trials[0].t, study.trials[0].inputs["delta"]
    assert moved[0] == orders[0]
    held = np.flatnonzero((t >= 20.0) & (t < 25.0))  # behind a line from 19.5 to 20 s the order rests
    left = orders[held[-1]] - moved[held]
    assert left[1:] / left[0] == pytest.approx(np.exp(-(t[held[1:]] - 20.0) / 2.0), rel=1e-6)
