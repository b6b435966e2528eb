"""A fit that misses speeds or rates by far more than the noise of their records is said to."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from seatruth import Channel, Model, Parameter, Study, identify
from seatruth.trials.trial import Trial, Trials


class Coast(Model):
    """A boat that is slowed by a drag in proportion to its speed."""

    name = "coast"
    title = "Thrust against a linear drag"
    states = (Channel("u", "m/s"),)
    inputs = (Channel("push", "m/s2"),)
    outputs = states
    parameters = (Parameter("drag", 0.2, "1/s", 0.01, 2.0, vary=True, source="test"),)

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return (i.push - p.drag * s.u,)


def recorded(quadratic: float, *, noise: float = 0.01, digits: int = 6) -> Trial:
    """SYNTHETIC: pushes of 20 s of a boat whose drag has a quadratic part as well."""
    t = np.arange(0.0, 120.0, 0.25)
    push = 0.1 + 0.4 * (np.sin(2 * np.pi * t / 40.0) > 0)
    u = [0.5]
    for k in range(len(t) - 1):
        speed = u[-1]
        for _ in range(25):
            speed += 0.01 * (push[k] - 0.3 * speed - quadratic * speed * abs(speed))
        u.append(speed)
    noisy = np.round(np.array(u) + noise * np.random.default_rng(2).normal(size=len(t)), digits)
    return Trial("pushes", t, {"push": push}, {"u": noisy}, synthetic=True)


def codes(trial: Trial, **changes: Any) -> list[str]:
    from seatruth.costs.options import TrajectoryOptions

    made = Study("coast", Coast(), Trials([trial]), cost=TrajectoryOptions(hold="zoh"), **changes)
    return [finding.code for finding in identify(made, threads=1).findings]


def test_a_drag_of_another_form_is_said_though_its_coefficient_looks_identified() -> None:
    assert "beyond-noise" in codes(recorded(0.4))


@pytest.mark.parametrize("digits", [6, 1])
def test_a_right_model_is_left_alone_also_where_its_record_is_rounded(digits: int) -> None:
    assert "beyond-noise" not in codes(recorded(0.0, digits=digits))
    assert "beyond-noise" not in codes(recorded(0.0, noise=0.0, digits=digits))


def test_a_stated_noise_is_believed() -> None:
    assert "beyond-noise" not in codes(recorded(0.4), noise={"u": 0.2})


def test_gaps_do_not_hide_the_noise() -> None:
    trial = recorded(0.0)
    u = trial.outputs["u"].copy()
    u[100:140] = np.nan
    assert "beyond-noise" not in codes(replace(trial, outputs={"u": u}))


class Track(Coast):
    """The boat with its position and a heading that nothing turns."""

    name = "track"
    states = (Channel("u", "m/s"), Channel("x", "m"), Channel("psi", "rad", angle=True))
    outputs = states

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return i.push - p.drag * s.u, s.u, 0.0 * s.u


def tracked(drift: float, off: float, **noise: float) -> list[str]:
    """Findings where the receiver drifts by so many m to either side, and the compass by so many rad."""
    rng = np.random.default_rng(4)
    trial = recorded(0.0)
    x = np.concatenate(([0.0], np.cumsum(0.25 * trial.outputs["u"][:-1])))
    swing = off * np.sin(2.0 * np.pi * trial.t / 60.0)
    outputs = {
        "u": trial.outputs["u"],
        "x": x + drift * np.sin(2.0 * np.pi * trial.t / 45.0) + 0.02 * rng.normal(size=len(x)),
        "psi": swing + 0.003 * rng.normal(size=len(x)),
    }
    made = Study("track", Track(), Trials([replace(trial, outputs=outputs)]), noise=noise)
    return [finding.code for finding in identify(made, threads=1).findings]


def test_positions_are_judged_by_a_stated_noise_and_angles_where_they_are_off_by_degrees() -> None:
    """A receiver may drift by metres unseen by its roughness; a compass that is 6 deg off is none of its noise."""
    assert "beyond-noise" not in tracked(0.3, 0.0)
    assert "beyond-noise" in tracked(0.3, 0.0, x=0.02)
    assert "beyond-noise" in tracked(0.0, 0.1)
    assert "beyond-noise" not in tracked(0.0, 0.01)
    assert "beyond-noise" in tracked(0.0, 0.1, psi=0.003)
