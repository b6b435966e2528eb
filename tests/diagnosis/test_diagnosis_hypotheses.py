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


def test_what_is_judged_stands_beside_the_waves_that_lead_where_it_was_fitted_with_them() -> None:
    sets = {("current", "wave_forces"): 90.0, ("current", "rudder_lag"): 60.0}
    found = searched(sets, ("current", "rudder_lag", "trial_current", "wave_forces"))
    leading = ("current", "wave_forces")
    assert found.with_what_moves(("current",), (), leading) == ("current", "wave_forces")
    assert found.with_what_moves(("current",), (), ("current", "trial_current")) == ("current",)
    # Never fitted beside the term of another form: without the waves, then.
    assert found.with_what_moves(("current",), ("rudder_lag",), leading) == ("current", "rudder_lag")
