"""Errors put into records: exact, of the library's typical size, and the same as what its own effects mean by them."""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

sys.path.append(str(Path(__file__).resolve().parents[2] / "experiments"))

from withheld.records.injected import Columns, injected, late
from withheld.records.plan import CASES, ERRORS, LENGTHS, SOURCES

from seatruth.effects import available
from seatruth.models import load_model


def _record(n: int = 200, step: float = 0.1) -> Columns:
    t = 3.0 + step * np.arange(n)
    wave = np.sin(0.3 * t)
    return {
        "t": t, "x": 0.9 * t, "y": 2.0 * wave, "psi": 0.5 * wave, "u": 0.9 + 0.05 * wave, "v": 0.1 * wave,
        "r": 0.15 * np.cos(0.3 * t), "delta": 0.2 * wave, "pos_hold": (np.arange(n) % 7 == 0) * 1.0,
    }  # fmt: skip


@pytest.mark.parametrize("key", [key for key, error in ERRORS.items() if not key.endswith("delay")])
def test_nothing_but_its_sensor_is_changed(key: str) -> None:
    record = _record()
    kept = {name: values.copy() for name, values in record.items()}
    error = ERRORS[key]
    changed = injected(record, key, error.values(7.0, 1.0))
    touched = {name for name in record if not np.array_equal(changed[name], record[name])}
    assert touched == {place.split(":")[1] for place in error.place.split(",")}
    assert all(np.array_equal(record[name], kept[name]) for name in record), "the record itself is left alone"


@pytest.mark.parametrize("key", [key for key, error in ERRORS.items() if error.number != 10])
def test_the_library_means_the_same_by_it(key: str) -> None:
    """Its effect's own equation, at the same values, gives the same sensors."""
    record = _record()
    error = ERRORS[key]
    values = error.values(7.0, 2.0)
    effect = available()[error.name]
    for k in (0, 77, 199):

        class Outputs(SimpleNamespace):
            def _replace(self, **more: float) -> Outputs:
                return Outputs(**{**vars(self), **more})

        sample = Outputs(**{name: float(column[k]) for name, column in record.items()})
        assert effect.measured_outputs is not None
        theirs = type(effect).measured_outputs(sample, None, None, SimpleNamespace(**values), None)
        ours = injected(record, key, values)
        for name in ("x", "y", "psi", "u", "v", "r"):
            assert ours[name][k] == pytest.approx(getattr(theirs, name), abs=1e-12)


def test_a_turned_log_keeps_the_speed_and_turns_its_direction() -> None:
    record = _record()
    changed = injected(record, "log_misalignment", {"angle": 0.05})
    assert np.allclose(np.hypot(changed["u"], changed["v"]), np.hypot(record["u"], record["v"]))
    turned = np.arctan2(changed["v"], changed["u"]) - np.arctan2(record["v"], record["u"])
    assert np.allclose(turned, -0.05)


@pytest.mark.parametrize("tau", [0.4, 0.25])
def test_a_late_sensor_says_what_it_said_before(tau: float) -> None:
    record = _record()
    changed = late(record, ("x", "y"), tau)
    assert changed["t"][0] == pytest.approx(record["t"][0] + tau, abs=0.1)
    assert changed["x"] == pytest.approx(0.9 * (changed["t"] - tau), abs=1e-9)
    assert np.array_equal(changed["psi"], record["psi"][-len(changed["t"]) :])
    if tau == 0.4:
        dropped = len(record["t"]) - len(changed["t"])
        assert dropped == 4
        assert np.allclose(changed["y"], record["y"][:-4], atol=1e-12)
        assert np.array_equal(changed["pos_hold"], record["pos_hold"][:-4]), "a flag is late with its sample"


def test_sizes_are_once_and_twice_what_the_library_calls_typical() -> None:
    models = {"marin": "KVLCC2", "hsva": "KVLCC2", "pond_31-Jul": "ESSO_OSAKA"}
    effects = available()
    for source, name in models.items():
        model = load_model("mmg", parameter_set=name)
        for error in ERRORS.values():
            assert effects[error.name].number == error.number
            typical = {key: prior.sd for key, prior in effects[error.name].priors(model).items()}
            assert error.values(LENGTHS[source], 1.0) == pytest.approx(typical), (source, error.key)
    put = [plan for plan in CASES if plan.kind == "injected"]
    assert {plan.times for plan in put} == {1.0, 2.0}
    assert {plan.cause for plan in put} == set(ERRORS)


def test_every_record_with_an_error_has_its_control() -> None:
    controls = {plan.source for plan in CASES if plan.kind in ("control", "wind")}
    assert {plan.source for plan in CASES if plan.kind == "injected"} <= controls
    assert all(len(source.runs) == len(source.manoeuvres) for source in SOURCES.values())
    assert [plan.kind for plan in CASES[:2]] == ["control", "injected"]
    assert CASES[0].source == CASES[1].source, "the quick set is a case and its control"
