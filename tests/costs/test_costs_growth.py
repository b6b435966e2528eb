"""How far runs grow apart along a record: exact for a linear vehicle, the same for any length of pieces."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
import pytest

import seatruth.sample
from seatruth import Channel, Model, Parameter, Study, Trial, Trials, simulator
from seatruth.costs.growth import Growth, too_far


class Yaw(Model):
    """A rate of turn that grows by itself, and the heading."""

    name = "yaw"
    title = "yaw that grows"
    states = (Channel("r", "rad/s"), Channel("psi", "rad", angle=True))
    inputs = (Channel("delta", "rad"),)
    outputs = states
    parameters = (Parameter("T", 10.0, "s", min=1e-99, max=1e3, vary=True),)

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return (0.1 * i.delta + s.r) / p.T, s.r


T = 10.0


def study_of(time_constant: float, step: float = 1.0) -> Study:
    """Four trials of two minutes, as small as a pilot makes them."""
    rng, t = np.random.default_rng(1), np.arange(0.0, 120.0, step)
    runs = [
        Trial(
            name,
            t,
            {"delta": 0.1 * np.sin(t)},
            {"r": 0.01 * rng.normal(size=t.size), "psi": rng.normal(size=t.size)},
        )
        for name in ("circle", "zigzag", "straight", "stop")
    ]
    parameters = tuple(p.replace(value=time_constant) for p in Yaw.parameters)
    return Study(name="held", model=Yaw(), trials=Trials(runs), parameters=parameters)


def growth_of(study: Study) -> Growth:
    values = study.space.nominal()
    run = simulator(study.model, study.trials, (), values)
    return Growth(run, np.zeros(0), study.trials, values, ["r", "psi"])


def expected(study: Study, seconds: float, time_constant: float) -> float:
    """The largest singular value of the transition from the start to the end, in the spreads of the record."""
    r, psi = (np.concatenate([trial.outputs[name] for trial in study.trials]).std() for name in ("r", "psi"))
    grown = math.exp(seconds / time_constant)
    return float(np.linalg.norm([[grown, 0.0], [time_constant * (grown - 1.0) * r / psi, 1.0]], ord=2))


@pytest.mark.parametrize("step", [1.0, 0.25])
def test_growth_over_trials_and_sections_is_that_of_the_linear_vehicle(step: float) -> None:
    study = study_of(T, step)
    growth, last = growth_of(study), 120.0 - step
    assert growth.over(1) == pytest.approx(expected(study, last, T), rel=1e-3)
    assert len(growth.over(4)) == 4 * len(study.trials)
    # A section of whole pieces may be one of them longer or shorter.
    piece = max(5 * step, 1.2)
    low, high = (expected(study, last / 4 + more, T) for more in (-piece, piece))
    assert low < growth.over(4).min() <= growth.over(4).max() < high


def test_a_vehicle_that_holds_its_course_is_not_cut_and_one_that_a_pilot_holds_is() -> None:
    assert too_far(study_of(60.0)) is None
    held = too_far(study_of(T, 0.25))
    assert held is not None
    # exp(120 / 10) in all: three sections let errors grow by 55 each, two by 400.
    assert (held.sections, round(held.seconds)) == (3, 40)
    assert re.fullmatch(r"a small error grows 1[4-8]0,000 times along '(circle|zigzag|straight|stop)'", str(held))
    assert "over a million times" in str(too_far(study_of(5.0)))
    assert growth_of(study_of(2.0, 2.0)).sections == 2  # as many as 60 samples allow


def test_a_coarser_trial_and_a_piece_that_diverges_do_no_harm() -> None:
    study = study_of(T)
    finer, first, *others = growth_of(study).over(1), *study.trials
    coarser = study.with_trials(Trials([first.samples(np.arange(0, 120, 20)), *others]))
    assert growth_of(coarser).over(1)[1:] == pytest.approx(finer[1:], rel=1e-3)
    assert np.isfinite(growth_of(study_of(1e-90)).over(1)).all()


def test_the_sample_vessel_is_followed_over_whole_trials() -> None:
    assert too_far(seatruth.sample.load("diagnose.toml")) is None
