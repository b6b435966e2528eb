"""Where the fit of one hypothesis begins."""

from __future__ import annotations

from pathlib import Path

import pytest
import small_case as small

from seatruth.diagnosis import hypothesis_fits
from seatruth.diagnosis.fit import Fit
from seatruth.diagnosis.hypotheses import Key, Search
from seatruth.diagnosis.search import search

WAVY = """
import math

from seatruth.effects import Effect
from seatruth.models import Parameter


class Wavy(Effect):
    name = "wavy"
    title = "a gyro whose error has valleys before its whole size"
    cause = "sensor"
    source = "chosen here"
    acts_on = ("sensor:r",)
    needs_outputs = ("r",)
    parameters = (Parameter("share", 1.0, "1", min=-0.5, max=1.5),)
    null = {"share": 0.0}
    likely = ({"share": 1.0},)

    @staticmethod
    def measured_outputs(y, s, i, q, e):
        return y._replace(r=y.r + 0.6 * (q.share + 0.25 * math.sin(4.0 * math.pi * q.share)) * s.r)
"""


def test_a_fit_starts_from_likely_values_too(ship_folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """From the null the first fit ends in a valley on the way."""
    (ship_folder / "wavy.py").write_text(WAVY)
    runs = small.trials(ship_folder, {"wavy_share": 1.0}, specs=["wavy.py:Wavy"])
    problem = small.problem(ship_folder, runs, ["wavy.py:Wavy"])
    (column,) = problem.columns["wavy"]
    ends: dict[str, Fit] = {}
    whole = hypothesis_fits.fit_once

    def noted(found: Search, key: Key, discrepancy: bool, *given: object, **named: object) -> Fit | None:
        end = whole(found, key, discrepancy, *given, **named)
        if key and not discrepancy:
            ends[str(named.get("attempt", "first"))] = end
        return end

    monkeypatch.setattr(hypothesis_fits, "fit_once", noted)
    leader = search(problem, small.silent).leader
    assert ends["first"].point.shared[column] < 0.8
    assert ends["from likely value 0 of wavy"].evidence > ends["first"].evidence + 100.0
    assert leader.point.shared[column] == pytest.approx(1.0, abs=3.0 * leader.stderr(problem)[column])
