"""Where runs stray, other ways into the problem are tried once, and what they give is said."""

from __future__ import annotations

import numpy as np
import pytest
from astray_boat import TRUE, study

from seatruth import identify
from seatruth.costs import cost_of
from seatruth.costs.options import RegressionOptions, TrajectoryOptions
from seatruth.optimizers import minimise
from seatruth.uncertainty.remedy import other_ways, remedy_finding

WRONG = {"K": -1.0, "U": -3.0}


def test_segments_lead_out_of_a_wrong_optimum() -> None:
    made = study(values=WRONG, cost=TrajectoryOptions(initial="free"))
    outcome = minimise(cost_of(made, threads=1))
    remedy = other_ways(made, outcome, more_starts=True, threads=1)
    assert remedy is not None
    assert remedy.way == "by way of segments of 7.5 s"
    assert remedy.strays == []
    assert dict(zip(TRUE, remedy.outcome.x)) == pytest.approx(TRUE, rel=0.01)
    assert remedy.outcome.value < outcome.value
    found = remedy_finding(remedy, outcome.value, 1.0, made.free)
    assert (found.code, found.severity) == ("better-optimum", "warning")
    assert "K = 0.5, T = 3.0" in found.message


def test_other_starts_lead_out_where_segments_do_not() -> None:
    """With r = 0 at the start of each segment they say nothing of a steady turn."""
    made = study(values=WRONG)
    outcome = minimise(cost_of(made, threads=1))
    alone = other_ways(made, outcome, more_starts=False, threads=1)
    assert alone is not None
    assert len(alone.strays) == 1
    assert remedy_finding(alone, outcome.value, 1e4, made.free).code == "no-better-optimum"
    remedy = other_ways(made, outcome, more_starts=True, threads=1)
    assert remedy is not None
    assert "other starts" in remedy.way
    assert remedy.evaluations > alone.evaluations
    assert dict(zip(TRUE, remedy.outcome.x)) == pytest.approx(TRUE, rel=0.03)


def test_the_answer_stays_the_one_that_the_study_asks_for() -> None:
    made = study(values=WRONG)
    outcome = minimise(cost_of(made, threads=1))
    found = identify(made, threads=1)
    assert np.array_equal(list(found.values.values()), outcome.x)
    assert found.outcome["evaluations"] == outcome.evaluations
    assert any(finding.code == "better-optimum" for finding in found.findings)


def test_a_regression_simulates_no_run_that_could_stray() -> None:
    made = study(values=WRONG)
    outcome = minimise(cost_of(made, threads=1))
    assert other_ways(made.replace(cost=RegressionOptions()), outcome, more_starts=True, threads=1) is None
