"""Orders that step are said where a study joins their samples by lines."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from astray_boat import study

from seatruth.analysis import check_study
from seatruth.costs.options import Hold, TrajectoryOptions
from seatruth.models import Order, with_servos
from seatruth.study import Study
from seatruth.trials.trial import Trials


def ordered(hold: Hold, *, smooth: bool = False) -> Study:
    plain = study(cost=TrajectoryOptions(hold=hold))
    trials = plain.trials
    if smooth:
        trials = Trials([replace(t, inputs={"delta": 0.3 * np.sin(0.5 * t.t)}) for t in trials])
    model = with_servos(plain.model, {"delta": Order(lag=0.5)})
    return Study("orders", model, trials, cost=plain.cost, noise=plain.noise)


@pytest.mark.parametrize(("hold", "smooth", "said"), [("foh", False, 1), ("zoh", False, 0), ("foh", True, 0)])
def test_orders_that_step_ask_for_a_hold(hold: Hold, smooth: bool, said: int) -> None:
    codes = [finding.code for finding in check_study(ordered(hold, smooth=smooth))]
    assert codes.count("orders-step") == said
    assert "input-jumps" not in codes  # the study has said that they are orders


def test_a_record_that_is_not_said_to_be_an_order_is_asked_about() -> None:
    codes = [finding.code for finding in check_study(study())]
    assert "input-jumps" in codes
    assert "orders-step" not in codes
