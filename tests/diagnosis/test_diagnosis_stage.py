"""The progress of one stage of a diagnosis."""

from __future__ import annotations

import time

import pytest

from seatruth.diagnosis.stage import AGAIN, Rising, Stage
from seatruth.progress import ProgressEvent


def test_what_nobody_can_count_is_among_the_time_to_go(monkeypatch: pytest.MonkeyPatch) -> None:
    """An ROV's diagnosis had "at most 13 s to go", and then fitted its leading sets again for 250 s."""
    clock, events = [0.0], list[ProgressEvent]()
    monkeypatch.setattr(time, "perf_counter", lambda: clock[0])
    say = Stage("Hypotheses", events.append, 0.0, AGAIN)

    def left_at(seconds: float, done: int) -> float | None:
        clock[0] = seconds
        say("the next set", done, 20)
        return events[-1].remaining_s

    assert left_at(10.0, 2) is None  # the first sets compile kernels
    assert left_at(100.0, 10) == pytest.approx(100.0 + AGAIN * 200.0)
    assert left_at(200.0, 20) == pytest.approx(AGAIN * 200.0)
    assert left_at(250.0, 20) == pytest.approx(AGAIN * 200.0 - 50.0)
    assert left_at(1000.0, 20) is None
    assert [event.total for event in events] == [20] * 5


def test_a_stage_that_is_counted_ends_with_its_count(monkeypatch: pytest.MonkeyPatch) -> None:
    clock, events = [0.0], list[ProgressEvent]()
    monkeypatch.setattr(time, "perf_counter", lambda: clock[0])
    say = Stage("Trials left out", events.append, 0.0)
    clock[0] = 30.0
    say("trial 6", 6, 8)
    assert events[-1].remaining_s == pytest.approx(10.0)
    say("trial 9", 9, 8)
    assert (events[-1].done, events[-1].total) == (9, 9)


def test_a_search_that_begins_again_has_its_time_to_go(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a boat's simulator, whose search began again with forces, it was 1.045 times what had passed, for 20 min."""
    clock, events = [0.0], list[ProgressEvent]()
    monkeypatch.setattr(time, "perf_counter", lambda: clock[0])
    say = Rising(Stage("Hypotheses", events.append, 0.0, AGAIN))
    for done in range(20):
        clock[0] = 5.0 * done
        say("without forces", done, 20)
    say.again()
    told = []
    for done in range(20):
        clock[0] = 100.0 + 20.0 * done
        say("with forces", done, 20)
        told.append(events[-1].remaining_s)
    numbers = [event.done for event in events]
    assert numbers == sorted(numbers)
    assert events[-1].total == 39
    assert told[0] == pytest.approx(100.0 + AGAIN * 200.0, rel=0.1), "as much again as before"
    assert told[10] > 9 * 20.0
