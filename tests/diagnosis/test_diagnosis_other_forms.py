"""Terms that damping of another form shows as well share their probability with it."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from decided_by_hand import decided

from seatruth.diagnosis.other_forms import (
    ACTS,
    ACTS_ALONE,
    THRUST_ACTS,
    acting,
    are_damping,
    standing_beside,
    with_other_forms,
)
from seatruth.diagnosis.posterior import answers, inclusion, none_and_unknown
from seatruth.diagnosis.verdict import Hypothesis
from seatruth.effects import available

EFFECTS = available()


def _one(effects: tuple[str, ...], probability: float, *, discrepancy: bool = False) -> Hypothesis:
    return Hypothesis(effects, discrepancy, 10.0, -2.0, probability, settled=True)


def test_a_term_of_the_hull_beside_forces_is_mostly_another_form_of_damping() -> None:
    found = with_other_forms([_one(("cross_flow",), 0.97, discrepancy=True), _one((), 0.03)], EFFECTS)

    assert sum(one.probability for one in found) == pytest.approx(1.0)
    assert (found[0].effects, found[0].discrepancy, found[0].like) == ((), True, ("cross_flow",))
    assert none_and_unknown(found) == pytest.approx((0.03, 0.97 * (1.0 - ACTS)))
    assert inclusion(found, ["cross_flow"])["cross_flow"] == pytest.approx(0.97 * ACTS)
    # The table of hypotheses can be followed: evidence, prior and probability fit together.
    assert found[0].log_prior == pytest.approx(-2.0 + math.log1p(-ACTS))


def test_without_forces_a_term_mostly_acts_where_it_explains_enough() -> None:
    def acts(evidence: float, *others: Hypothesis, effects: tuple[str, ...] = ("cross_flow",)) -> float:
        term = replace(_one(effects, 1.0), log_evidence=evidence)
        return acting([term, *others], effects, EFFECTS)

    forces = _one((), 0.0, discrepancy=True)
    assert acts(10.0 + 21.7, forces) == ACTS_ALONE[True] > 0.8
    assert acts(10.0 + 4.6, forces) == ACTS_ALONE[False] < 0.5
    # Where the set without it was not fitted, nobody can say what it adds.
    assert acts(100.0) == ACTS
    assert acting([replace(_one(("cross_flow",), 1.0), discrepancy=True), forces], ("cross_flow",), EFFECTS) == ACTS
    assert acting([_one(("wind",), 1.0), forces], ("wind",), EFFECTS) == 1.0
    # Of two terms the one that adds less decides.
    pair = ("cross_flow", "turning_loss")
    less, more = (replace(_one(("cross_flow",), 0.0), log_evidence=evidence) for evidence in (29.0, 12.0))
    assert acts(30.0, forces, less, effects=pair) == ACTS_ALONE[False]
    assert acts(30.0, forces, more, effects=pair) == ACTS_ALONE[True]


def test_what_acts_beside_it_keeps_its_probability() -> None:
    pair, alone = _one(("cross_flow", "current"), 0.9, discrepancy=True), _one(("current",), 0.1)
    found = with_other_forms([pair, alone], EFFECTS)

    assert inclusion(found, ["current", "cross_flow"])["current"] == pytest.approx(1.0)
    assert answers(found)["current",] == pytest.approx(0.1 + 0.9 * (1.0 - ACTS))


def test_a_factor_on_all_thrust_beside_another_cause_is_mostly_another_form_of_resistance() -> None:
    """Alone it is a cause like others, and that of one of several propellers is always a fault of its own."""
    one_of_two = EFFECTS["thruster_gain"].only("port")
    alone, port = _one(("thrust_gain",), 0.2), _one(("current", one_of_two.name), 0.1)
    several = {**EFFECTS, one_of_two.name: one_of_two}
    found = with_other_forms([_one(("speed_scale", "thrust_gain"), 0.7), alone, port], several)

    assert (found[0].effects, found[0].discrepancy, found[0].like) == (("speed_scale",), True, ("thrust_gain",))
    assert answers(found)["speed_scale",] == pytest.approx(0.7 * (1.0 - THRUST_ACTS))
    assert answers(found)["speed_scale", "thrust_gain"] == pytest.approx(0.7 * THRUST_ACTS)
    assert alone in found
    assert port in found


def test_what_trials_left_out_refuse_stands_for_another_form_as_well() -> None:
    before = [_one(("wind",), 0.8), _one(("current",), 0.2, discrepancy=True)]

    assert with_other_forms(before, EFFECTS) == before
    found = with_other_forms(before, EFFECTS, outdone=("wind",))
    assert none_and_unknown(found)[1] == pytest.approx(0.8 * (1.0 - ACTS))
    assert answers(found)["current",] == pytest.approx(0.2)


def test_what_may_be_a_part_of_another_form_is_said_where_nothing_is_named() -> None:
    """An answer of 87 % stood in the table, and "its cause is not in the library" above it."""
    said = decided((("added_mass",), 0.87, True), (("added_mass", "plane_lag"), 0.06, True), ((), 0.07))
    assert (said.kind, said.part, said.form) == ("unknown", ("added_mass",), ())
    # Where nearly half of it needs no missing forces, nothing is decided, and it looks like this all the same.
    said = decided((("added_mass",), 0.5, True), (("added_mass",), 0.43), ((), 0.07))
    assert (said.kind, said.part) == ("underpowered", ("added_mass",))


def test_a_form_of_the_model_never_acts() -> None:
    pair = ("drag_curve", "thrust_gain")
    found = with_other_forms([_one(("drag_curve",), 0.5), _one(pair, 0.2), _one(("thrust_gain",), 0.3)], EFFECTS)
    for key in (("drag_curve",), pair):
        assert acting([_one(key, 1.0)], key, EFFECTS) == 0.0
    assert answers(found) == {("thrust_gain",): pytest.approx(0.3)}
    assert none_and_unknown(found) == pytest.approx((0.0, 0.7))
    assert {one.like for one in found} == {("drag_curve",), pair, ()}


def test_terms_that_trials_left_out_refuse_never_act_where_the_form_of_the_model_stands_beside_them() -> None:
    (twin,) = with_other_forms([_one(("drag_curve",), 1.0)], EFFECTS, outdone=["drag_curve"])
    assert (twin.effects, twin.probability) == ((), pytest.approx(1.0))


def test_an_answer_stands_beside_the_waves_and_the_terms_of_another_form_that_lead_with_it() -> None:
    leading = ("cross_flow", "current", "wave_drift", "wave_forces")
    assert standing_beside(leading, available()) == ("cross_flow", "wave_forces")
    assert standing_beside(("current", "trial_current"), available()) == ()


def test_forces_on_one_side_and_a_loss_of_thrust_are_no_damping() -> None:
    """They may be a fouled side or a damaged propeller: nobody is told that nothing is wrong."""
    effects = available()
    assert are_damping(["cross_flow", "turning_loss", "drag_curve"], effects)
    for name in ("one_sided_turns", "thrust_gain", "drag_increase", "rudder_gain"):
        assert not are_damping(["cross_flow", name], effects)
