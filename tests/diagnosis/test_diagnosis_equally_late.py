"""Compass and gyro that are late by the same, where the steering may be later instead."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from decided_by_hand import decided, hypotheses

from seatruth.diagnosis import equally_late as module
from seatruth.diagnosis.equally_late import equally_late, without_equally_late
from seatruth.effects import available

NAMES = ("heading_delay", "rate_delay", "rudder_delay")


def late(monkeypatch: pytest.MonkeyPatch, sizes: tuple[float, ...], names: tuple[str, ...] = NAMES, **fit: Any) -> Any:
    """What is found of delays of these sizes, s, each with an error of 0.004 s."""
    columns = {name: np.array([k]) for k, name in enumerate(NAMES)}
    at = {"effects": NAMES, "discrepancy": True, "point": SimpleNamespace(shared=np.array(sizes)), **fit}
    monkeypatch.setattr(module, "size_errors", lambda *_: np.full(3, 0.004))
    problem = cast(Any, SimpleNamespace(columns=columns))
    return equally_late(problem, cast(Any, SimpleNamespace(**at)), available(), names)


def test_equal_delays_of_compass_and_gyro_beside_a_late_rudder_look_like_it(monkeypatch: pytest.MonkeyPatch) -> None:
    both = ["heading_delay", "rate_delay"]
    assert late(monkeypatch, (0.039, 0.036, 0.436)) == both
    assert late(monkeypatch, (0.059, 0.036, 0.436)) == []  # apart by four errors of their difference
    assert late(monkeypatch, (0.039, 0.036, 0.0), names=("heading_delay", "rate_delay")) == []  # the rudder is in time
    assert late(monkeypatch, (0.039, 0.0, 0.436), names=("heading_delay", "rudder_delay")) == []  # the gyro is
    assert late(monkeypatch, (0.039, 0.036, 0.436), discrepancy=False) == []  # the model lacks nothing
    assert equally_late(cast(Any, None), None, available(), NAMES) == []


def test_the_rudder_stays_named_and_is_said_to_show_the_same() -> None:
    entries = (NAMES, 0.98, True), ((), 0.02, True)
    said = decided(*entries)
    left = without_equally_late(said, hypotheses(*entries), ["heading_delay", "rate_delay"])
    assert [one.effects for one in left.clusters] == [("rudder_delay",)]
    assert set(left.turning) == {"heading_delay", "rate_delay"}
    assert without_equally_late(said, hypotheses(*entries), []) is said
    alone = (("heading_delay", "rate_delay"), 0.98, True), ((), 0.02, True)
    none = without_equally_late(decided(*alone), hypotheses(*alone), ["heading_delay", "rate_delay"])
    assert (none.kind, set(none.turning)) == ("unknown", {"heading_delay", "rate_delay"})
