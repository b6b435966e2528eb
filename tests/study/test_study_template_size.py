"""Whether a built-in ship suits the speeds of a log."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from seatruth.models import load_model
from seatruth.readers import Log, Table
from seatruth.study.fields import Fields
from seatruth.study.infer_columns import infer_columns
from seatruth.study.template_size import too_fast_for_its_length
from seatruth.trials import STANDARD_CHANNELS


def _said(header: str, speed: float, use: str) -> list[str]:
    numbers = speed * (1.0 - 0.2 * np.cos(np.linspace(0.0, 3.0, 50)))
    columns = {header: pd.Series(numbers), "t": pd.Series(np.arange(50.0))}
    fields = Fields(Log("log.csv", {"": Table("log.csv", columns, {})}))
    wanted = [STANDARD_CHANNELS[name] for name in ("u", "sog")]
    return too_fast_for_its_length(load_model(use), fields, infer_columns(fields, wanted))


@pytest.mark.parametrize(("header", "speed"), [("SOG (kn)", 16.0), ("u [m/s]", 8.0)])
def test_a_ship_at_sea_is_not_one_of_seven_metres(header: str, speed: float) -> None:
    (said,) = _said(header, speed, "mmg")
    assert "too fast for the ship of 7 m" in said
    assert "Froude number" in said


@pytest.mark.parametrize(
    ("header", "speed", "use"), [("u [m/s]", 1.2, "mmg"), ("SOG (kn)", 16.0, "abkowitz"), ("u [m/s]", 8.0, "torpedo")]
)
def test_what_suits_is_left_alone(header: str, speed: float, use: str) -> None:
    assert _said(header, speed, use) == []


def test_a_log_without_a_speed_tells_nothing() -> None:
    assert _said("yaw [deg]", 16.0, "mmg") == []
