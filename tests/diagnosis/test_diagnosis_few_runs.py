"""The diagnosis of a black box: missing forces through its ports, derivatives from few runs, and a budget of them."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from black_box_boat import MOTION, PARAMETERS, PORTS, boat, box, study, trials

from seatruth import BadInput, BlackBox, Trial, diagnose
from seatruth.diagnosis.discrepancy.black_box import DiscrepancyBlackBox, inertias
from seatruth.diagnosis.few_runs import expected_evaluations
from seatruth.diagnosis.problem import Problem
from seatruth.diagnosis.settings import Settings
from seatruth.effects import load_effects
from seatruth.simulate import Meter, OutOfRuns


def test_a_port_shows_the_inertia_behind_it() -> None:
    one = study(box(), trials())
    scales = {"u": 1.5, "v": 0.2, "r": 0.1}
    first = {"u": 1.5, "v": 0.0, "r": 0.0, "psi": 0.0}
    found = inertias(one.model, one.trials[0], one.model.nominal(), first, scales)
    assert found == pytest.approx({"u": 100.0, "v": 100.0, "r": 300.0}, rel=0.07)

    def deaf(trial: Trial, p: dict[str, float], first: dict[str, float], outside: Any) -> dict[str, Any]:
        return boat(trial, p, first)

    model = BlackBox(
        "deaf", deaf, inputs=box().inputs, outputs=MOTION, states=MOTION, parameters=PARAMETERS, ports=PORTS
    )
    with pytest.raises(BadInput, match="through its port X does not change u"):
        inertias(model, one.trials[0], model.nominal(), first, scales)


def test_derivatives_are_those_of_the_simulator() -> None:
    problem = Problem(study(box(), trials()), load_effects(["rudder_offset", "gyro_bias"]), Settings())
    assert isinstance(problem.discrepancy, DiscrepancyBlackBox)
    assert list(problem.equations) == ["u", "v", "r"]
    at = problem.linearize(problem.start, ("rudder_offset", "gyro_bias"))
    step = np.zeros(len(problem.unknowns))
    step[problem.columns["rudder_offset"]] = 1e-4
    step[problem.columns["gyro_bias"]] = 1e-4
    step[problem.coefficients] = 1e-4
    step[problem.terms[:6]] = 1e-5
    local = np.full((2, at.local.shape[1]), 1e-5)
    moved = problem.errors(problem.moved(problem.start, step, local)) - at.errors
    predicted = at.shared @ step + np.einsum("nl,nl->n", at.local, local[problem.trial_of])
    assert moved == pytest.approx(predicted, abs=0.01 * float(np.abs(moved).max()))
    # Nothing new is simulated for the same point, and little for one nearby.
    spent = problem.meter.spent
    problem.linearize(problem.start, ("rudder_offset", "gyro_bias"))
    assert problem.meter.spent == spent
    near = problem.moved(problem.start, 1e-3 * step, np.zeros_like(local))
    problem.linearize(near, ("rudder_offset", "gyro_bias"))
    assert problem.meter.spent - spent == 2  # one run of two trials
    far = dataclasses.replace(problem.start, shared=problem.start.shared + 3e3 * step)
    problem.linearize(far, ())
    assert problem.meter.spent - spent > 4


def test_derivatives_of_another_motion_are_made_anew_where_they_mislead() -> None:
    problem = Problem(study(box(), trials()), load_effects(["rudder_offset"]), Settings())
    start = problem.linearize(problem.start, ("rudder_offset",))
    assert not problem.lent
    shared = problem.start.shared.copy()
    shared[problem.columns["rudder_offset"]] = 0.02
    moved = dataclasses.replace(problem.start, shared=shared)
    lent = problem.linearize(moved, ("rudder_offset",))
    assert problem.lent
    np.testing.assert_array_equal(lent.local, start.local)
    problem.renew()
    own = problem.linearize(moved, ("rudder_offset",))
    assert not problem.lent
    assert not np.array_equal(own.local, start.local)
    problem.linearize(problem.start, ("rudder_offset",))
    again = problem.linearize(moved, ("rudder_offset",))
    np.testing.assert_array_equal(again.local, own.local)


@pytest.mark.slow
def test_a_cause_is_named_and_what_is_unknown_is_seen() -> None:
    named = diagnose(study(box(), trials(offset=0.06)), ["rudder_offset", "gyro_bias"], threads=1, suggest=False)
    assert "rudder_offset" in named.named, str(named)
    assert named.discrepancy is not None
    assert named.outcome["evaluations"] > 50

    def odd(t: float, y: dict[str, float]) -> dict[str, float]:
        return {"X": -8.0 * float(t > 20.0), "Y": 0.0, "N": 12.0 * np.sin(t / 7.0)}

    one = study(box(), trials(odd))
    unknown = diagnose(one, ["rudder_offset", "gyro_bias"], threads=1, suggest=False, validate=False)
    assert unknown.verdict.kind == "unknown", str(unknown)
    blind = study(box({"force": ["X"]}), trials(odd))
    # It has a port for forces, and a current needs none: the water carries it.
    assert not [finding for finding in unknown.findings if finding.code == "no-ports"]
    assert set(Problem(blind, load_effects(["gyro_bias"]), Settings()).equations) == {"u"}


@pytest.mark.slow
def test_a_budget_ends_it_with_what_there_is() -> None:
    one = study(box(), trials(offset=0.06))
    with pytest.raises(BadInput, match=r"5 evaluations are too few to fit the model alone.*takes about"):
        diagnose(one, ["rudder_offset"], evaluations=5)
    full = diagnose(one, ["rudder_offset", "gyro_bias"], threads=1, suggest=False, validate=False)
    spent = full.outcome["evaluations"]
    cut = diagnose(one, ["rudder_offset", "gyro_bias"], evaluations=spent - 20, threads=1, suggest=False)
    assert cut.outcome["code"] == "budget"
    assert [finding for finding in cut.findings if finding.code == "budget-spent"]
    assert cut.outcome["evaluations"] <= spent - 20
    assert expected_evaluations(one, load_effects(["rudder_offset"]), Settings()) > 100


def test_without_ports_it_says_what_it_cannot_see() -> None:
    def plain(trial: Trial, p: dict[str, float], first: dict[str, float]) -> dict[str, Any]:
        return boat(trial, p, first)

    model = BlackBox("boat", plain, inputs=box().inputs, outputs=MOTION, states=MOTION, parameters=PARAMETERS)
    found = diagnose(study(model, trials(offset=0.06)), ["rudder_offset", "wind"], threads=1, suggest=False)
    assert found.discrepancy is None
    (finding,) = [finding for finding in found.findings if finding.code == "no-ports"]
    assert "no missing force can be looked for" in finding.message
    assert "wind" in finding.message
    assert "rudder_offset" in found.named, str(found)


def test_a_meter_ends_at_its_limit() -> None:
    meter = Meter(limit=3)
    meter.spend(3)
    with pytest.raises(OutOfRuns):
        meter.spend(1)
    assert meter.spent == 3
