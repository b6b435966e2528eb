"""What stands beside an effect in the tree of causes, in its place."""

from __future__ import annotations

import copy
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from searched_by_hand import searched

import seatruth.diagnosis.siblings as module
from seatruth.diagnosis.hypotheses import HOPE, Key, Search
from seatruth.diagnosis.problem import Point
from seatruth.diagnosis.siblings import as_probable_alone, fit_rivals, fit_siblings, siblings
from seatruth.effects import available


def test_a_lag_that_explains_as_much_alone_is_fitted_in_the_place_of_a_rate_limit(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    alone: dict[Key, float] = {
        ("rudder_rate_limit",): 145.0, ("rudder_lag",): 204.0, ("rudder_delay",): 80.0, ("rudder_offset",): 160.0,
        ("trial_current",): 583.0, (): 0.0,
    }  # fmt: skip
    found = searched({**alone, ("rudder_rate_limit", "trial_current"): 736.0})
    assert siblings(found, "rudder_rate_limit") == ["rudder_lag"]  # the delay is far behind, an offset another kind
    assert siblings(found, "trial_current") == []
    fitted: list[tuple[Key, bool, list[float], str]] = []

    def kept(found: Search, key: Key, on: bool, point: Point, sizes: Any, attempt: str, rival: float) -> None:
        assert rival == found.leader.evidence - HOPE
        fitted.append((key, on, point.shared.tolist(), attempt))

    monkeypatch.setattr(module, "fit_once", kept)
    fit_siblings(found)
    words = "in the place of rudder_rate_limit"
    lag = (("rudder_lag", "trial_current"), True, [0.0, 1.0, 0.0, 0.0, 0.0, 1.0], words)
    # So is what is as probable alone, of whatever kind: an offset that explains 160 nats, where 129 would do.
    offset = (("rudder_offset", "trial_current"), True, [0.0, 0.0, 0.0, 1.0, 0.0, 1.0], words)
    assert fitted == [lag, offset]
    fitted.clear()
    beside: dict[Key, float] = {("rudder_lag", "trial_current"): 700.0, ("rudder_offset",): 128.0}
    found = searched({**alone, ("rudder_rate_limit", "trial_current"): 736.0, **beside})
    assert "rudder_offset" not in as_probable_alone(found, "rudder_rate_limit")
    fit_siblings(found)
    assert fitted == []


def test_another_fault_of_the_same_single_actuator_is_a_sibling_whatever_its_kind() -> None:
    """Where it explains as much alone; not what is wrong with another one."""
    found = searched({("rudder_rate_limit",): 212.0, ("rudder_offset",): 266.0, ("current",): 300.0})
    effects = cast(dict[str, Any], found.problem.effects)
    for name, which in (("rudder_rate_limit", "port"), ("rudder_offset", "port"), ("current", "starboard")):
        effects[name] = copy.copy(effects[name])
        effects[name].which = (which,)
    assert siblings(found, "rudder_rate_limit") == ["rudder_offset"]
    effects["rudder_offset"].which = ("starboard",)
    assert siblings(found, "rudder_rate_limit") == []


def straying(evidence: dict[Key, float]) -> Search:
    """A search in which only forces hold runs of the model alone near their records."""
    found = searched({(): 0.0, **evidence})
    held = found.fits[(), True]
    found.fits[(), False] = cast(Any, SimpleNamespace(**{**vars(held), "evidence": -5000.0, "discrepancy": False}))
    return found


def test_beside_forces_a_sibling_that_was_never_fitted_is_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    """From where it is best begun, else from its typical size, where it has one sign; no other kind, nor elsewhere."""
    fitted: list[tuple[Key, list[float], str]] = []

    def kept(found: Search, key: Key, on: bool, point: Point, sizes: Any, attempt: str, rival: float) -> None:
        assert rival == found.leader.evidence - HOPE
        fitted.append((key, point.shared.tolist(), attempt))

    monkeypatch.setattr(module, "fit_once", kept)
    found = straying({("rudder_rate_limit",): 736.0})
    found.starts["rudder_lag"] = np.array([[0.7], [2.0]])
    found.problem.low[:] = 0.0
    fit_siblings(found)
    typical = available()["rudder_delay"].parameters[0].value
    assert fitted == [
        (("rudder_lag",), [0.0, 0.7, 0.0, 0.0, 0.0, 0.0], "in the place of rudder_rate_limit"),
        (("rudder_delay",), [0.0, 0.0, typical, 0.0, 0.0, 0.0], "in the place of rudder_rate_limit"),
    ]
    # What may have either sign begins where it is none.
    fitted.clear()
    found.problem.low[:] = -9.0
    fit_siblings(found)
    assert fitted[1][1] == [0.0] * 6
    # Of runs that are near their records what is linearized holds, and what was fitted in any set is known.
    fitted.clear()
    fit_siblings(searched({(): 0.0, ("rudder_rate_limit",): 736.0}))
    tried = {("rudder_lag", "current"): 1.0, ("rudder_delay", "current"): 1.0}
    fit_siblings(straying({("rudder_rate_limit",): 736.0, **tried}))
    assert fitted == []


@pytest.mark.parametrize(("promised", "again"), [(820.0, True), (798.5, False)])
def test_what_looks_like_the_leader_begins_at_its_end_where_it_promises_more_there(
    monkeypatch: pytest.MonkeyPatch, promised: float, again: bool
) -> None:
    """Of a glider, `trim` stood 24 nats behind a battery offset, for that it had ended short."""
    found = searched({
        (): 0.0, ("rudder_lag",): 822.0, ("rudder_delay",): 798.0, ("rudder_offset",): 600.0, ("current",): 100.0,
        ("rudder_lag", "trial_current"): 815.0,
    })  # fmt: skip
    fitted: list[tuple[Key, bool, list[float], str, float]] = []

    def begun(problem: Any, near: Any, name: str, values: Any) -> Point:
        shared = near.point.shared.copy()
        shared[problem.columns[name]] = values
        return Point(shared, near.point.initial, near.point.forces)

    def kept(
        found: Search, key: Key, on: bool, point: Point, sizes: Any, attempt: str, rival: float, stop: Any
    ) -> None:
        fitted.append((key, on, point.shared.tolist(), attempt, rival))

    monkeypatch.setattr(module, "fit_once", kept)
    monkeypatch.setattr(module, "started", begun)
    monkeypatch.setattr(module, "replace", lambda fit, point: SimpleNamespace(**{**vars(fit), "point": point}))
    monkeypatch.setattr(module, "promised", lambda *others: promised)
    monkeypatch.setattr(Search, "known_end", lambda self, key, on: None)
    fit_rivals(found)
    words = "from the end of rudder_lag, in the place of rudder_lag"
    anew = (("rudder_delay",), True, [0.0, 0.0, 1.0, 0.0, 0.0, 0.0], words, 798.0)
    assert fitted == ([anew] if again else [])
