"""The terms in which a missing force is looked for."""

from __future__ import annotations

from collections import Counter

import boat_case as boat

from seatruth.diagnosis.discrepancy.terms import acceleration_unit, equations, terms_of
from seatruth.effects import load_effects, with_effects


def test_equations_are_those_of_the_motion() -> None:
    assert equations(boat.Boat()) == {"u": "surge", "v": "sway", "r": "yaw"}


def test_every_equation_has_the_same_terms_once() -> None:
    """The prior of coupled equations rests on it."""
    terms = terms_of(boat.Boat())
    by_state = {state: sorted(t.text for t in terms if t.state == state) for state in ("u", "v", "r")}
    assert by_state["u"] == by_state["v"] == by_state["r"]
    assert max(Counter((t.state, t.text) for t in terms).values()) == 1
    assert len({t.name for t in terms}) == len(terms)


def test_no_term_depends_on_the_course_or_the_place() -> None:
    names = {name for term in terms_of(boat.Boat()) for _, name in term.factors}
    assert names == {"u", "v", "r", "delta"}


def test_the_expected_terms_are_there() -> None:
    texts = {term.text for term in terms_of(boat.Boat())}
    assert {"1", "u", "u|u|", "u v", "u r", "v r", "u^2 delta", "delta|delta|", "delta"} <= texts


def test_effects_add_no_equation() -> None:
    extended = with_effects(boat.Boat(), load_effects(["rudder_lag"]))
    assert equations(extended) == equations(boat.Boat())
    assert [t.name for t in terms_of(extended)] == [t.name for t in terms_of(boat.Boat())]


def test_units() -> None:
    assert acceleration_unit(boat.Boat(), "u") == "m/s2"
    assert acceleration_unit(boat.Boat(), "r") == "rad/s2"
