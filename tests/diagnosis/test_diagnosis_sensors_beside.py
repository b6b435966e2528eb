"""Errors of sensors beside a set that has as many effects as it can have."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest
from searched_by_hand import searched

import seatruth.diagnosis.sensors_beside as module
from seatruth.diagnosis.hypotheses import Key, Search
from seatruth.diagnosis.sensors_beside import fit_sensor_errors

NAMES = ("cross_flow", "tether", "thrust_gain", "heading_bias", "gyro_bias", "current")
LEADER: Key = ("cross_flow", "tether", "thrust_gain")


def asked(monkeypatch: pytest.MonkeyPatch, found: Search, gains: dict[str, float]) -> list[Key]:
    """The sets that are fitted where an error explains so much beside any set, and keeps it."""
    fitted: list[Key] = []

    def beside(found: Search, at: Any, others: list[str]) -> dict[str, float]:
        assert "current" not in others, "no error of a sensor"
        return {name: at.evidence + gains.get(name, 0.0) for name in others}

    def kept(found: Search, key: Key, at: Any) -> None:
        fitted.append(key)
        gain = sum(gains.get(name, 0.0) for name in set(key) - {*at.effects})
        found.fits[key, True] = cast(
            Any, SimpleNamespace(**{**vars(at), "effects": key, "evidence": at.evidence + gain})
        )

    monkeypatch.setattr(module, "beside", beside)
    monkeypatch.setattr(module, "fit_both", kept)
    monkeypatch.setattr(module, "ensure", lambda found, key, at, attempt: fitted.append(key))
    fit_sensor_errors(found)
    return fitted


def test_what_could_be_probable_beside_the_leading_set_is_fitted(monkeypatch: pytest.MonkeyPatch) -> None:
    """The one that explains most first, and then another beside it; each beside the form of the hull alone at last."""
    with_heading = tuple(sorted((*LEADER, "heading_bias")))
    found = searched({(): 0.0, LEADER: 900.0}, NAMES)
    assert asked(monkeypatch, found, {"heading_bias": 43.0}) == [
        with_heading,
        ("cross_flow", "heading_bias", "thrust_gain"),
    ]
    found = searched({(): 0.0, LEADER: 900.0}, NAMES)
    both = tuple(sorted((*with_heading, "gyro_bias")))
    fitted = asked(monkeypatch, found, {"heading_bias": 43.0, "gyro_bias": 30.0})
    assert fitted[:3] == [with_heading, tuple(sorted((*LEADER, "gyro_bias"))), both]
    assert sorted(fitted[3:]) == [
        ("cross_flow", "gyro_bias", "thrust_gain"),
        ("cross_flow", "heading_bias", "thrust_gain"),
    ]


@pytest.mark.parametrize("gain", [0.0, 5.0])
def test_what_could_not_be_probable_is_not(monkeypatch: pytest.MonkeyPatch, gain: float) -> None:
    """Less than a wrong form that forces do not show, and one more effect, cost."""
    assert asked(monkeypatch, searched({(): 0.0, LEADER: 900.0}, NAMES), {"heading_bias": gain}) == []


def test_only_forces_tell_an_error_of_a_sensor_from_the_form_of_the_hull(monkeypatch: pytest.MonkeyPatch) -> None:
    found = searched({(): 900.0, LEADER: 0.0}, NAMES)
    assert asked(monkeypatch, found, {"heading_bias": 43.0}) == [], "forces alone lead"
    found = searched({(): 0.0, LEADER: 900.0}, NAMES)
    found.bare = True
    assert asked(monkeypatch, found, {"heading_bias": 43.0}) == []
