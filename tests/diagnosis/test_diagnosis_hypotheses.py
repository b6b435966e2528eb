"""Which fit speaks for a set of effects."""

from __future__ import annotations

from searched_by_hand import searched


def test_a_set_is_spoken_for_beside_the_terms_of_another_form_where_these_explain_more() -> None:
    found = searched({("current",): 90.0, ("current", "rudder_lag"): 465.0, ("current", "rudder_offset"): 80.0})
    fit = found.beside(("current",), ("rudder_lag",))
    assert fit is not None
    assert fit.effects == ("current", "rudder_lag")
    for form in ((), ("rudder_offset",), ("rudder_delay",)):
        fit = found.beside(("current",), form)
        assert fit is not None
        assert fit.effects == ("current",), form
    assert found.beside(("trial_current",), ("rudder_lag",)) is None


def test_a_set_is_spoken_for_beside_those_of_several_with_which_it_explains_most() -> None:
    sets = {("current",): 70.0, ("current", "wave_forces"): 90.0, ("current", "rudder_lag"): 60.0}
    found = searched(sets, ("current", "rudder_lag", "wave_forces"))
    # Never fitted beside both.
    for others in (("wave_forces",), ("rudder_lag", "wave_forces")):
        fit = found.beside(("current",), others)
        assert fit is not None
        assert fit.effects == ("current", "wave_forces")
