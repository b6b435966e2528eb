"""Runs that are led along the recorded speeds, and what helps on trials left out."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import small_case as small
from seatruth.diagnosis.cross_validation.retain_predictive import lasting, predictive
from seatruth.diagnosis.noise import white_floor
from seatruth.diagnosis.observer import astray, gains, led, led_floor, with_record
from small_case import TRUE, folder_with_model, study, trials

from seatruth import diagnose
from seatruth.diagnosis.fit import Fit, fit
from seatruth.diagnosis.problem import GapProblem, Linear
from seatruth.effects import load_effects
from seatruth.models import load_model
from seatruth.trials.trial import Trial

WRONG = {"K": 0.04, "T": 30.0}
"""Coefficients far from what the trials were made with."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return folder_with_model(tmp_path_factory.mktemp("led"))


def problem_of(folder: Path, runs: list[Trial], values: dict[str, float], effects: tuple[str, ...] = ()) -> GapProblem:
    base = study(folder, runs)
    held = tuple(p.replace(value=values[p.name], prior=None, vary=False) for p in base.parameters)
    names = effects or ("gyro_bias", "rudder_offset")
    return GapProblem(base.replace(parameters=held), load_effects(names, folder), threads=1)


def rms(problem: GapProblem, channel: str, x: np.ndarray | None = None) -> float:
    errors = problem.errors(problem.start if x is None else x, problem.active(()))
    return float(np.sqrt(np.mean(errors[problem.channel_of == problem.outputs.index(channel)] ** 2)))


def test_a_led_run_keeps_to_its_record_whatever_the_model_lacks(folder: Path) -> None:
    plain = problem_of(folder, trials(folder), WRONG)
    other = led(plain)
    assert other is not None
    assert rms(plain, "psi") > 0.2
    assert rms(other, "psi") < 0.02
    assert rms(other, "r") < 0.7 * rms(plain, "r")
    assert other.names == plain.names


def test_an_error_of_a_sensor_keeps_its_whole_trace(folder: Path) -> None:
    """A biased rate gyro: the heading is the integral of the rate less the bias, whatever turns the ship."""
    bias = 0.002
    runs = trials(folder, {"gyro_bias_b": bias}, specs=("gyro_bias",))
    other = led(problem_of(folder, runs, WRONG))
    assert other is not None
    started = led_floor(other, [other.start])
    assert started is not None
    floor, _, base = started
    found = fit(other, ("gyro_bias",), floor, base.x)
    column = int(other.columns["gyro_bias"][0])
    assert found.evidence > base.evidence + 50.0
    assert found.x[column] == pytest.approx(bias, abs=4.0 * found.stderr(other)[column])
    assert found.stderr(other)[column] < 0.1 * bias


def test_only_recorded_speeds_are_led(folder: Path) -> None:
    plain = problem_of(folder, trials(folder), TRUE)
    assert set(gains(plain)) == {"r"}
    without = [dataclasses.replace(t, outputs={"psi": t.outputs["psi"]}) for t in trials(folder)]
    blind = problem_of(folder, without, TRUE)
    assert gains(blind) == {}
    assert led(blind) is None


def test_a_gap_in_the_record_is_bridged_and_marked() -> None:
    t = np.arange(5.0)
    r = np.array([0.0, 1.0, np.nan, 3.0, 4.0])
    trial = with_record(Trial("a", t, {"delta": 0.0 * t}, {"r": r}), ["r"])
    assert trial.inputs["seen_r"] == pytest.approx(t)
    assert trial.inputs["has_r"] == pytest.approx([1.0, 1.0, 0.0, 1.0, 1.0])
    assert np.isnan(trial.outputs["r"][2])


def test_a_run_strays_where_no_noise_can_be_so_large(folder: Path) -> None:
    runs = trials(folder)
    wrong, right = problem_of(folder, runs, WRONG), problem_of(folder, runs, TRUE)

    def at(problem: GapProblem) -> Fit:
        floor = white_floor(problem.series, {"r": 0.01, "psi": 0.1})
        return fit(problem, (), floor, problem.start)

    assert astray(wrong, at(wrong))
    assert not astray(right, at(right))
    stated = GapProblem(wrong.study.replace(noise={"r": 0.01, "psi": 0.1}), list(wrong.effects.values()), threads=1)
    assert not astray(stated, at(stated))


SHIP = '''
from ship import Nomoto as Plain


class Nomoto(Plain):
    """With a turning moment that nobody has a name for."""

    name = "odd"

    @staticmethod
    def rhs(s, i, p):
        return (p.K * i.delta * (1.0 + 60.0 * s.r * s.r) - s.r - 40.0 * s.r * s.r * s.r) / p.T, s.r
'''


def test_a_sensor_is_found_beside_something_that_has_no_name(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(folder))
    (folder / "odd.py").write_text(SHIP)

    odd = load_model("odd.py:Nomoto", folder)
    monkeypatch.setattr(small, "load_model", lambda *_: odd)
    runs = trials(folder, {"gyro_bias_b": 0.004}, specs=("gyro_bias",))
    monkeypatch.undo()
    found = diagnose(
        study(folder, runs), load_effects(("gyro_bias", "rudder_offset", "rudder_gain"), folder), threads=1
    )
    assert "gyro_bias" in found.verdict["effects"]
    row = next(r for r in found.which if r["name"] == "gyro_bias")["parameters"][0]
    assert row["value"] == pytest.approx(0.004, abs=4.0 * row["stderr"])


def linear_case(gains_of_b: list[float]) -> Any:
    """Four trials of a linear model: "a" acts alike in all of them, "b" as told in each."""
    rng = np.random.default_rng(3)
    rows, trial_of = 80, np.repeat(np.arange(4), 20)
    A = rng.normal(size=(rows, 3))
    A[:, 2] *= np.abs(rng.normal(size=rows)) + 0.5
    y = A[:, 1] * 2.0 + A[:, 2] * np.asarray(gains_of_b)[trial_of] + 0.3 * rng.normal(size=rows)
    problem = SimpleNamespace(rows=rows, trial_of=trial_of, trials=[None] * 4, sd=np.full(3, 10.0), mean=np.zeros(3))
    fits = {}
    for key, columns in (((), [0]), (("a",), [0, 1]), (("b",), [0, 2]), (("a", "b"), [0, 1, 2])):
        active = np.array(columns)
        slopes = -A[:, columns] / 0.3
        x = np.zeros(3)
        x[active] = np.linalg.solve(slopes.T @ slopes + 0.01 * np.eye(len(columns)), -slopes.T @ (y / 0.3))
        linear = Linear(x, y / 0.3 + slopes @ x[active], slopes)
        fits[key] = Fit(key, x, active, 0.0, 0.0, linear, np.eye(len(columns)), True)
    return SimpleNamespace(problem=problem, fits=fits, base=fits[()], floor=None)


def test_what_helps_on_trials_left_out_is_kept() -> None:
    assert lasting(linear_case([1.0, 1.1, 0.9, 1.0]), ("a", "b")) == ("a", "b")


def test_what_helps_in_one_trial_only_is_refused() -> None:
    assert lasting(linear_case([2.0, 0.0, -0.6, 0.1]), ("b", "a")) == ("a",)


def test_the_probability_of_a_trial_left_out_is_that_of_a_normal_law() -> None:
    from scipy.stats import multivariate_normal

    case = linear_case([1.0, 1.0, 1.0, 1.0])
    problem, at = case.problem, case.fits[("a", "b")]
    # At x = 0 the errors are the data themselves: normal, with the priors' covariance and unit noise.
    y, A = at.linear.errors - at.linear.slopes @ at.x[at.active], at.linear.slopes
    covariance = np.eye(80) + A @ np.diag(problem.sd[at.active] ** 2) @ A.T

    def log_density(rows: np.ndarray) -> float:
        law = multivariate_normal(np.zeros(int(rows.sum())), covariance[np.ix_(rows, rows)])
        return float(law.logpdf(y[rows])) + 0.5 * int(rows.sum()) * float(np.log(2.0 * np.pi))

    everything = np.ones(80, dtype=bool)
    wanted = [log_density(everything) - log_density(problem.trial_of != k) for k in range(4)]
    assert predictive(problem, at) == pytest.approx(wanted, abs=1e-6)
