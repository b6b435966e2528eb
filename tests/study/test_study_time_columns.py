"""The column of a log's time, by its name or by its cells."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from seatruth.models import load_model
from seatruth.readers import Log, Table
from seatruth.study.fields import Fields
from seatruth.study.infer_columns import infer_columns
from seatruth.study.log import read_log
from seatruth.study.template import template
from seatruth.study.time_columns import dated_column
from seatruth.trials import Channel

ISO = [f"2026-06-11T10:{k // 60:02d}:{k % 60:02d}.500Z" for k in range(90)]


def fields(**columns: list[str] | np.ndarray | pd.Series) -> Fields:
    return Fields(Log("log.csv", {"": Table("log.csv", {k: pd.Series(v) for k, v in columns.items()}, {})}))


@pytest.mark.parametrize(
    "header",
    [
        *("time_utc", "utc_time", "datetime_utc", "m_present_time", "time (UTC)", "UTC Timestamp", "%time"),
        *("timeISO8601", "rosbagTimestamp", "header.stamp", "gps_timestamp [s]", "time_since_start_s", "date_time_utc"),
    ],
)
def test_a_time_is_known_by_its_words(header: str) -> None:
    assert [hit.column for hit in infer_columns({header: np.arange(9.0)}, [Channel("t", "s")]).values()] == [header]


@pytest.mark.parametrize("header", ["reaction_time", "lag time", "time_constant_s", "date", "run", "stamp_id", "boot"])
def test_other_times_are_left_alone(header: str) -> None:
    assert infer_columns({header: np.arange(9.0)}, [Channel("t", "s")]) == {}


def test_the_plain_time_goes_first() -> None:
    columns = {"gps_time_utc": np.arange(9.0), "time": np.arange(9.0)}
    assert infer_columns(columns, [Channel("t", "s")])["t"].column == "time"


@pytest.mark.parametrize(
    "cells",
    [
        ISO,
        [cell.replace("T", " ").removesuffix("Z") for cell in ISO],
        [f"31.07.2025 13:14:{k}" for k in range(10, 60)],
        pd.to_datetime(pd.Series(ISO)),
    ],
)
def test_a_column_of_dates_is_the_time(cells: list[str] | pd.Series) -> None:
    found = dated_column(fields(made=["2026-06-11T09:00:00Z"] * len(cells), note=["dive"] * len(cells), when=cells))
    assert found is not None
    assert (found.channel, found.column) == ("t", "when")


@pytest.mark.parametrize("cells", [["2026-06-11"] * 9, ["13:14:15"] * 9, ["a", "b", ""], np.arange(9.0), ISO[:1] * 9])
def test_days_times_of_day_and_one_date_alone_are_none(cells: list[str] | np.ndarray) -> None:
    assert dated_column(fields(when=cells)) is None


def test_init_writes_the_column_of_dates() -> None:
    table = Table("log.csv", {"rowid": pd.Series(np.arange(90.0)), "Sampled at": pd.Series(ISO)}, {})
    text, notes = template("log.csv", Log("log.csv", {"": table}), load_model("mmg"), "mmg")
    assert tomllib.loads(text)["time"] == {"column": "Sampled at", "unit": "date"}
    assert not any("time column" in note for note in notes)


def test_a_log_without_a_study_is_read_by_it(tmp_path: Path) -> None:
    rows = "\n".join(f"{cell},{k % 7},{10 + k}" for k, cell in enumerate(ISO))
    (tmp_path / "log.csv").write_text(f"Sampled at,rudder_deg,heading_deg\n{rows}\n")
    assert read_log(tmp_path / "log.csv").duration == pytest.approx(89.0)
