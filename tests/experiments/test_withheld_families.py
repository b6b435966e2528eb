"""The families of the withheld benchmark: their trials make sense, and their studies are good studies."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).resolve().parents[2] / "experiments"))

from withheld.cases import LOOKALIKES, Case, Plan, drawn_coefficients, drawn_noise, growth
from withheld.generate import ASIDE, SETS, SHEETS
from withheld.names import NAMES
from withheld.reality.families import VERTICAL, Family, design, families, family_of
from withheld.reality.manoeuvres import Fixed, Trial, ship_trial, torpedo_trial
from withheld.reality.sensors import Noise
from withheld.reality.simulate import Present, Record, make
from withheld.reality.trim import level
from withheld.studies import log_text, study_text

from seatruth import identify, load_study, simulator
from seatruth.effects import available, with_effects
from seatruth.models import load_model
from seatruth.trials import Trial as LibraryTrial

FAMILIES = families()
NEW = ("torpedo", "tanker", "container", "twin", "frame")
TORPEDO, TANKER, CONTAINER = FAMILIES["torpedo"], FAMILIES["tanker"], FAMILIES["container"]


def _sailed(family: Family, trials: Sequence[Trial], seed: int) -> list[Record]:
    """Trials of a drawn vehicle, with noise."""
    rng = np.random.default_rng(seed)
    return make(family, trials, drawn_coefficients(family, rng), (), drawn_noise(family, rng), rng, True)


def test_every_set_holds_known_families_and_the_development_set_none_that_is_aside() -> None:
    assert {name for names in SETS.values() for name in names} == set(FAMILIES) == set(NAMES) == set(LOOKALIKES)
    assert not set(SETS["dev"]) & set(ASIDE)
    assert set(SETS["test"]) == set(SETS["dev"]) | set(ASIDE)
    for name, family in FAMILIES.items():
        keys = [one.key for one in family.mechanisms]
        assert len(keys) == len(set(keys))
        assert set(LOOKALIKES[name]) & set(NAMES[name]) <= set(keys)


def test_the_torpedo_goes_level_at_its_trim() -> None:
    for coefficients in (TORPEDO.coefficients, drawn_coefficients(TORPEDO, np.random.default_rng(1))):
        steady = level(TORPEDO, coefficients)
        assert math.tan(steady.angle) == pytest.approx(steady.w / steady.u)
        # Lighter than water, it is held down: nose below the path, stern planes against what that turns.
        assert -0.05 < steady.angle < 0.0
        quiet = {name: Noise(1e-9, 0.0, 1.0) for name in TORPEDO.outputs}
        run = Trial("run", lambda: Fixed([]), 0.0, 40 * TORPEDO.time)
        y = make(TORPEDO, [run], coefficients, (), quiet, np.random.default_rng(0), True)[0].clean
        assert np.ptp(y["z"]) < 1e-3
        assert np.ptp(y["u"]) < 1e-3
        assert growth(TORPEDO, coefficients) < 0


@pytest.mark.parametrize("seed", [2, 3])
def test_the_torpedo_s_manoeuvres_reach_their_aims_under_the_surface(seed: int) -> None:
    names = [*VERTICAL["torpedo"][0], *VERTICAL["torpedo"][1]]
    trials = [torpedo_trial(name, TORPEDO.time, 0.75 if name.endswith("_slow") else 1.0) for name in names]
    records = dict(zip(names, _sailed(TORPEDO, trials, seed), strict=True))
    for name, record in records.items():
        y = record.clean
        assert np.degrees(np.abs(y["theta"]).max()) < 25, name
        assert np.degrees(np.abs(np.arctan2(y["w"], y["u"])).max()) < 8, name
        assert y["z"].min() > 10, name
        assert y["u"].min() > 0.6 * TORPEDO.speed, name
    below = records["depth_steps"].clean["z"] - TORPEDO.depth
    t = records["depth_steps"].t / TORPEDO.time
    assert below[np.searchsorted(t, 25)] == pytest.approx(5.0, abs=0.5)
    assert below[-1] == pytest.approx(2.0, abs=0.5)
    assert np.abs(records["level_run"].clean["z"] - TORPEDO.depth).max() < 0.5
    steps = np.degrees(records["pitch_steps"].clean["theta"])
    assert (steps.max(), steps.min()) == (pytest.approx(15, abs=2.5), pytest.approx(-15, abs=2.5))
    for name, angle in (("pitch_zigzag_15_down", 15), ("pitch_zigzag_5_up", 5)):
        pitch = np.degrees(records[name].clean["theta"])
        assert pitch.max() > angle - 1
        assert pitch.min() < -angle
        assert np.count_nonzero(np.abs(np.diff(np.sign(pitch - pitch[0]))) == 2) >= 3, name


def test_the_tanker_turns_and_zigzags_like_one() -> None:
    trials = [ship_trial(name, 0.4, TANKER.time) for name in ("turn_35_starboard", "zigzag_20_20_port")]
    turn, zigzag = _sailed(TANKER, trials, 5)
    psi, L = np.degrees(turn.clean["psi"]) - math.degrees(0.4), TANKER.sizes["L"]
    assert psi[-1] > 360
    across = turn.clean["y"] * math.cos(0.4) - turn.clean["x"] * math.sin(0.4)
    assert 1.5 < across[int(np.argmax(psi >= 180))] / L < 5
    swing = np.degrees(zigzag.clean["psi"]) - math.degrees(0.4)
    assert swing.max() > 20
    assert swing.min() < -20


@pytest.mark.parametrize("seed", [None, 2, 6])
def test_the_container_ship_is_stable_and_turns_and_zigzags_like_one(seed: int | None) -> None:
    """Within what IMO asks of a ship of this length and speed; drawn ones may need a quarter more room to turn."""
    rng = np.random.default_rng(seed)
    coefficients = drawn_coefficients(CONTAINER, rng) if seed is not None else dict(CONTAINER.coefficients)
    assert growth(CONTAINER, coefficients) * CONTAINER.time < -0.1
    quiet = {name: Noise(1e-9, 0.0, 1.0) for name in CONTAINER.outputs}
    names = ("turn_35_starboard", "zigzag_10_10", "zigzag_20_20_port")
    trials = [ship_trial(name, 0.0, CONTAINER.time) for name in names]
    turn, *zigzags = make(CONTAINER, trials, coefficients, (), quiet, rng, True)
    psi, L = turn.clean["psi"], CONTAINER.sizes["L"]
    advance = np.interp(math.pi / 2, psi[: int(np.argmax(psi)) + 1], turn.clean["x"][: int(np.argmax(psi)) + 1])
    advance -= np.interp(3 * CONTAINER.time, turn.t, turn.clean["x"])
    tactical = turn.clean["y"][int(np.argmax(psi >= math.pi))]
    wider = 1.0 if seed is None else 1.25
    assert 2.4 < advance / L < 4.5 * wider
    assert 3.0 < tactical / L < 5.0 * wider
    for record, angle, most in zip(zigzags, (10, 20), (5 + 0.5 * CONTAINER.time, 25), strict=True):
        swing = np.degrees(record.clean["psi"])
        for extreme in (swing.max(), -swing.min()):
            assert 0.25 * angle < extreme - angle < most


@pytest.mark.slow
def test_a_current_is_the_same_in_both_codes() -> None:
    """Inertia of the water's share in a current, in the vertical plane: the library's effect beside reality's."""
    quiet = {name: Noise(1e-9, 0.0, 1.0) for name in TORPEDO.outputs}
    flow = Present(TORPEDO.mechanism("current"), {"north": 0.4, "east": 0.0})
    trial = torpedo_trial("plane_doublets", TORPEDO.time)
    record = make(TORPEDO, [trial], dict(TORPEDO.coefficients), (flow,), quiet, np.random.default_rng(0), True)[0]
    model = with_effects(load_model(TORPEDO.model), [available()["current_along"]])
    again = LibraryTrial(
        name="s", t=record.t, inputs={"delta_s": record.delta}, outputs={k: v[:] for k, v in record.clean.items()}
    )
    values = {**model.nominal(), **TORPEDO.measured, "current_along_along": 0.4}
    engine = simulator(model, [again], (), values, "foh", None, 1)
    y = engine.outputs(np.zeros((1, 0)), engine.initial_states).y[0]
    for k, channel in enumerate(model.outputs):
        assert np.abs(y[:, k] - record.clean[channel.name]).max() < 0.1 * TORPEDO.noise[channel.name], channel.name


@pytest.mark.slow
@pytest.mark.parametrize("name", ["twin", "frame"])
def test_craft_with_thrusters_keep_their_course_turn_and_record_their_thrusters(name: str) -> None:
    family = FAMILIES[name]
    quiet = {output: Noise(1e-9, 0.0, 1.0) for output in family.outputs}
    run = Trial("run", lambda: Fixed([]), 0.3, 30 * family.time)
    turn = ship_trial("turn_35_starboard", 0.0, family.time)
    zigzag = ship_trial("zigzag_10_10", 0.0, family.time)
    for seed in (None, 4):
        rng = np.random.default_rng(seed)
        coefficients = dict(family.coefficients) if seed is None else drawn_coefficients(family, rng)
        assert growth(family, coefficients) * family.time < -0.1
        straight, circle, swings = make(family, [run, turn, zigzag], coefficients, (), quiet, rng, True)
        assert np.ptp(straight.clean["psi"]) < 1e-6
        assert circle.clean["psi"][-1] > math.pi
        assert np.ptp(circle.clean["y"]) < 8 * family.sizes["L"]
        assert np.degrees(swings.clean["psi"].max()) > 10
        assert np.degrees(swings.clean["psi"].min()) < -10
        delta, n = family.orders(family.recorded(circle.delta, circle.n))
        assert delta == pytest.approx(circle.delta, abs=1e-12)
        assert n == pytest.approx(circle.n)
    steady = make(family, [run], dict(family.coefficients), (), quiet, np.random.default_rng(0), True)[0]
    assert steady.clean["u"][-1] == pytest.approx(family.speed, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "water_log"), [*((name, False) for name in NEW), ("twin", True)])
def test_a_vehicle_without_a_cause_refits_to_its_noise(name: str, water_log: bool, tmp_path: Path) -> None:
    """Slow errors of a sensor are left out: the first states of a trial take up much of them."""
    family, rng = family_of(name, water_log=water_log), np.random.default_rng(17)
    coefficients = drawn_coefficients(family, rng)
    noise = {output: Noise(sd, 0.0, 1.0) for output, sd in family.noise.items()}
    trials = design(family, rng)[:4]
    records = make(family, trials, coefficients, (), noise, rng, True)
    case = Case(Plan(name, "none", (), 0, 17), family, coefficients, noise, trials, True, [], [], records)
    for k, record in enumerate(records):
        (tmp_path / f"trial_{k + 1}.csv").write_text(log_text(family, record), encoding="utf-8")
    (tmp_path / "study.toml").write_text(study_text(case, "c001"), encoding="utf-8")
    if family.sheet:
        (tmp_path / family.sheet).write_text((SHEETS / family.sheet).read_text(encoding="utf-8"), encoding="utf-8")
    study = load_study(tmp_path / "study.toml")
    assert {p.name for p in study.parameters if p.vary} == set(family.coefficients)
    values = {p.name: p.value for p in study.parameters}
    assert {key: values[key] for key in family.measured} == pytest.approx(dict(family.measured))
    assert {key: values[key] for key in family.coefficients} == pytest.approx(dict(family.coefficients))
    if family.whole:
        assert set(values) == set(family.coefficients) | set(family.measured)
        free = [p for p in study.parameters if p.vary]
        assert all(p.min <= p.value - 4 * p.prior.sd and p.max >= p.value + 4 * p.prior.sd for p in free)
    fit = identify(study, seed=0, threads=1).fit.reset_index()
    for channel, shown in family.named_in_log.items():
        left = math.sqrt(float((fit.loc[fit["channel"] == shown, "rmse"] ** 2).mean()))
        drawn = math.sqrt(np.mean([np.mean((r.outputs[channel] - r.clean[channel]) ** 2) for r in records]))
        assert 0.9 < left / drawn < 1.02, channel
