"""The terms in which a missing force is looked for."""

from __future__ import annotations

import dataclasses
import math
from collections import Counter
from typing import Any

import boat_case as boat
import numpy as np
import pytest

from seatruth.diagnosis.discrepancy.equations import equations
from seatruth.diagnosis.discrepancy.terms import Term, humps_between, terms_of
from seatruth.effects import load_effects, with_effects
from seatruth.effects.alike_drives import kinds_of_drives
from seatruth.models import Thruster, load_model
from seatruth.models.base import Model
from seatruth.models.diving_plane import DivingPlane
from seatruth.models.parameter import Parameter
from seatruth.models.torpedo import Torpedo
from seatruth.trials.channel import Channel


class Strange(Model):
    """States of names that nobody knows."""

    name, title, kind = "strange", "two lags", "ship"
    states = outputs = (Channel("alpha", "m/s"), Channel("beta", "m/s"))
    inputs = (Channel("delta", "rad"),)
    parameters = (Parameter("T", 2.0, "s", min=0.1, max=9.0, vary=True),)

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return (i.delta - s.alpha) / p.T, s.alpha - s.beta


def texts(model: Model, state: str) -> set[str]:
    return {term.text for term in terms_of(model) if term.state == state}


def test_every_term_stands_once_in_its_equation() -> None:
    terms = terms_of(boat.Boat())
    assert max(Counter((t.state, t.text) for t in terms).values()) == 1
    assert len({t.name for t in terms}) == len(terms)


@pytest.mark.parametrize("model", [boat.Boat(), Torpedo(), DivingPlane()], ids=lambda model: str(model.name))
def test_terms_do_in_the_mirror_what_their_equations_do(model: Model) -> None:
    """By numbers: the mirror changes the sign of sway, roll, yaw and the rudder; of nothing else."""
    rng = np.random.default_rng(2)
    labels = equations(model)
    sideways = {"delta", "delta_d", *(name for name, label in labels.items() if label in ("sway", "roll", "yaw"))}
    for term in terms_of(model):
        value = {name: float(rng.normal()) for _, name in term.factors}

        def product(mirrored: bool, term: Term = term, value: dict[str, float] = value) -> float:
            signed = {name: -x if mirrored and name in sideways else x for name, x in value.items()}
            return math.prod(abs(signed[name]) if what == "absolute" else signed[name] for what, name in term.factors)

        sign = -1.0 if labels[term.state] in ("sway", "roll", "yaw") else 1.0
        assert product(True) == pytest.approx(sign * product(False)), (term.label, term.text)


MIRRORED = {
    "twin_thruster": {"n_port": "n_starboard", "n_starboard": "n_port"},
    # The first of each pair stands on the starboard side; positive thrust of both points ahead, or both aft.
    "bluerov2": {"c_1": "c_2", "c_2": "c_1", "c_3": "c_4", "c_4": "c_3", "c_5": "c_6", "c_6": "c_5"},
}
"""Which thruster's order is which one's in the mirror."""


@pytest.mark.parametrize("name", MIRRORED)
def test_terms_of_thrusters_do_in_the_mirror_what_their_equations_do(name: str) -> None:
    """By numbers: the mirror exchanges what is to port and to starboard, and changes the sign of sway, roll and yaw."""
    model, rng = load_model(name), np.random.default_rng(3)
    labels = equations(model)
    sideways = {state for state, label in labels.items() if label in ("sway", "roll", "yaw")}
    terms = [term for term in terms_of(model) if term.thrusters]
    assert {term.label for term in terms} >= {"surge", "yaw"}
    value = {channel: float(rng.normal()) for channel in (*labels, *MIRRORED[name])}
    mirrored = {c: -x if c in sideways else x for c, x in value.items()}
    mirrored |= {other: value[one] for one, other in MIRRORED[name].items()}

    def of(term: Term, at: dict[str, float]) -> float:
        assert all(what == "state" for what, _ in term.factors)
        flow = math.prod(at[channel] for _, channel in term.factors)
        return flow * sum(w * at[i] * (abs(at[i]) if term.squared else 1.0) for i, w in term.thrusters)

    for term in terms:
        sign = -1.0 if term.state in sideways else 1.0
        assert of(term, mirrored) == pytest.approx(sign * of(term, value)), (term.label, term.text)


def test_thrusters_of_one_kind_share_their_terms() -> None:
    """What one gives less than the others is a cause, and no form of the model."""
    boat_ = load_model("twin_thruster")
    assert {"(n_port + n_starboard)", "(n_port|n_port| + n_starboard|n_starboard|)"} <= texts(boat_, "u")
    assert "u^2 (n_port - n_starboard)" in texts(boat_, "r")
    assert not any("n_" in text for text in texts(boat_, "v"))
    alone = {term.text for term in terms_of(boat_) if not term.thrusters}
    assert not any("n_port" in text or "n_starboard" in text for text in alone)


class Tunnels(boat.Boat):
    """A propeller, and two tunnels of which the aft one has the shorter lever."""

    name = "tunnels"
    inputs = (Channel("delta", "rad"), Channel("n", "rev/s"), Channel("bow", "1"), Channel("aft", "1"))
    actuators = (
        Thruster("main", "n", at=(-2.0, 0.0, 0.0), towards=(1.0, 0.0, 0.0), full=20.0),
        Thruster("bow", "bow", at=(2.0, 0.0, 0.0), towards=(0.0, 1.0, 0.0), full=1.0),
        Thruster("aft", "aft", at=(-1.0, 0.0, 0.0), towards=(0.0, 1.0, 0.0), full=1.0),
    )


def test_each_thruster_has_its_lever() -> None:
    model = Tunnels()
    assert [list(kind) for kind in kinds_of_drives(model)] == [["bow", "aft"]]
    levers = {t.label: dict(t.thrusters) for t in terms_of(model) if t.thrusters}
    assert levers == {"sway": {"bow": 1.0, "aft": 1.0}, "yaw": {"bow": 1.0, "aft": -0.5}}
    assert "(bow|bow| - 0.5 aft|aft|)" in texts(model, "r")
    assert "u^2 n" in texts(model, "u")


class Jets(boat.Boat):
    """Two jets under one order, and under one nozzle angle."""

    name = "jets"
    inputs = (Channel("delta", "rad"), Channel("n", "rev/s"))
    parameters = (*boat.Boat.parameters, Parameter("y_j", 0.5, "m"))
    port = Thruster("jet_port", "n", at=(-4.0, "-y_j", 0.0), towards=(1.0, 0.0, 0.0), full=50.0)
    actuators = (port, dataclasses.replace(port, name="jet_starboard", at=(-4.0, "y_j", 0.0)))


class OneSide(Jets):
    """The starboard jet alone."""

    name = "one_side"
    actuators = Jets.actuators[1:]


def test_two_jets_under_one_order_turn_no_hull() -> None:
    """A nozzle 1.2 deg off was taken for a term in n|n| of the yaw equation, which pushes to one side."""
    assert not any("n" in text.replace("|", " ").split() for text in texts(Jets(), "r"))
    assert {"n", "n|n|"} <= texts(Jets(), "u")
    assert {"n", "n|n|"} <= texts(OneSide(), "r"), "one beside the middle line does"


def test_what_the_mirror_does_to_two_unknown_inputs_nobody_says() -> None:
    twin = boat.Catamaran()
    for state in ("u", "v", "r"):
        assert {"port", "port|port|", "u^2 starboard"} <= texts(twin, state)
    assert "1" in texts(twin, "u")
    assert "1" not in texts(twin, "r")


def test_a_model_of_unknown_motions_has_all_terms_everywhere() -> None:
    strange = Strange()
    terms = [texts(strange, state) for state in equations(strange)]
    assert len(terms) == 2
    assert all(own == terms[0] for own in terms)
    assert "1" in terms[0]


def test_no_term_depends_on_the_course_or_the_place() -> None:
    names = {name for term in terms_of(boat.Boat()) for _, name in term.factors}
    assert names == {"u", "v", "r", "delta"}


def test_the_expected_terms_are_there() -> None:
    assert texts(boat.Boat(), "u") == {"1", "u", "u|u|", "v^2", "r^2", "v r", "delta^2"}
    odd = {"v", "v|v|", "r", "r|r|", "u v", "u r", "u^2 delta", "delta|delta|", "delta"}
    assert texts(boat.Boat(), "v") == texts(boat.Boat(), "r") == odd


def test_effects_add_no_equation() -> None:
    extended = with_effects(boat.Boat(), load_effects(["rudder_lag"]))
    assert equations(extended) == equations(boat.Boat())
    assert [t.name for t in terms_of(extended)] == [t.name for t in terms_of(boat.Boat())]


def test_humps_cover_the_speeds_and_stand_in_surge_alone() -> None:
    humps = humps_between("u", 0.4, 1.3)
    assert [hump.middle for hump in humps] == [0.5, 0.75, 1.0, 1.25]
    assert not humps_between("u", 0.97, 1.02)
    wide = humps_between("u", -2.0, 2.0)
    assert 7 <= len(wide) <= 9
    terms = [term for term in terms_of(boat.Boat(), humps) if term.hump is not None]
    assert [term.label for term in terms] == ["surge"] * 4
    assert len({term.text for term in terms}) == len({term.name for term in terms}) == 4


def test_a_term_is_written_in_the_units_of_the_channels() -> None:
    """What a reader puts in, the model has put in: by numbers."""
    scales = {"u": 2.0, "v": 0.5, "r": 0.1, "psi": 1.0, "x": 1.0, "y": 1.0, "delta": 0.2}
    values = {"u": 1.7, "v": -0.3, "r": 0.06, "delta": -0.11}
    for term in terms_of(boat.Boat(), humps_between("u", 0.4, 1.3)):
        inner = math.prod(
            abs(values[name] / scales[name]) if what == "absolute" else values[name] / scales[name]
            for what, name in term.factors
        )
        if term.hump is not None:
            inner *= math.exp(-(((values["u"] / scales["u"] - term.hump.middle) / term.hump.width) ** 2))
        text, factor = term.written(scales)
        python = text.replace("^", "**").replace("|u|", "*abs(u)").replace("|v|", "*abs(v)").replace("|r|", "*abs(r)")
        python = python.replace("|delta|", "*abs(delta)")
        if term.hump is None:
            python = python.replace(" ", "*")
        assert factor * eval(python, {"exp": math.exp, "abs": abs}, values) == pytest.approx(inner, rel=0.01), text
