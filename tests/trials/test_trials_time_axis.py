"""Time as logs write it: units, epochs, dates, times of day, and clocks that jump."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
import pytest

from seatruth.errors import BadInput
from seatruth.readers.tables import Table
from seatruth.trials.time_axis import Clock, TimeAxis, time_axis

START = 1753967661.5
"""31 July 2025, 13:14:21.5 UTC, in s since 1970."""


def axis(values: Sequence[Any], units: str | None = None, /, **clock: Any) -> TimeAxis:
    columns = {"time": pd.Series(list(values))}
    if "date" in clock:
        columns["day"] = pd.Series([clock["date"]] * len(values))
        clock["date"] = "day"
    table = Table("log.csv", columns, {"time": units} if units else {})
    return time_axis(table, Clock("time", **clock))


def test_the_start_has_no_digits_of_rounding() -> None:
    assert axis([1718613599.999, 1718613600.1]).about["start"] == "2024-06-17T08:39:59.999000+00:00"


@pytest.mark.parametrize(("unit", "factor"), [("s", 1.0), ("ms", 1e3), ("us", 1e6), ("ns", 1e9)])
def test_epochs_are_told_by_their_magnitude_and_go_on_record(unit: str, factor: float) -> None:
    found = axis([round((START + 0.1 * k) * factor, 1) for k in range(4)])
    assert found.t == pytest.approx([0.0, 0.1, 0.2, 0.3], abs=1e-6)
    assert str(found.about["start"]).startswith("2025-07-31T13:14:21.5")
    assert (found.notes == ()) == (unit == "s")
    if found.notes:
        assert found.notes[0].startswith(f"time read as {unit} since 1970, from 2025-07-31T13:14:2")
    stated = axis([(START + 0.1 * k) * factor for k in range(4)], unit=unit)
    assert stated.t == pytest.approx(found.t, abs=1e-6)


def test_epochs_in_a_unit_that_makes_no_date_are_refused_with_the_one_that_does() -> None:
    with pytest.raises(BadInput, match=r"in ms these numbers are dates of the year 57.*in us they begin on 2025-07-31"):
        axis([START * 1e6, START * 1e6 + 1e5], unit="ms")
    # Counted from switching on, the same size is 30 minutes in ns.
    assert axis([1.8e12, 1.8001e12], unit="ns").t[1] == pytest.approx(0.1 + 1800.0)


def test_numbers_without_a_unit_whose_steps_are_long_are_refused() -> None:
    with pytest.raises(BadInput, match=r"its usual step can be 100 s \(in s\) or 0.1 s \(in ms\)"):
        axis([0, 100, 200])
    assert axis([0, 100, 200], unit="ms").t[-1] == pytest.approx(0.2)
    assert axis([0, 100, 200], "ms").t[-1] == pytest.approx(0.2)
    assert axis([0.0, 0.1, 0.2]).t[-1] == pytest.approx(0.2)


@pytest.mark.parametrize(
    "texts",
    [
        ["2025-07-31T13:14:21.5", "2025-07-31T13:14:23.5"],
        ["2025-07-31T15:14:21.5+02:00", "2025-07-31T13:14:23.5Z"],
        ["2025-07-31 13:14:21,5", "2025-07-31 13:14:23,5"],
        ["31.07.2025 13:14:21.5", "31.07.2025 13:14:23.5"],
        ["31/07/2025 15:14:21.5 +0200", "31/07/2025 15:14:23.5 +0200"],
        ["07/31/2025 1:14:21.5 PM", "07/31/2025 1:14:23.5 PM"],
        ["31-Jul-2025 13:14:21.5", "31-Jul-2025 13:14:23.5"],
        ["2025/7/31 13:14:21.5 UTC", "2025/7/31 13:14:23.5 UTC"],
    ],
)
def test_dates(texts: list[str]) -> None:
    found = axis(texts)
    assert found.t == pytest.approx([0.0, 2.0])
    assert found.about["start"] == "2025-07-31T13:14:21.500000+00:00"


def test_dates_that_can_be_read_in_two_ways_are_refused_with_both() -> None:
    texts = ["03.07.2025 12:00:00", "03.07.2025 12:00:01"]
    with pytest.raises(BadInput, match=r"03\.07\.2025 can be 3 Jul 2025 or 7 Mar 2025.*") as problem:
        axis(texts)
    assert "day-first" in problem.value.do
    assert "line" in str(problem.value) or "row 1" in str(problem.value)
    assert axis(texts, dates="day-first").about["start"].startswith("2025-07-03")
    assert axis(texts, dates="month-first").about["start"].startswith("2025-03-07")


@pytest.mark.parametrize(
    ("texts", "options", "said"),
    [
        (["31.07.2025 12:00:00"], {"dates": "month-first"}, "is not month-first"),
        (["31.07.2025", "07.31.2025"], {}, "is not day-first"),
        (["31.07.25 12:00:00"], {}, "two digits"),
        (["31.02.2025 12:00:00"], {}, "no such day"),
        (["31.07.2025 25:00:00"], {}, "no such time of day"),
        (["31-Xyz-2025 12:00:00"], {}, "month is not known"),
        (["2025-07-31T12:00:00Z", "2025-07-31T12:00:01"], {}, "1 of 2 dates state their zone"),
        (["noon", "one"], {"unit": "date"}, "cannot be read"),
        ([1.0, 2.0], {"unit": "date"}, "holds numbers, not dates"),
        (["noon", "one"], {}, "is not a number"),
    ],
)
def test_dates_that_are_none_are_refused(texts: list[Any], options: dict[str, str], said: str) -> None:
    with pytest.raises(BadInput, match=said):
        axis(texts, **options)


def test_a_date_in_a_column_of_its_own() -> None:
    found = axis(["13:14:21.5", "13:14:22.5"], date="31.07.2025")
    assert found.about["start"].startswith("2025-07-31T13:14:21.5")
    with pytest.raises(BadInput, match="cannot be read together"):
        axis(["13:14:21.5"], date="today")


def test_times_of_day_go_through_midnight() -> None:
    found = axis(["23:59:59.5", "00:00:00.0", "00:00:00.5"])
    assert np.diff(found.t) == pytest.approx(0.5)
    assert found.notes == ("time of day goes through midnight 1 time(s)",)
    assert axis(["12:00:00", "12:00:01"]).notes == ()


def test_nmea_times_of_day_are_told_by_their_minutes() -> None:
    found = axis([123558.0, 123559.0, 123600.0, 123601.0])
    assert np.diff(found.t) == pytest.approx(1.0)
    assert found.notes[0].startswith("time read as hhmmss")
    assert np.diff(axis([235959.5, 0.0, 0.5], unit="hhmmss").t) == pytest.approx(0.5)
    hour = axis(["125959.00", "130000.00", "130001.00"])
    assert np.diff(hour.t) == pytest.approx(1.0)
    # Within one minute both readings have the same steps; seconds that go on past 59 are seconds.
    assert np.diff(axis([123550.0, 123551.0, 123552.0]).t) == pytest.approx(1.0)
    assert np.diff(axis([58.0, 59.0, 60.0, 61.0]).t) == pytest.approx(1.0)


def test_seconds_with_a_pause_are_not_taken_for_nmea() -> None:
    assert np.diff(axis([0.0, 1.0, 2.0, 50.0, 51.0, 100.0, 101.0]).t).max() == 49.0


def test_hhmmss_that_is_none_is_refused_with_its_place() -> None:
    with pytest.raises(BadInput, match=r"row 2.*125999 is no time of day"):
        axis([125958.0, 125999.0], unit="hhmmss")


def test_clocks_that_jump_are_closed_on_request() -> None:
    times = [0.0, 0.5, 1.0, 3601.0, 3601.5, 3600.0, 3600.5]
    found = axis(times, jumps=10.0)
    assert np.diff(found.t) == pytest.approx(0.5)
    assert found.notes[0].startswith("clock set 2 time(s) during the run, by +3599.5 s, -2 s")
    assert axis(times).t == pytest.approx(times)
    assert axis([0.0, 1.0, 2.0], jumps=10.0).notes == ()
    for jumps, said in ((0.0, "is no time"), (0.1, "no usual step")):
        with pytest.raises(BadInput, match=said):
            axis([0.0, 1.0, 2.0], jumps=jumps)


def test_long_counters_lose_their_start_and_units_are_checked() -> None:
    found = axis([2e7, 2e7 + 0.5], unit="s")
    assert (found.t[1], found.about) == (0.5, {"start_s": 2e7})
    with pytest.raises(BadInput, match="time: unit 'm' is"):
        axis([0.0, 1.0], unit="m")
