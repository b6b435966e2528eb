"""Manoeuvres are recognised in a long log with the limits that they had, and nowhere else."""

from __future__ import annotations

import functools
import itertools
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from long_log import long_log

from seatruth.manoeuvres import PitchZigzag, run_manoeuvre, turning_circle_figures, zigzag_figures
from seatruth.manoeuvres.recognise import APPROACH, recognise
from seatruth.models import Model, load_model
from seatruth.trials import Channel, Trial
from seatruth.trials.stretches import Stretch

LABELS = {
    "zigzag": ("zigzag 20/", "zigzag 10/"),
    "turning circle": ("turning circle 35 starboard", "turning circle 20 port"),
    "stop": ("coast-down",),
}


@functools.cache
def sailed() -> tuple[Trial, list[tuple[str, float, float]]]:
    return long_log()


def without_straights(log: Trial) -> list[Stretch]:
    return [stretch for stretch in recognise(log) if stretch.kind != "straight run"]


def test_every_manoeuvre_is_found_with_its_limits() -> None:
    log, true = sailed()
    true = [one for one in true if one[0] != "straight run"]
    found = without_straights(log)
    assert [stretch.kind for stretch in found] == [kind for kind, _, _ in true]
    for stretch, (kind, start, end) in zip(found, true):
        assert stretch.label.startswith(LABELS[kind]), stretch.label
        assert start - APPROACH - 1.0 <= stretch.start <= start + 1.0
        assert stretch.end == pytest.approx(end, abs=2.0)


def test_the_ordered_straight_run_is_part_of_one_that_is_found() -> None:
    log, true = sailed()
    start, end = next((a, b) for kind, a, b in true if kind == "straight run")
    assert any(s.kind == "straight run" and s.start <= start and s.end >= end for s in recognise(log))


def test_no_sample_belongs_to_two_manoeuvres_and_names_differ() -> None:
    found = recognise(sailed()[0])
    assert all(one.end < other.start for one, other in itertools.pairwise(found))
    assert len({stretch.name for stretch in found}) == len(found)


def test_what_is_found_gives_the_figures_of_its_kind() -> None:
    log, _ = sailed()
    for stretch in without_straights(log):
        rows = np.flatnonzero((log.t >= stretch.start) & (log.t <= stretch.end))
        trial = log.section(int(rows[0]), int(rows[-1]) + 1)
        if stretch.kind == "zigzag":
            assert zigzag_figures(trial).rudder == pytest.approx(math.radians(float(stretch.label[7:9])), abs=0.01)
        elif stretch.kind == "turning circle":
            assert np.isfinite(turning_circle_figures(trial).tactical_diameter)


def test_heading_may_jump_and_channels_may_be_missing() -> None:
    log, _ = sailed()
    compass = replace(log, outputs={**log.outputs, "psi": np.mod(log.outputs["psi"], 2 * np.pi)})
    assert recognise(compass) == recognise(log)
    kinds = [
        stretch.kind for stretch in recognise(replace(log, outputs={"r": log.outputs["r"], "u": log.outputs["u"]}))
    ]
    assert kinds.count("turning circle") == 2
    assert kinds.count("zigzag") == 2
    tracked = replace(log, outputs={name: log.outputs[name] for name in ("x", "y", "psi")})
    assert [s.kind for s in without_straights(tracked)] == [s.kind for s in without_straights(log)]
    assert recognise(replace(log, inputs={}, outputs={"x": log.outputs["x"]})) == []


def test_no_manoeuvre_spans_a_pause() -> None:
    log, true = sailed()
    t = np.array(log.t)
    middle = 0.5 * (true[1][1] + true[1][2])
    t[t > middle] += 60.0
    found = recognise(replace(log, t=t))
    assert not any(stretch.start < middle < stretch.end for stretch in found)


def test_the_way_in_a_pause_is_no_speed() -> None:
    """Positions give the speed within a part of the log; in the pause the vehicle may have gone anywhere."""
    t = np.concatenate([np.arange(60.0), 900.0 + np.arange(60.0)])
    x = np.concatenate([2.0 * np.arange(60.0), 90_000.0 + 2.0 * np.arange(60.0)])
    log = Trial("day", t, {"delta": np.zeros(t.size)}, {"x": x, "y": np.zeros(t.size), "psi": np.zeros(t.size)})
    assert [(s.start, s.end, s.facts.split(",")[0]) for s in recognise(log)] == [
        (0.0, 59.0, "speed 2 m/s"),
        (900.0, 959.0, "speed 2 m/s"),
    ]


def slowing(drive: str) -> Trial:
    """A ship that slows down from 7 m/s for ten minutes, its two propellers left to the water or ordered to half."""
    t = np.arange(0.0, 700.0)
    left = np.where(t < 100.0, 1.0, 1.0 / (1.0 + np.clip(t - 100.0, 0.0, None) / 180.0))
    after = np.maximum(left, 0.5) if drive == "half ahead" else left
    n = {"half ahead": np.where(t < 100.0, 3.4, 1.7), "left to the water": np.where(t < 100.0, 3.4, 2.0 * left)}
    inputs = {"delta": 0.0 * t} | ({} if drive == "not recorded" else {"n_ps": n[drive], "n_sb": n[drive] + 0.02})
    return Trial("slowing", t, inputs, {"u": 7.0 * after, "psi": 0.0 * t})


@pytest.mark.parametrize(
    ("drive", "label"),
    [("left to the water", "coast-down"), ("half ahead", None), ("not recorded", "slow-down")],
)
def test_a_stop_is_told_by_its_speed_where_the_propeller_turns_with_the_water(drive: str, label: str | None) -> None:
    found = [stretch for stretch in recognise(slowing(drive), model=TwinScrew()) if stretch.kind == "stop"]
    assert [stretch.label for stretch in found] == ([label] if label else [])
    for stretch in found:
        assert 75.0 <= stretch.start <= 106.0
        assert stretch.end > 600.0
        assert "speed from 6.81 to 1.69 m/s" in stretch.facts


class TwinScrew(Model):
    """A ship with a rudder and two shafts, of which the log has no input n."""

    name = "twin_screw"
    states = outputs = (Channel("u", "m/s"), Channel("psi", "rad"))
    inputs = (Channel("delta", "rad"), Channel("n_ps", "rev/s"), Channel("n_sb", "rev/s"))

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return i.n_ps + i.n_sb - s.u * abs(s.u), i.delta


def test_a_straight_run_ends_where_its_heading_leaves_for_good() -> None:
    """A turn of 2 deg/min begins at 200 s: half a minute later it is past what a helmsman corrects."""
    t = np.arange(0.0, 400.0)
    rng = np.random.default_rng(4)
    psi = np.radians(np.clip(t - 200.0, 0.0, None) / 3.0 + 0.5 * np.sin(t / 9.0) + 0.1 * rng.standard_normal(t.size))
    log = Trial("course", t, {"delta": 0.0 * t}, {"psi": psi, "u": 0.0 * t + 5.0})
    first = recognise(log)[0]
    assert first.start == 0.0
    assert first.end == pytest.approx(207.0, abs=3.0)


@pytest.mark.parametrize("seed", range(5))
def test_noise_holds_no_manoeuvre(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = 2000
    white = {name: rng.standard_normal(n) for name in ("psi", "u", "r")}
    walk = {"psi": 0.05 * np.cumsum(rng.standard_normal(n)), "u": 1.0 + 0.1 * rng.standard_normal(n)}
    for outputs in (white, walk):
        log = Trial("noise", np.arange(n) * 0.5, {"delta": 0.3 * rng.standard_normal(n)}, outputs)
        assert without_straights(log) == []
    at_rest = Trial("rest", np.arange(n) * 0.5, {"delta": np.zeros(n)}, {k: 0.01 * v for k, v in white.items()})
    assert recognise(at_rest) == []


def test_a_helmsman_who_keeps_the_course_sails_no_zigzag() -> None:
    """Rudder to both sides by turns, as small and as irregular as steering is: a straight run and nothing else."""
    rng = np.random.default_rng(1)
    n = 1200
    t = np.arange(n) * 0.5
    delta = np.repeat(np.radians(rng.uniform(-4, 4, n // 20)), 20)
    psi = 0.02 * np.sin(t / 11)
    log = Trial("course", t, {"delta": delta}, {"psi": psi, "u": np.full(n, 2.0)})
    assert {stretch.kind for stretch in recognise(log)} == {"straight run"}


def test_a_zigzag_in_pitch_is_recognised() -> None:
    plan = PitchZigzag(math.radians(5), math.radians(5))
    rate = math.radians(2.5)
    log = run_manoeuvre(
        load_model("diving_plane"), plan, dt=0.5, first_state={"u": 1.47, "z": 100.0}, rudder_rate=rate, limit=120.0
    )
    assert [stretch.label.split("/")[0] for stretch in recognise(log)] == ["pitch zigzag 5"]


@pytest.mark.parametrize("known", ["velocities", "track"])
def test_a_vehicle_that_is_pushed_across_makes_no_straight_run(known: str) -> None:
    """Its course against its heading tells, or its sway against its surge."""
    t = np.arange(0.0, 120.0, 0.5)
    for drift, straight in ((20.0, 1), (80.0, 0)):
        u, v = math.cos(math.radians(drift)), math.sin(math.radians(drift))
        heading = 0.7
        north, east = u * math.cos(heading) - v * math.sin(heading), u * math.sin(heading) + v * math.cos(heading)
        shown = {"u": u + 0.0 * t, "v": v + 0.0 * t} if known == "velocities" else {"x": north * t, "y": east * t}
        log = Trial("crab", t, {"delta": 0.0 * t}, {"psi": heading + 0.0 * t, **shown})
        assert len(recognise(log)) == straight
