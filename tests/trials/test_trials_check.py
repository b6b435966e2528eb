"""Every check fires on a trial with its fault put in, and stays quiet on the same trial without it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from known_motion import Array, altered, codes, scattered, step_at, zigzag

from seatruth.manoeuvres import TurningCircle, run_manoeuvre
from seatruth.models import load_model
from seatruth.trials import Channel, Step, Trial, apply_steps, check_trials

GOOD = zigzag(amplitude=0.5, period=80)
FAST = zigzag(amplitude=0.6, period=80, noise=0.1)  # loses a third of its speed in each turn
OTHER = zigzag(amplitude=0.5, period=55)
DEG = 180 / np.pi


def test_good_data_raise_no_finding() -> None:
    assert check_trials([GOOD]) == []


def spoil(first: int, stop: int, value: float) -> Callable[[Array], Array]:
    def change(values: Array) -> Array:
        values[first:stop] = value
        return values

    return change


def spike(values: Array) -> Array:
    values[[400, 900, 1700]] += 0.5
    return values


def hold(every: int) -> Callable[[Array], Array]:
    def change(values: Array) -> Array:
        values[every::every] = values[every - 1 : -1 : every][: values[every::every].size]
        return values

    return change


def averaged(psi: Array) -> Array:
    """A compass between 0 and a turn in which someone filled in the sample at each jump."""
    compass = np.mod(psi + 5.7, 2 * np.pi)
    jump = np.flatnonzero(np.abs(np.diff(compass)) > 4.0)
    compass[jump] = 0.5 * (compass[jump - 1] + compass[jump + 1])
    return compass


def coarse_beyond(limit: float, lsb: float) -> Callable[[Array], Array]:
    return lambda values: np.where(values > limit, np.round(values / lsb) * lsb, values)


FAULTS: list[tuple[str, str, str, dict[str, Callable[[Array], Array]]]] = [
    ("psi in degrees", "unit", "psi", {"psi": lambda a: a * DEG}),
    ("psi as a compass in degrees", "unit", "psi", {"psi": lambda a: (a * DEG + 330) % 360}),
    ("r in degrees a second", "unit", "r", {"r": lambda a: a * DEG}),
    ("delta in degrees", "unit", "delta", {"delta": lambda a: a * DEG}),
    ("u and v in knots", "unit", "u", {"u": lambda a: a / 0.514444, "v": lambda a: a / 0.514444}),
    ("n in rpm", "unit", "n", {"n": lambda a: a * 60}),
    ("wrapped psi", "wrapped", "psi", {"psi": lambda a: np.mod(a + 5.7, 2 * np.pi)}),
    ("r to port", "psi-r-sign", "psi", {"r": lambda a: -a}),
    ("gyro scale", "psi-r-scale", "r", {"r": lambda a: 1.15 * a}),
    ("another r", "psi-r-disagree", "psi", {"r": lambda a: OTHER.outputs["r"]}),
    ("r of another time", "clock-offset", "r", {"r": lambda a: a[::-1].copy()}),  # a zigzag backwards is a late one
    ("psi points astern", "heading-astern", "psi", {"psi": lambda a: a + np.pi}),
    ("psi averaged between 359 and 0 deg", "wrapped-between", "psi", {"psi": lambda a: averaged(a)}),
    ("a clock that is late", "clock-offset", "psi", {"psi": lambda a: np.interp(GOOD.t - 1.0, GOOD.t, a)}),
    ("a clock that is early", "clock-offset", "r", {"r": lambda a: np.interp(GOOD.t - 2.0, GOOD.t, a)}),
    ("rudder to port", "rudder-sign", "delta", {"delta": lambda a: -a}),
    ("y to port", "position-axes", "y", {"y": lambda a: -a}),
    ("x astern", "position-axes", "x", {"x": lambda a: -a}),
    ("speed scale", "speed-scale", "u", {"u": lambda a: 1.2 * a, "v": lambda a: 1.2 * a}),
    ("heading offset", "heading-offset", "psi", {"psi": lambda a: a + 0.3}),
    ("dead sensor", "constant", "v", {"v": lambda a: 0 * a}),
    ("stuck sensor", "stuck", "psi", {"psi": spoil(1000, 1500, 0.1)}),
    ("held psi", "held", "psi", {"psi": hold(4)}),
    ("held position", "held", "x", {"x": hold(5)}),
    ("coarse heading", "quantised", "psi", {"psi": lambda a: np.round(a / 0.05) * 0.05}),
    ("coarse in part", "quantised-part", "psi", {"psi": coarse_beyond(0.6, 0.0175)}),
    ("spikes", "outliers", "psi", {"psi": spike}),
    ("position jump", "jumps", "x", {"x": step_at}),
    ("no valid sample", "output-empty", "v", {"v": lambda a: a * np.nan}),
    ("mostly missing", "output-missing", "v", {"v": spoil(0, 2000, np.nan)}),
    ("a late start", "output-late", "v", {"v": spoil(0, 8, np.nan)}),
    ("a long gap", "output-gap", "v", {"v": spoil(500, 800, np.nan)}),
    ("missing input", "input-missing", "delta", {"delta": spoil(5, 9, np.nan)}),
    ("tiny rudder", "input-small", "delta", {"delta": lambda a: a * 0.01}),
    ("commanded rudder", "input-jumps", "delta", {"delta": lambda a: 0.35 * np.sign(a)}),
]


@pytest.mark.parametrize(("factor", "far"), [(1e3, "long"), (1e-3, "short")])
def test_a_wrong_unit_of_the_time_is_one_fault(factor: float, far: str) -> None:
    """Milliseconds taken for seconds, or seconds for milliseconds: no channel is to blame."""
    (said,) = check_trials([replace(GOOD, t=factor * GOOD.t)])
    assert (said.code, said.severity) == ("time-unit", "error")
    assert f"too {far}" in said.message


@pytest.mark.parametrize(("fault", "code", "channel", "changes"), FAULTS, ids=[f[0] for f in FAULTS])
def test_fault_is_found(fault: str, code: str, channel: str, changes: dict[str, Callable[[Array], Array]]) -> None:
    found = check_trials([altered(GOOD, changes)])
    hits = [f for f in found if f.code == code and f.channel == channel]
    assert hits, [str(f) for f in found]
    assert "zigzag" in hits[0].where
    assert channel in hits[0].where
    assert hits[0].do


def test_an_angle_that_turns_the_long_way_is_named_with_its_time() -> None:
    """A pod goes on from 161.6 to 195 deg, which its record calls -165; the step `unwrap` puts it right."""
    tug = SimpleNamespace(inputs=(Channel("az", "rad"), Channel("n", "rev/s")), outputs=())
    orders = np.radians(np.where(GOOD.t < 45.0, 161.6, -165.0))
    stern = replace(GOOD, inputs={"az": orders, "n": GOOD.inputs["n"]})
    (said,) = (f for f in check_trials([stern], tug) if f.channel == "az")
    assert (said.code, said.severity, said.trial) == ("input-wrapped", "warning", stern.name)
    assert "At 45 s it goes from 162 deg to -165 deg in one sample: " in said.message
    assert "'az' in the channels of the preparation step 'unwrap'" in said.do
    going_on = apply_steps(stern, [("unwrap", {"channels": ["az"]})])
    assert "input-wrapped" not in codes(check_trials([going_on], tug))


def test_a_coarse_sensor_is_told_in_the_unit_of_its_column() -> None:
    """Where the study states none, angles are in degrees."""
    coarse = altered(GOOD, {"psi": lambda a: 3.0 * np.round(a * DEG / 3.0) / DEG})
    said = next(str(f) for f in check_trials([coarse]) if f.code == "quantised")
    assert "Its resolution, 3 deg, is" in said
    assert "a noise of at least 0.866 deg (" in said
    stated = coarse.with_step(Step("read", {"stated_units": {"psi": "arcmin"}}, ""))
    assert any("Its resolution, 180 arcmin, is" in f.message for f in check_trials([stated]))


def test_a_coarse_channel_that_no_output_is_compared_with_needs_no_noise() -> None:
    model = load_model("mmg")
    coarse = altered(GOOD, {"psi": lambda a: np.round(a / 0.05) * 0.05})
    heeled = replace(coarse, outputs={**coarse.outputs, "phi": coarse.outputs["psi"]})
    assert [f.channel for f in check_trials([heeled], model) if f.code == "quantised"] == ["psi"]


BY_SAMPLE = {
    "psi averaged between 359 and 0 deg",
    "held psi",
    "held position",
    "spikes",
    "position jump",
    "a late start",
}
"""Faults of single samples, of which a sensor with a slower clock of its own has fewer."""
ELSEWHERE = [fault for fault in FAULTS if fault[0] not in BY_SAMPLE]


@pytest.mark.parametrize(("fault", "code", "channel", "changes"), ELSEWHERE, ids=[f[0] for f in ELSEWHERE])
def test_fault_is_found_where_sensors_have_clocks_of_their_own(
    fault: str, code: str, channel: str, changes: dict[str, Callable[[Array], Array]]
) -> None:
    found = check_trials([scattered(altered(GOOD, changes))])
    assert (code, channel) in {(f.code, f.channel) for f in found}, [str(f) for f in found]


def test_sensors_with_clocks_of_their_own_raise_no_false_alarm() -> None:
    assert check_trials([scattered(GOOD)]) == []
    paused = scattered(replace(GOOD, t=GOOD.t + 30.0 * (GOOD.t > 150)))
    assert codes(check_trials([paused])) == {"time-gap", "output-gap"}
    slow = check_trials([scattered(rolling(2.7, 0.25), 4)])
    assert "slow-sampling" in codes(slow)
    assert "slow-sampling" not in codes(check_trials([scattered(rolling(12.0, 0.25), 4)]))


def test_held_and_stray_samples_are_those_of_the_sensors_own_clock() -> None:
    own = scattered(diving())
    assert codes(check_trials([own])) == set()

    def change(fault: Callable[[Array], Array]) -> Callable[[Array], Array]:
        def changed(values: Array) -> Array:
            there = np.isfinite(values)
            values[there] = fault(values[there])
            return values

        return changed

    def stray(values: Array) -> Array:
        values[200] += 20.0
        return values

    for fault, code in ((hold(4), "held"), (stray, "outliers")):
        found = check_trials([altered(own, {"z": change(fault)})])
        assert (code, "z") in {(f.code, f.channel) for f in found}, code


@pytest.mark.parametrize(("stated", "asked"), [({}, True), ({"n": "rpm"}, False)], ids=["bare", "stated"])
def test_a_fast_engine_is_asked_for_its_unit_unless_the_study_states_one(stated: dict[str, str], asked: bool) -> None:
    """An outboard engine turns at 4200 rpm; who wrote rpm beside the column needs no advice to do so."""
    fast = altered(GOOD, {"n": lambda a: 0 * a + 70.0})
    found = check_trials([fast.with_step(Step("read", {"stated_units": stated}))])
    assert ("unit" in {f.code for f in found if f.channel == "n"}) is asked


@pytest.mark.parametrize(("factor", "advised"), [(60.0, "'deg/min'"), (DEG, "'deg/s'")])
def test_a_rate_per_minute_is_told_from_one_in_degrees(factor: float, advised: str) -> None:
    """A ship's rate of turn, in deg/min, of a study that says deg/s."""
    found = [f for f in check_trials([altered(GOOD, {"r": lambda a: a * factor})]) if f.code == "unit"]
    assert [(f.channel, advised in f.do) for f in found] == [("r", True)]


@pytest.mark.parametrize(("size", "advised"), [(60.0, "'deg/s'"), (DEG, "'rad/s'")])
def test_a_rate_per_second_is_told_from_one_in_radians_where_a_minute_is_stated(size: float, advised: str) -> None:
    """deg/s in a study that says deg/min is 60 times too small, rad/s in one that says deg/s 57 times."""
    stated = {"r": "deg/min" if size == 60.0 else "deg/s", "psi": "deg"}
    slow = altered(GOOD, {"r": lambda a: a / size}).with_step(Step("read", {"stated_units": stated}))
    found = [f for f in check_trials([slow]) if f.code == "unit"]
    assert [(f.channel, advised in f.do) for f in found] == [("r", True)]


@pytest.mark.parametrize(
    ("stated", "channel", "do"),
    [
        ({}, "psi", "State unit = 'deg' for psi; or, if r is in rad/s, 'rad/s' for r."),
        ({"psi": "deg", "r": "deg/s"}, "r", "State unit = 'rad/s' for r."),
        ({"psi": "rad", "r": "rad/s"}, "psi", "State unit = 'deg' for psi."),
    ],
    ids=["bare", "right heading", "right rate"],
)
def test_a_unit_that_the_study_states_already_is_no_remedy(stated: dict[str, str], channel: str, do: str) -> None:
    slow = altered(GOOD, {"r": lambda a: a / DEG})
    found = check_trials([slow.with_step(Step("read", {"stated_units": stated}))])
    (hit,) = [f for f in found if f.code == "unit"]
    assert (hit.channel, hit.do) == (channel, do)


def test_swapped_axes_and_wrong_senses_are_named() -> None:
    swapped = replace(GOOD, outputs={**GOOD.outputs, "x": GOOD.outputs["y"], "y": GOOD.outputs["x"]})
    assert any(f.code == "position-axes" and "swapped" in f.message for f in check_trials([swapped]))
    left = altered(GOOD, {"psi": lambda a: -a, "r": lambda a: -a})
    assert any(f.code == "position-axes" and "counter-clockwise" in f.message for f in check_trials([left]))


def test_a_heading_that_points_astern_is_named() -> None:
    astern = altered(GOOD, {"psi": lambda a: a + np.pi})
    found = [f for f in check_trials([astern]) if f.code == "heading-astern"]
    assert "180 deg off" in found[0].do
    turning = zigzag(amplitude=0.5, period=150, seconds=600)  # beyond a quarter turn to each side
    without = {k: v for k, v in turning.outputs.items() if k not in ("u", "v", "r")}
    track = replace(turning, outputs={**without, "psi": without["psi"] + np.pi})
    found = [f for f in check_trials([track]) if f.code == "heading-astern"]
    assert "opposite to psi" in found[0].message
    assert "heading-astern" not in codes(check_trials([replace(turning, outputs=without)]))


def test_a_steady_run_does_not_say_that_its_heading_points_astern() -> None:
    """On one course at one speed a drift may be all of the motion: the displacements then know no direction."""
    t, rng = np.arange(0.0, 60.0, 0.5), np.random.default_rng(5)
    for _ in range(40):
        white = {name: rng.standard_normal(len(t)) for name in ("u", "v", "psi", "x", "y")}
        outputs = {
            "u": 0.5 + 0.01 * white["u"],
            "v": 0.01 * white["v"],
            "psi": 0.3 + 0.01 * white["psi"],
            "x": 0.5 * np.cos(0.3) * t + 0.02 * white["x"],
            "y": 0.5 * np.sin(0.3) * t + 0.02 * white["y"],
        }
        assert not {"heading-astern", "heading-offset"} & codes(check_trials([Trial("run", t, {}, outputs)]))


def test_torpedo_convention_shows() -> None:
    """Axes y up: yaw, yaw rate and lateral velocity keep or change their sense, and depth counts upward."""
    torpedo = altered(GOOD, {"psi": lambda a: -a, "r": lambda a: -a})
    assert {"rudder-sign", "position-axes"} <= codes(check_trials([torpedo]))
    dive = diving()
    upward = altered(dive, {"z": lambda a: -a})
    assert codes(check_trials([dive])) == set()
    assert {"depth-up", "depth-pitch-sign"} <= codes(check_trials([upward]))
    # A diagnosis of it named a speed sensor at over 99.9 %: no vehicle dives above the sea.
    assert {f.severity for f in check_trials([upward]) if f.code == "depth-up"} == {"error"}


def diving() -> Trial:
    t = np.arange(0, 300, 0.1)
    theta = 0.2 * np.sin(2 * np.pi * t / 60)
    q = 0.2 * 2 * np.pi / 60 * np.cos(2 * np.pi * t / 60)
    u = 1.5 + 0.2 * np.sin(2 * np.pi * t / 97)
    z = 30 + np.concatenate([[0], np.cumsum(-(u * np.sin(theta))[:-1] * 0.1)])
    rng = np.random.default_rng(1)
    noisy = {k: a + 1e-3 * rng.standard_normal(t.size) for k, a in {"theta": theta, "q": q, "u": u, "z": z}.items()}
    return Trial("dive", t, {"delta_s": -0.1 * theta, "n": 20 + np.sin(t / 9)}, noisy)


def test_pitch_against_its_rate() -> None:
    assert "theta-q-sign" in codes(check_trials([altered(diving(), {"q": lambda a: -a})]))


def test_current_and_lever_arm_are_measured() -> None:
    """Drift and arm are stated to within their own standard errors' scale, and only where they are."""
    drifting = zigzag(current=0.2 * np.exp(1j * 1.0), amplitude=0.6, seconds=600, period=150)
    note = next(f for f in check_trials([drifting]) if f.code == "drift")
    assert "0.2 m/s" in note.message
    assert "57 deg" in note.message
    apart = zigzag(arm=2.0 + 0.5j, amplitude=0.5)
    note = next(f for f in check_trials([apart]) if f.code == "lever-arm")
    assert "2 m forward and 0.5 m to starboard" in note.message
    assert not {"drift", "lever-arm"} & codes(check_trials([zigzag(amplitude=0.5)]))
    # The point of a ship that does not slide in turns lies ahead: without v it would be taken for an antenna.
    without = replace(apart, outputs={name: values for name, values in apart.outputs.items() if name != "v"})
    assert "lever-arm" not in codes(check_trials([without]))


def test_time_axis() -> None:
    t = np.array(GOOD.t)
    t[1500:] += 30
    found = {finding.code: finding for finding in check_trials([replace(GOOD, t=t)])}
    # The vehicle went on where it was: the clock jumped. Where samples are missing it has come further.
    assert "its clock jumped" in found["time-gap"].message
    assert "Take the jump out" in found["time-gap"].do
    kept = np.flatnonzero((GOOD.t < GOOD.t[1500]) | (GOOD.t > GOOD.t[1500] + 8.0))
    found = {finding.code: finding for finding in check_trials([GOOD.samples(kept)])}
    assert "jumped" not in found["time-gap"].message
    assert "split_at_gaps" in found["time-gap"].do
    moored = np.random.default_rng(1).normal(0.0, 0.4, (2, len(GOOD)))
    for wander in (moored, np.cumsum(0.02 * moored, axis=1)):  # white noise, and a slow error
        rest = replace(GOOD, t=t, outputs={"x": wander[0], "y": wander[1]})
        assert "jumped" not in next(f for f in check_trials([rest]) if f.code == "time-gap").message
    without = replace(GOOD, t=t, outputs={name: y for name, y in GOOD.outputs.items() if name not in ("x", "y")})
    assert "jumped" not in next(f for f in check_trials([without]) if f.code == "time-gap").message
    uneven = GOOD.t + 0.03 * np.sin(7.0 * np.arange(len(GOOD)))
    assert "time-irregular" in codes(check_trials([replace(GOOD, t=uneven)]))
    assert "time-order" in codes(check_trials([replace(GOOD, t=GOOD.t[::-1])]))
    assert "few-samples" in codes(check_trials([GOOD.section(0, 10)]))


def rolling(period: float, step: float = 1.0, noise: float = 1e-3) -> Trial:
    """A vehicle that yaws with the waves on a straight course, and is recorded every `step` seconds."""
    t = np.arange(0, 300 * step, step)
    rng = np.random.default_rng(3)
    psi = 0.05 * np.sin(2 * np.pi * t / period)
    r = 0.05 * 2 * np.pi / period * np.cos(2 * np.pi * t / period)
    outputs = {"psi": psi + noise * rng.standard_normal(t.size), "r": r + noise * rng.standard_normal(t.size)}
    return Trial("waves", t, {"delta": 0.1 * np.sin(t / 40)}, outputs)


def test_slow_sampling_is_found() -> None:
    assert "slow-sampling" in codes(check_trials([rolling(2.7)]))
    assert "slow-sampling" not in codes(check_trials([rolling(12.0)]))


def test_a_rate_that_is_noise_is_not_slowly_sampled() -> None:
    rng = np.random.default_rng(3)
    straight = {k: 0.01 * rng.standard_normal(len(GOOD)) for k in ("psi", "r")}
    assert "slow-sampling" not in codes(check_trials([replace(GOOD, outputs={**GOOD.outputs, **straight})]))
    noise = altered(GOOD, {"r": lambda a: rng.standard_normal(a.size) * 0.01})
    assert "psi-r-disagree" in codes(check_trials([noise]))


def test_a_turn_that_costs_speed_says_nothing_of_the_rudder() -> None:
    """Noise-free and hard over: the yaw rate falls with the speed while the rudder stays where it is."""
    model = load_model("abkowitz")
    turn = run_manoeuvre(model, TurningCircle(0.61, 6.3, 0.0), dt=2.0, first_state={"u": 7.7175}, limit=900.0)
    assert "rudder-sign" not in codes(check_trials([turn], model))
    reversed_ = altered(turn, {"delta": lambda a: -a})
    found = [f for f in check_trials([reversed_], model) if f.code == "rudder-sign"]
    assert "against a rudder that is held hard over" in found[0].message


def test_a_helmsman_in_waves_says_nothing_of_the_rudder() -> None:
    """The rudder follows the bow here: it is moved against every yaw, with no hold in which the bow could answer."""
    waves = rolling(12.0, 0.5)
    steered = replace(waves, inputs={"delta": -3.0 * waves.outputs["r"]})
    assert "rudder-sign" not in codes(check_trials([steered]))


def test_a_channel_at_rest_is_frozen_only_beside_motion() -> None:
    """On a straight course sway, heading and yaw rate are constant in a noise-free log, and nothing is wrong."""
    t = np.arange(0, 60, 0.5)
    zero = np.zeros(t.size)
    straight = {"x": 1.5 * t, "y": zero, "psi": zero, "u": zero + 1.5, "v": zero, "r": zero}
    inputs = {"delta": 0.1 * np.sin(t / 5)}
    assert "constant" not in codes(check_trials([Trial("straight", t, inputs, straight)]))
    still = check_trials([Trial("straight", t, inputs, {**straight, "x": zero})])
    assert [f.channel for f in still if f.code == "constant"] == ["x"]
    alone = check_trials([Trial("depth", t, inputs, {"depth": zero + 3.0})])
    assert [f.severity for f in alone if f.code == "constant"] == ["note"]
    track = replace(GOOD, outputs={name: GOOD.outputs[name] for name in ("x", "y", "psi")})
    assert "constant" not in codes(check_trials([track]))
    for name in ("x", "y"):
        frozen = check_trials([altered(track, {name: lambda a: 0 * a})])
        assert ("warning", name) in {(f.severity, f.channel) for f in frozen if f.code == "constant"}, name
    for name in ("psi", "r", "u", "v"):
        frozen = check_trials([altered(FAST, {name: lambda a: 0 * a + 0.3})])
        assert ("constant", name) in {(f.code, f.channel) for f in frozen}, name
