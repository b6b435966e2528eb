"""One progress protocol for searches, profiles, comparisons and diagnoses."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace

import pytest
from known_glide import TRUE, study

from seatruth import Budget, ProgressEvent, compare, identify, load_study, sample
from seatruth.commands import progress
from seatruth.commands.common import error_console
from seatruth.comparison import Comparison, Noise, Problem
from seatruth.progress import remaining


@pytest.mark.parametrize(
    ("event", "text"),
    [
        (ProgressEvent("Uncertainty", elapsed_s=1.25), "Uncertainty: 1.2 s"),
        (
            ProgressEvent("Search", 5, 10, "evaluations", math.inf),
            "Search: 5 of 10 evaluations, best cost none yet, 0.0 s",
        ),
        (
            ProgressEvent("Search", 5, None, "evaluations", 1.5, 2.0, 3700.0, may_end_early=True),
            "Search: 5 evaluations, best cost 1.5, 2.0 s, at most 1 h 1 min to go",
        ),
        (
            ProgressEvent("Comparison", 3, 9, "runs", elapsed_s=4.0, remaining_s=75.0, message="1 failed"),
            "Comparison: 3 of 9 runs, 1 failed, 4.0 s, about 1 min 15 s to go",
        ),
    ],
)
def test_an_event_reads_as_a_line(event: ProgressEvent, text: str) -> None:
    assert str(event) == text


def test_time_to_go_is_that_of_equal_units() -> None:
    assert remaining(0, 10, 3.0) is None
    assert remaining(3, None, 3.0) is None
    assert remaining(2, 10, 3.0) == 12.0
    assert ProgressEvent("x", 3, 9).left == 6
    assert ProgressEvent("x", 3).left is None


def test_loading_a_study_reports_each_log() -> None:
    events: list[ProgressEvent] = []
    loaded = load_study(sample.FOLDER / "study.toml", progress=events.append)
    read = dict.fromkeys(event.stage for event in events)
    assert list(read) == [f"Reading {Path(trial.source).name}" for trial in (*loaded.trials, *loaded.holdout)]
    assert [event.done for event in events if event.done == event.total] == [100] * len(read)


def test_a_command_shows_how_far_its_logs_are_read(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(progress.ProgressLine, "_keep_alive", lambda *given: None)
    monkeypatch.setattr(progress, "_LOG_FIRST_S", 0.0)
    monkeypatch.setattr(progress, "_LOG_EVERY_S", 0.0)
    progress.load_study(sample.FOLDER / "study.toml")
    assert "Reading zigzag_20_20.csv: 100 of 100 percent" in capsys.readouterr().err
    progress.load_study(sample.FOLDER / "study.toml", quiet=True)
    assert capsys.readouterr().err == ""


def test_a_log_has_a_line_a_minute_and_one_too_where_a_step_takes_long(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    clock = [0.0]
    monkeypatch.setattr(progress, "time", SimpleNamespace(monotonic=lambda: clock[0]))
    line = progress.ProgressLine()
    for second in range(200):
        clock[0] = float(second)
        line(ProgressEvent("Search", second, None, "evaluations"))
    said = capsys.readouterr().err.splitlines()
    assert [int(text.split()[1]) for text in said] == [5, 65, 125, 185]

    clock[0] = 300.0
    waits = iter([False, False, True])
    line._ended = SimpleNamespace(wait=lambda seconds: next(waits))
    line._keep_alive(error_console())  # the second time nothing is due yet
    (still,) = capsys.readouterr().err.splitlines()
    assert still.startswith("Still at: Search: 199 evaluations")
    assert still.endswith("; nothing is reported for 1 min 41 s")


def test_identify_reports_every_stage() -> None:
    events: list[ProgressEvent] = []
    identify(
        study(), budget=Budget(evaluations=500), cross_validate=True, profile=["a"], progress=events.append, threads=1
    )
    assert list(dict.fromkeys(event.stage for event in events)) == [
        "Search",
        "Uncertainty",
        "Profile",
        "Cross-validation",
    ]
    last = {event.stage: event for event in events}
    assert last["Search"].message == "converged"
    assert (last["Profile"].done, last["Profile"].total) == (9, 9)
    assert (last["Cross-validation"].done, last["Cross-validation"].total) == (2, 2)
    times = [event.elapsed_s for event in events]
    assert times == sorted(times)


def test_compare_reports_runs(tmp_path: Path) -> None:
    events: list[ProgressEvent] = []
    problem = Problem("glide", study(initial="fixed"), TRUE)
    comparison = Comparison([problem], ["least_squares"], [Noise("white", 0.01)], seeds=2, budgets=[50])
    compare(comparison, tmp_path, progress=events.append)
    assert [(event.done, event.total) for event in (events[0], events[-1])] == [(0, 2), (2, 2)]
    assert events[-1].unit == "runs"
