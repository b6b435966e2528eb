"""The gap of three models, with initial states refitted."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
import small_case as small

from seatruth.diagnosis.gap import Gap, misfit, refit_initial_states
from seatruth.diagnosis.prediction_errors import noise_deviation
from seatruth.diagnosis.search import search
from seatruth.effects import available
from seatruth.models import load_model
from seatruth.trials.trial import Trial


def test_refitted_initial_states_take_no_other_gap(ship_folder: Path, offset_runs: list[Trial]) -> None:
    problem = small.problem(ship_folder, offset_runs)
    deviation = noise_deviation(problem, search(problem, small.silent).null.sizes)
    shifted = replace(problem.start, initial=problem.start.initial + 0.01)
    back = refit_initial_states(problem, shifted, deviation)
    before, start, after = (misfit(problem, deviation, p) for p in (shifted, problem.start, back))
    assert after <= min(before, start) + 1e-6
    np.testing.assert_array_equal(back.shared, problem.start.shared)
    np.testing.assert_array_equal(back.forces, problem.start.forces)
    assert after == pytest.approx(misfit(problem, deviation, refit_initial_states(problem, back, deviation)))


def test_refitted_initial_states_of_runs_that_bend_bring_them_nearer(tmp_path: Path) -> None:
    """A ship that holds no course: whole steps of its first turning rates lead to runs that diverge."""
    folder = small.folder_with_model(tmp_path)
    text = (folder / "ship.py").read_text()
    (folder / "ship.py").write_text(
        text.replace("(p.K * i.delta - s.r) / p.T", "(p.K * i.delta + s.r - 900 * s.r**3) / p.T")
    )
    problem = small.problem(folder, small.trials(folder))
    shared = problem.start.shared.copy()
    shared[problem.coefficients] *= 0.6
    astray = replace(problem.start, shared=shared)
    deviation = np.array([small.NOISE[name] for name in problem.outputs])
    near = refit_initial_states(problem, astray, deviation)
    again = refit_initial_states(problem, near, deviation)
    far, left, still = (misfit(problem, deviation, point) for point in (astray, near, again))
    assert left < 0.1 * far
    assert still <= left


def test_waves_are_measured_by_what_missing_forces_explain_as_well() -> None:
    """Of a calm basin: 88 of 16,000 nats, though they are all that the answer has; a heading bias is measured by the
    answer alone, since no force shows it."""

    def share(name: str) -> float:
        fits = {
            ((), True): SimpleNamespace(evidence=0.0),
            ((), False): SimpleNamespace(evidence=-16000.0),
        }
        settings = SimpleNamespace(stray=9.0)
        problem = SimpleNamespace(effects=available(), settings=settings, count=1000)
        gap = Gap(cast(Any, SimpleNamespace(fits=fits, problem=problem)), np.ones(1), (name,))
        gap.__dict__["shown"] = SimpleNamespace(evidence=88.0, discrepancy=True)
        gap.__dict__["misfits"] = {"refit": math.inf, "effects": math.inf}
        return gap.share(name)

    assert share("wave_forces") == pytest.approx(88.0 / 16088.0)
    assert share("heading_bias") == 1.0


@pytest.mark.parametrize(("explained", "expected"), [(760.0, 760.0 / 1400.0), (300.0, 0.0)])
def test_what_explains_most_is_not_small_though_whole_runs_come_no_nearer(
    monkeypatch: pytest.MonkeyPatch, explained: float, expected: float
) -> None:
    """A screw that is late: speeds come nearer, and positions, whose drift counts as slow noise, farther."""
    fits = {
        key: SimpleNamespace(evidence=evidence, point=None)
        for key, evidence in {((), False): -1000.0, (("thruster_lag_port",), False): -1000.0 + explained}.items()
    }
    settings = SimpleNamespace(stray=100.0, small_share=0.05)
    problem = SimpleNamespace(effects={"thruster_lag_port": available()["thruster_lag"]}, settings=settings, count=1000)
    leader = SimpleNamespace(evidence=400.0)
    gap = Gap(cast(Any, SimpleNamespace(fits=fits, problem=problem, leader=leader)), np.ones(1), ("thruster_lag_port",))
    gap.__dict__["misfits"] = {"refit": 13000.0, "effects": 17000.0}
    monkeypatch.setattr("seatruth.diagnosis.gap.without_discrepancy", lambda problem, point: point)
    monkeypatch.setattr("seatruth.diagnosis.gap.misfit", lambda *_: 13000.0)
    monkeypatch.setattr(Gap, "_closed_in_a_channel", lambda self, rest: 0.0)
    assert gap.share("thruster_lag_port") == pytest.approx(expected)


@pytest.mark.parametrize(("left", "expected"), [(2400.0, 0.5), (1450.0, 0.025)])
def test_an_error_of_a_sensor_is_measured_by_what_that_sensor_shows(
    monkeypatch: pytest.MonkeyPatch, left: float, expected: float
) -> None:
    """A late position of a craft whose heading its model misses by 19 times the noise, and one that closes nothing."""
    key = ("position_delay",)
    fits = {
        (): SimpleNamespace(evidence=-16000.0, point="left"),
        key: SimpleNamespace(evidence=-15900.0, point="named"),
    }
    settings = SimpleNamespace(stray=900.0, small_share=0.05)
    problem = SimpleNamespace(
        effects={key[0]: available()[key[0]]},
        settings=settings,
        count=2000,
        outputs=("x", "y", "psi"),
        channel_of=np.repeat([0, 1, 2], [500, 500, 1000]),
        study=SimpleNamespace(model=load_model("twin_thruster")),
    )
    search = SimpleNamespace(
        fits={(effects, False): fit for effects, fit in fits.items()}, problem=problem, leader=fits[key]
    )
    gap = Gap(cast(Any, search), np.ones(3), key)
    gap.__dict__["misfits"] = {"refit": 400000.0, "effects": 399000.0}
    gap.__dict__["points"] = {"effects": "named", "refit": "refit"}
    seen: list[int] = []

    def of(problem: Any, deviation: Any, point: Any, rows: Any = None) -> float:
        if rows is None:
            return 400000.0
        seen.append(int(rows.sum()))
        return {"left": left, "named": 1400.0, "refit": 3000.0}[point]

    monkeypatch.setattr("seatruth.diagnosis.gap.without_discrepancy", lambda problem, point: point)
    monkeypatch.setattr("seatruth.diagnosis.gap.misfit", of)
    monkeypatch.setattr(Gap, "_explained_without_forces", lambda self, rest: 0.0)
    monkeypatch.setattr(Gap, "_closed_in_a_channel", lambda self, rest: 0.0)
    assert gap.share(key[0]) == pytest.approx(expected)
    assert seen == [1000] * 3  # positions alone


@pytest.mark.parametrize(("u", "expected"), [((36000.0, 2000.0, 36000.0), 34 / 35), ((3500.0, 2000.0, 3500.0), 0.0)])
def test_what_closes_most_of_one_channel_is_not_small_beside_another_that_is_missed_by_more(
    monkeypatch: pytest.MonkeyPatch, u: tuple[float, float, float], expected: float
) -> None:
    """A current along the track closes the speed's misfit, 6 times the noise, and nothing of the depth's, 11 times;
    of a speed that is missed by less than twice its noise it would not matter."""
    key = ("current_along",)
    settings = SimpleNamespace(stray=900.0, small_share=0.05)
    problem = SimpleNamespace(
        effects={key[0]: available()[key[0]]}, settings=settings, outputs=("u", "z"),
        count=2000, channel_of=np.repeat([0, 1], [1000, 1000]),
    )  # fmt: skip
    fits = {((), False): SimpleNamespace(evidence=0.0, point="left")}
    gap = Gap(cast(Any, SimpleNamespace(fits=fits, problem=problem)), np.ones(2), key)
    gap.__dict__["points"] = {"effects": "named", "refit": "refit"}
    channels = {"left": (u[0], 121e4), "named": (u[1], 121e4), "refit": (u[2], 121e4)}
    gap.__dict__["misfits"] = {name: sum(channels[name]) for name in ("refit", "named")} | {
        "effects": sum(channels["named"])
    }

    def of(problem: Any, deviation: Any, point: Any, rows: Any = None) -> float:
        return sum(channels[point]) if rows is None else channels[point][0 if rows[0] else 1]

    monkeypatch.setattr("seatruth.diagnosis.gap.without_discrepancy", lambda problem, point: point)
    monkeypatch.setattr("seatruth.diagnosis.gap.misfit", of)
    monkeypatch.setattr(Gap, "_explained_without_forces", lambda self, rest: 0.0)
    shown = gap.share(key[0])
    assert shown == pytest.approx(expected, abs=0.002)


@pytest.mark.parametrize(
    ("refit", "effects", "share", "of_evidence"),
    [
        (300e3, 1000.0, 1.0, False),  # the misfit tells the same
        (250e3, 54e3, 1.0, True),  # a planing boat: 100 % beside 79 % of the misfit
        (50e3, 1000.0, 0.5, False),  # runs do not stray
        (math.inf, 1000.0, 1.0, True),
    ],
)
def test_a_share_of_the_evidence_is_told_where_the_misfit_tells_another(
    monkeypatch: pytest.MonkeyPatch, refit: float, effects: float, share: float, of_evidence: bool
) -> None:
    problem = SimpleNamespace(settings=SimpleNamespace(stray=100.0, small_share=0.05), count=1000)
    gap = Gap(cast(Any, SimpleNamespace(fits={}, problem=problem)), np.ones(1), ("current",))
    gap.__dict__["misfits"] = {"refit": refit, "effects": effects}
    monkeypatch.setattr(Gap, "share", lambda self, name: share)
    assert gap.is_of_evidence("current") == of_evidence


def test_the_size_of_an_effect_is_told_in_typical_ones(ship_folder: Path, offset_runs: list[Trial]) -> None:
    """Of a rudder 0.02 rad is typical."""
    found = search(small.problem(ship_folder, offset_runs), small.silent)
    key = ("rudder_offset",)
    gap = Gap(found, noise_deviation(found.problem, found.null.sizes), key)
    value = float(gap.shown.point.shared[found.problem.columns[key[0]][0]])
    assert gap.typical_sizes(key[0]) == pytest.approx(abs(value) / 0.02)
    assert gap.closed_in_its_sensor(key[0]) == 0.0  # it is no error of a sensor
