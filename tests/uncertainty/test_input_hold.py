"""Inputs that step, held between samples or joined by lines: the trials tell which. SYNTHETIC runs of a boat."""

from __future__ import annotations

import numpy as np
import pytest
from astray_boat import NOISE, TRUE, Boat, study

from seatruth import identify
from seatruth.costs.options import TrajectoryOptions
from seatruth.simulate import simulator
from seatruth.study import Study
from seatruth.trials.channel import Hold
from seatruth.trials.trial import Trial, Trials

STEP = 0.5
"""s between samples; half of it is a sixth of the boat's own lag."""


def recorded(truth: Hold, assumed: Hold) -> Study:
    """Two zigzags whose rudder steps as one of the two has it, in a study that assumes one of the two."""
    rng = np.random.default_rng(5)
    trials = []
    for number in range(2):
        t = np.arange(200) * STEP
        delta = np.where((t // (9.0 + 4.0 * number)) % 2 == 0, 0.35, -0.35)
        bare = Trial(f"run {number}", t, {"delta": delta}, {}, synthetic=True)
        engine = simulator(Boat(), [bare], values={**Boat().nominal(), **TRUE}, hold=truth)
        y = engine.outputs(np.zeros((1, 0)), np.zeros((1, 4))).y[0]
        outputs = {name: y[:, c] + rng.normal(size=t.size) * sd for c, (name, sd) in enumerate(NOISE.items())}
        trials.append(Trial(f"run {number}", t, {"delta": delta}, outputs, synthetic=True))
    return study(noise={}, cost=TrajectoryOptions(hold=assumed)).replace(trials=Trials(trials))


@pytest.mark.parametrize(
    ("truth", "assumed", "said"), [("zoh", "foh", True), ("foh", "foh", False), ("zoh", "zoh", False)]
)
def test_only_orders_that_were_joined_by_lines_are_told_of(truth: Hold, assumed: Hold, said: bool) -> None:
    found = identify(recorded(truth, assumed), threads=1)
    assert ("orders-step" in {finding.code for finding in found.findings}) == said
    if said:
        off = abs(found.parameters["value"]["T"] - TRUE["T"]) / found.parameters["stderr"]["T"]
        assert off > 3.0, "what it warns of"
