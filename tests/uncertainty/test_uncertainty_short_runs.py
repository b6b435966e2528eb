"""Which way a model drives is told by whatever speed there is, and the heading turns no speed round."""

from __future__ import annotations

import numpy as np
import pytest

from seatruth import load_model
from seatruth.trials.trial import Trial
from seatruth.uncertainty.short_runs import _motion, judged, pieces_of, speed_of


def test_the_way_ahead_is_that_along_the_heading_and_a_current_from_astern_is_no_reverse() -> None:
    t = np.arange(0.0, 60.0, 0.1)
    psi = 0.1 * t
    north, east = np.cos(psi), np.sin(psi)
    assert _motion(np.array([2.0 * north, 2.0 * east, psi]), ("v_n", "v_e", "psi")) == pytest.approx(2.0)
    x, y = np.cumsum(0.2 * north) - 0.2, np.cumsum(0.2 * east)
    assert _motion(np.array([x, y, psi]), ("x", "y", "psi")) == pytest.approx(2.0 * t, rel=1e-3, abs=0.01)
    assert _motion(np.array([-x, -y, psi]), ("x", "y", "psi")) == pytest.approx(-2.0 * t, rel=1e-3, abs=0.01)


def test_a_speed_ahead_goes_before_a_track_and_a_track_before_none() -> None:
    boat, t = load_model("twin_thruster"), np.arange(10.0)
    one = np.ones(10)
    track = Trial("track", t, {}, {"x": one, "y": one, "psi": one})
    assert speed_of(boat, [track]) == ("x", "y", "psi")
    assert speed_of(boat, [track, Trial("log", t, {}, {"psi": one})]) == ()
    assert speed_of(boat, [Trial("log", t, {}, {"u": one, "psi": one})]) == ("u",)
    assert judged(boat, [track], ("r", "psi")) == "psi"


def test_a_record_is_cut_from_its_start() -> None:
    t = np.arange(0.0, 50.0)
    assert [len(piece) for piece in pieces_of(Trial("a", t, {}, {"r": t}), 20.0)] == [20, 20]
