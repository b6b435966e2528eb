"""The terms in which a missing force is looked for."""

from __future__ import annotations

import math
from collections import Counter
from typing import Any

import boat_case as boat
import numpy as np
import pytest

from seatruth.diagnosis.discrepancy.terms import Term, acceleration_unit, equations, terms_of
from seatruth.effects import load_effects, with_effects
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


def test_equations_are_those_of_the_motion() -> None:
    assert equations(boat.Boat()) == {"u": "surge", "v": "sway", "r": "yaw"}


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


def test_units() -> None:
    assert acceleration_unit(boat.Boat(), "u") == "m/s2"
    assert acceleration_unit(boat.Boat(), "r") == "rad/s2"
