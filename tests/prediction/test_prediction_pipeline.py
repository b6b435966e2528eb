"""`predict` from end to end: trajectories and regressions, turns and stops, full scale, what cannot be predicted."""

from __future__ import annotations

import math

import known_boat
import pytest
from known_ship import SHIP, deg, fitted, sail, study

from seatruth import RegressionOptions, Trials, identify, predict
from seatruth.errors import BadInput
from seatruth.manoeuvres import (
    AxisSteps,
    CrashStop,
    SpeedSteps,
    Spiral,
    TurningCircle,
    Zigzag,
    steered,
    stopping_figures,
    thruster_layout,
    turning_circle_figures,
    zigzag_figures,
)
from seatruth.prediction.conditions import calm_water
from seatruth.report.prediction import render_prediction

FEW = {"draws": 60, "threads": 1}


def test_a_turn_and_a_zigzag_with_intervals_about_the_truth() -> None:
    made, estimate = fitted()
    plans = [TurningCircle(deg(35)), Zigzag(deg(20), deg(20))]
    found = predict(made, estimate, plans, speed=1.18, inputs={"n": 11.85}, rudder_rate_limit=deg(15.8), **FEW)
    table = found.figures.set_index(["kind", "figure"])
    truth = turning_circle_figures(sail(TurningCircle(deg(35))))
    for name in ("advance", "transfer", "tactical_diameter", "steady_diameter", "rate"):
        row = table.loc["turn", name]
        assert row["lower"] < row["value"] < row["upper"], name
        assert row["lower"] <= getattr(truth, name) <= row["upper"], name
        assert row["value"] == pytest.approx(getattr(truth, name), rel=0.1), name
    assert table.loc["zigzag", "first_overshoot"].held_by in ("trials", "both")
    assert (table.prior_share.dropna() >= 0).all()
    assert set(found.measured.trial) == set(made.trials.names)
    known = found.measured[found.measured.measured.notna()]
    assert known.inside.mean() > 0.7
    assert (abs(known.predicted / known.measured - 1) < 0.25).all()
    assert set(found.tracks.columns) == {"manoeuvre", "ship", "t", "x", "y", "psi", "delta"}
    assert 0.0 <= found.model_error < 0.2
    again = predict(made, estimate, plans, speed=1.18, inputs={"n": 11.85}, rudder_rate_limit=deg(15.8), **FEW)
    assert again.figures.equals(found.figures)


def test_a_boat_that_thrusters_steer_is_predicted_as_a_ship_is() -> None:
    made, estimate = known_boat.fitted()
    plans = [TurningCircle(0.2, by="thrust"), Zigzag(0.15, deg(15), by="thrust"), CrashStop(-10.0)]
    ahead = {"n_port": known_boat.N, "n_starboard": known_boat.N}
    found = predict(made, estimate, plans, speed=known_boat.SPEED, inputs=ahead, **FEW)
    table = found.figures.set_index(["kind", "figure"])
    turn, zigzag, stop = (steered(known_boat.sail(plan, known_boat.TRUTH), known_boat.BOAT) for plan in plans)
    for kind, truth, names in (
        ("turn", turning_circle_figures(turn), ("advance", "transfer", "tactical_diameter", "rate", "drift_angle")),
        ("zigzag", zigzag_figures(zigzag), ("first_overshoot", "second_overshoot", "initial_turning_time", "period")),
        ("stop", stopping_figures(stop), ("track_reach", "stopping_time")),
    ):
        for name in names:
            row = table.loc[kind, name]
            assert row["lower"] <= getattr(truth, name) <= row["upper"], name
            assert row["value"] == pytest.approx(getattr(truth, name), rel=0.1), name
            assert row["upper"] - row["lower"] < 0.5 * row["value"], name
    assert table.loc["turn", "rate"].held_by == "trials"
    # The zigzags of the trials are recognised, sailed anew, and found inside their intervals.
    assert dict(found.measured.groupby("trial").kind.first()) == dict.fromkeys(made.trials.names, "zigzag")
    known = found.measured[found.measured.measured.notna()]
    assert len(known) == 12
    assert known.inside.mean() > 0.7
    assert found.tracks[found.tracks.manoeuvre == "turning circle 20 %"].delta.max() == pytest.approx(0.2)
    assert "rudder_rate" not in found.conditions
    assert "rev/s" in render_prediction(found)


def test_the_usual_manoeuvres_and_a_spiral_of_a_boat_that_thrusters_steer() -> None:
    made, estimate = known_boat.fitted()
    options = {"measured": False, "dt": 0.2, "limit": 120.0, "draws": 40, "threads": 1}
    usual = predict(made, estimate, **options)
    assert list(dict.fromkeys(usual.figures.manoeuvre)) == [
        "turning circle 20 %",
        "turning circle -20 %",
        "zigzag 10 %/10 starboard first",
        "zigzag 20 %/20 starboard first",
    ]
    assert set(usual.conditions["inputs"]) == {"n_port", "n_starboard"}
    levels = (0.1, 0.05, 0.0, -0.05, -0.1, -0.05, 0.0, 0.05, 0.1)
    layout = thruster_layout(known_boat.BOAT)
    plans = [Spiral(levels, 12.0, by="thrust"), AxisSteps(layout, "yaw", levels, 12.0, ahead=0.4)]
    spirals = predict(made, estimate, plans, **options).figures
    assert set(spirals.kind) == {"spiral by thrust"}
    width = spirals[spirals.figure == "loop_width"]
    assert list(width.unit) == ["1", "1"]
    assert (abs(width.value) < 0.01).all()
    ship = predict(made, estimate, [TurningCircle(0.2, by="thrust")], scale=4.0, **options)
    assert ship.conditions["inputs"]["n_port"] == pytest.approx(usual.conditions["inputs"]["n_port"] / 2)
    for plan, says in (
        (AxisSteps(layout, "surge", (0.1,), 5.0), "no figures of surge steps"),
        (TurningCircle(deg(20)), "thrusters steer it"),
    ):
        with pytest.raises(BadInput, match=says):
            predict(made, estimate, [plan], **options)


def test_what_a_model_usually_lacks_beyond_its_trials_widens_predicted_figures_alone() -> None:
    made, estimate = fitted()
    plans = [TurningCircle(deg(20), deg(300))]
    bare, wide = (predict(made, estimate, plans, speed=1.18, form_error=error, **FEW) for error in (0.0, 0.1))
    assert wide.measured.equals(bare.measured)
    for one, other in zip(bare.figures.to_dict("records"), wide.figures.to_dict("records"), strict=True):
        if math.isfinite(one["lower"]) and one["lower"] <= one["value"]:
            expected = math.hypot(one["value"] - one["lower"], 0.196 * one["value"])
            assert other["value"] - other["lower"] == pytest.approx(expected, rel=1e-3)
    with pytest.raises(BadInput, match="a form error of -1"):
        predict(made, estimate, plans, form_error=-1.0, **FEW)


def test_full_scale_is_the_model_at_its_scale() -> None:
    made, estimate = fitted()
    options = {"speed": 1.18, "measured": False, **FEW}
    model = predict(made, estimate, [TurningCircle(deg(20), deg(300))], **options)
    ship = predict(made, estimate, [TurningCircle(deg(20), deg(300))], scale=49.0, **options)
    powers = {"m": 49.0, "s": 7.0, "rad": 1.0, "rad/s": 1 / 7.0, "1": 1.0}
    for one, other in zip(model.figures.to_dict("records"), ship.figures.to_dict("records")):
        for column in ("value", "lower", "upper"):
            assert other[column] == pytest.approx(powers[one["unit"]] * one[column], nan_ok=True)
    assert ship.conditions["speed"] == pytest.approx(7 * 1.18)
    assert ship.conditions["inputs"]["n"] == pytest.approx(model.conditions["inputs"]["n"] / 7)
    assert ship.tracks.x.max() == pytest.approx(49.0 * model.tracks.x.max())


def test_stops_ahead_and_astern_and_a_spiral() -> None:
    made, estimate = fitted()
    stop = predict(made, estimate, [CrashStop(-9.0)], measured=False, limit=500.0, **FEW).figures.set_index("figure")
    assert stop.lower["track_reach"] <= stop.value["track_reach"] <= stop.upper["track_reach"]
    astern = predict(
        made, estimate, [CrashStop(9.0)], speed=-0.6, inputs={"n": -9.0}, measured=False, limit=500.0, **FEW
    )
    assert astern.figures.set_index("figure").value["head_reach"] > 0
    with pytest.raises(BadInput, match="astern"):
        predict(made, estimate, [CrashStop(9.0)], speed=-0.6, measured=False, **FEW)
    down = [deg(angle) for angle in (10, 5, 0, -5, -10)]
    spiral = predict(
        made, estimate, [Spiral((*down, *down[-2::-1]), hold=80.0)], measured=False, limit=800.0, dt=0.5, **FEW
    )
    row = spiral.figures.set_index("figure").loc["loop_height"]
    assert row["why"] or math.isfinite(row["value"])


def test_a_figure_that_does_not_vary_and_one_that_is_not_reached() -> None:
    made, _ = fitted()
    fixed = tuple(p.replace(vary=p.name == "X_vvvv", prior=None) for p in made.parameters)
    alone = made.replace(parameters=fixed)
    options = {"limit": 30.0, "measured": False, "form_error": 0.0, **FEW}
    found = predict(alone, identify(alone, threads=1), [Zigzag(deg(5), deg(2))], **options)
    table = found.figures.set_index("figure")
    step = found.conditions["dt"]
    assert table.upper["initial_turning_time"] - table.lower["initial_turning_time"] == pytest.approx(step)
    assert table.held_by["initial_turning_time"] == ""
    assert math.isnan(table.value["period"])
    assert table.why["period"]
    assert table.missing["period"] == 1.0
    assert "figures-missing" in [finding.code for finding in found.findings]


def test_a_regression_is_predicted_too() -> None:
    quiet = dict.fromkeys(("x", "y", "psi", "u", "v", "r"), 1e-4)
    made = study(cost=RegressionOptions(), noise=quiet)
    found = predict(made, identify(made, threads=1), [TurningCircle(deg(35), deg(300))], **FEW)
    truth = turning_circle_figures(sail(TurningCircle(deg(35), deg(300)), dt=0.2))
    advance = found.figures.set_index("figure").loc["advance"]
    assert advance["value"] == pytest.approx(truth.advance, rel=0.15)
    assert len(found.measured)


def test_one_trial_that_is_a_turn_and_one_held_out() -> None:
    made = study(plans=(TurningCircle(deg(35)),))
    other = study(plans=(Zigzag(deg(20), deg(20)),), seed=3)
    made = made.replace(holdout=Trials(list(other.trials)))
    found = predict(made, identify(made, threads=1), [], **FEW)
    assert len(found.figures) == 0
    assert dict(found.measured.groupby("role").kind.first()) == {"fit": "turn", "holdout": "zigzag"}
    turn = found.measured[found.measured.role == "fit"].set_index("figure")
    assert turn.predicted["tactical_diameter"] == pytest.approx(turn.measured["tactical_diameter"], rel=0.03)
    assert "one-trial-fitted" in [finding.code for finding in found.findings]


def test_the_environment_is_taken_away() -> None:
    import seatruth.sample

    sample = seatruth.sample.load()
    assert set(calm_water(sample.model)) == {"current_north", "current_east"}
    assert not any(calm_water(sample.model).values())
    assert calm_water(SHIP) == {}


def test_what_cannot_be_predicted_says_why() -> None:
    made, estimate = fitted()
    for changed, says in (
        ({"manoeuvres": [SpeedSteps((3.0,), 5.0)]}, "no figures of speed steps"),
        ({"draws": 3}, "3 draws"),
        ({"level": 1.0}, "level"),
        ({"scale": 0.0}, "scale"),
        ({"speed": 0.0}, "speed"),
        ({"inputs": {"nn": 3.0}}, "Did you mean 'n'"),
        ({"rudder_rate_limit": -1.0}, "rudder_rate"),
    ):
        with pytest.raises(BadInput, match=says):
            predict(made, estimate, **{"measured": False, **FEW, **changed})
