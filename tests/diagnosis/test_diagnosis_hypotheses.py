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
