"""What a satellite receiver gives against positions and the speed through the water: signs, axes and units."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from known_motion import Array, altered, codes, zigzag
from right_logs import right_log

from seatruth.trials import Trial
from seatruth.trials.check import check_trial
from seatruth.trials.check.ground_track import check_ground_track

KNOTS = 0.514444


def received(trial: Trial, seed: int = 0, noise: float = 0.03, current: complex = 0.0) -> Trial:
    """The trial with sog, cog and the speed through the water in the place of u and v."""
    rng = np.random.default_rng(seed)
    out = trial.outputs
    velocity = (out["u"] + 1j * out.get("v", 0.0)) * np.exp(1j * out["psi"])
    velocity = velocity + noise * (rng.standard_normal(len(trial)) + 1j * rng.standard_normal(len(trial)))
    through = (velocity - current) * np.exp(-1j * out["psi"])
    kept = {name: values for name, values in out.items() if name not in ("u", "v", "w")}
    own = {"sog": np.abs(velocity), "cog": np.angle(velocity) % (2 * np.pi), "u_w": through.real}
    return replace(trial, outputs={**kept, **own})


def log(current: complex = 0.0) -> Trial:
    return received(zigzag(amplitude=0.6, speed=3.0, current=current), current=current)


def test_a_right_log_raises_no_alarm() -> None:
    for current in (0.0, 0.4 + 0.3j):
        assert list(check_ground_track(log(current))) == []


@pytest.mark.parametrize(
    ("channels", "code", "channel", "said"),
    [
        ({"y": np.negative}, "position-axes", "y", "y counts the other way"),
        ({"x": np.negative}, "position-axes", "x", "x counts the other way"),
        ({"x": np.negative, "y": np.negative}, "position-axes", "x", "x and y both"),
        ({"sog": lambda v: v / KNOTS}, "unit", "sog", "stand in kn"),
        ({"sog": lambda v: 3.6 * v}, "unit", "sog", "stand in km/h"),
        ({"x": lambda x: 1e3 * x, "y": lambda y: 1e3 * y}, "unit", "x", "x and y stand in m, not in km"),
        ({"x": lambda x: 1e-3 * x, "y": lambda y: 1e-3 * y}, "unit", "x", "x and y stand in km, not in m"),
        ({"y": lambda y: 1e3 * y}, "unit", "y", "y stands in m, not in km"),
        ({"x": lambda x: x / 0.3048, "y": lambda y: y / 0.3048}, "unit", "x", "x and y stand in ft, not in m"),
    ],
)
def test_axes_and_units_are_named(
    channels: dict[str, Callable[[Array], Array]], code: str, channel: str, said: str
) -> None:
    (found,) = check_ground_track(altered(log(), channels))
    assert (found.severity, found.code, found.channel) == ("error", code, channel)
    assert said in found.message


def test_exchanged_columns_are_named() -> None:
    right = log()
    out = right.outputs
    (swapped,) = check_ground_track(replace(right, outputs={**out, "x": out["y"], "y": out["x"]}))
    assert swapped.code == "position-axes"
    assert "swapped" in swapped.message
    drifting = out["cog"] + 0.3 * np.tanh(out["r"] / 0.02)  # the bow points into the turn
    (exchanged,) = check_ground_track(replace(right, outputs={**out, "psi": out["cog"], "cog": drifting}))
    assert (exchanged.code, exchanged.channel) == ("heading-course", "cog")


@pytest.mark.parametrize(
    ("wrong", "said"), [(lambda psi: -psi, "counter-clockwise."), (lambda psi: np.pi / 2 - psi, "from east")]
)
def test_a_heading_that_counts_another_way_is_named(wrong: Callable[[Array], Array], said: str) -> None:
    turning = received(zigzag(amplitude=0.6, speed=3.0, period=150.0, course=0.7))
    kept = {name: values for name, values in turning.outputs.items() if name != "r"}
    assert list(check_ground_track(replace(turning, outputs=kept))) == []
    (found,) = check_ground_track(altered(replace(turning, outputs=kept), {"psi": wrong}))
    assert (found.code, found.channel) == ("heading-course", "psi")
    assert said in found.message


def test_velocities_north_and_east_serve_as_well() -> None:
    right = log()
    velocity = right.outputs["sog"] * np.exp(1j * right.outputs["cog"])
    kept = {name: values for name, values in right.outputs.items() if name not in ("sog", "cog")}
    other = replace(right, outputs={**kept, "v_n": velocity.real, "v_e": velocity.imag})
    assert list(check_ground_track(other)) == []
    (found,) = check_ground_track(altered(other, {"y": np.negative}))
    assert found.code == "position-axes"


def test_a_log_in_knots_is_named_where_the_vehicle_turns_and_a_current_is_no_unit() -> None:
    turning = zigzag(amplitude=0.6, speed=3.0, period=150.0)
    slow = altered(received(turning), {"u_w": lambda v: v / KNOTS})
    assert codes(list(check_ground_track(slow))) == {"unit"}
    # One course against a current of 0.486 of the speed: the same ratio, and no fault.
    straight = zigzag(amplitude=0.01, speed=3.0, course=0.0, current=-0.486 * 3.0)
    out = straight.outputs
    velocity = (out["u"] + 1j * out["v"]) * np.exp(1j * out["psi"]) - 0.486 * 3.0
    own = {"sog": np.abs(velocity), "cog": np.angle(velocity), "u_w": out["u"]}
    assert list(check_ground_track(replace(straight, outputs={**{k: out[k] for k in ("x", "y", "psi")}, **own}))) == []


def test_right_logs_of_all_vehicles_raise_no_alarm() -> None:
    for seed in range(18):
        trial, model = right_log(seed)
        if {"x", "y", "u", "psi"} <= {*trial.outputs} and "theta" not in trial.outputs:
            found = [f for f in check_trial(received(trial, seed), model) if f.severity == "error"]
            assert [f for f in found if f.code != "missing-channel"] == [], trial.name
