"""The diagnosis of a black box: missing forces through its ports, derivatives from few runs, and a budget of them."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from seatruth import BadInput, BlackBox, Channel, Parameter, Prior, Study, Trial, Trials, diagnose
from seatruth.diagnosis.discrepancy.black_box import DiscrepancyBlackBox, inertias
from seatruth.diagnosis.few_runs import expected_evaluations
from seatruth.diagnosis.problem import Problem
from seatruth.diagnosis.settings import Settings
from seatruth.effects import load_effects
from seatruth.models.base import Model
from seatruth.simulate import Meter, OutOfRuns

MOTION = (Channel("u", "m/s"), Channel("v", "m/s"), Channel("r", "rad/s"), Channel("psi", "rad", angle=True))
PARAMETERS = (
    Parameter("m", 100.0, "kg"),
    Parameter("X_uu", -8.0, "kg/m", vary=True, prior=Prior(-8.0, 1.0)),
    Parameter("Y_v", -60.0, "kg/s"),
    Parameter("I", 300.0, "kg*m^2"),
    Parameter("N_r", -150.0, "kg*m^2/s", vary=True, prior=Prior(-150.0, 20.0)),
    Parameter("N_d", 60.0, "N*m"),
)


def rates(y: Any, delta: Any, n: Any, p: Any, X: Any, Y: Any, N: Any) -> tuple[Any, ...]:
    """d/dt of u, v, r, psi of a small boat under a thrust of n."""
    u, v, r, _ = y
    return (
        (n + p["X_uu"] * u * abs(u) + X) / p["m"] + v * r,
        (p["Y_v"] * v + Y) / p["m"] - u * r,
        (p["N_r"] * r + p["N_d"] * delta * u + N) / p["I"],
        r,
    )


def boat(trial: Trial, p: dict[str, float], first: dict[str, float], outside: Any = None) -> dict[str, Any]:
    """Half-second steps of the midpoint rule."""
    y = np.array([first[channel.name] for channel in MOTION])
    rows = [y]
    for k in range(len(trial) - 1):
        h = float(trial.t[k + 1] - trial.t[k])
        delta, n = (0.5 * (trial.inputs[i][k] + trial.inputs[i][k + 1]) for i in ("delta", "n"))
        f = outside(float(trial.t[k]), dict(zip(first, y))) if outside else {"X": 0.0, "Y": 0.0, "N": 0.0}
        forces = (f["X"], f.get("Y", 0.0), f.get("N", 0.0))
        half = y + 0.5 * h * np.array(rates(y, delta, n, p, *forces))
        y = y + h * np.array(rates(half, delta, n, p, *forces))
        rows.append(y)
    return {channel.name: np.array(rows)[:, k] for k, channel in enumerate(MOTION)}


PORTS = {"force": ["X", "Y", "N"]}


def box(ports: Any = PORTS) -> BlackBox:
    return BlackBox(
        "boat",
        boat,
        inputs=[Channel("delta", "rad"), Channel("n", "N")],
        outputs=MOTION,
        states=MOTION,
        parameters=PARAMETERS,
        ports=ports,
    )


def trials(push: Any = lambda t, y: {"X": 0.0, "Y": 0.0, "N": 0.0}, *, offset: float = 0.0) -> Trials:
    rng, found = np.random.default_rng(4), []
    for number, period in enumerate((20.0, 33.0)):
        t = np.arange(0.0, 50.0, 0.5)
        inputs = {"delta": 0.3 * np.sin(2 * np.pi * t / period), "n": 20.0 + 10.0 * (t > 25.0)}
        acting = {**inputs, "delta": inputs["delta"] + offset}
        first = {"u": 1.5, "v": 0.0, "r": 0.0, "psi": 0.0}
        p = {q.name: q.value for q in PARAMETERS}
        y = boat(Trial("run", t, acting, {}), p, first, push)
        noise = {"u": 0.01, "v": 0.01, "r": 0.002, "psi": 0.005}
        outputs = {name: values + rng.normal(0.0, noise[name], t.size) for name, values in y.items()}
        found.append(Trial(f"run{number}", t, inputs, outputs, synthetic=True))
    return Trials(found)


NOISE = {"u": 0.01, "v": 0.01, "r": 0.002, "psi": 0.005}


def study(model: Model, runs: Trials) -> Study:
    return Study("boat", model, runs, noise=NOISE)


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
    assert not [finding for finding in unknown.findings if finding.code == "no-ports" and "force" in finding.message]
    assert [finding for finding in unknown.findings if finding.code == "no-ports" and "current" in finding.message]
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
