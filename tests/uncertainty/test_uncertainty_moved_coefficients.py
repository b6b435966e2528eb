"""A coefficient that a fit moves beyond what the study states of it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from nomoto_ship import call, write_ship

from seatruth.uncertainty.moved_coefficients import Coefficient, moved_coefficients


def test_what_surely_lies_outside_its_stated_prior_is_told() -> None:
    far = Coefficient("T", "s", 6.0, 1.0, 11.0, 0.5)
    farther = Coefficient("U", "m/s", 2.0, 0.1, 1.2, 0.02)
    unsure = Coefficient("K", "1/s", 0.15, 0.02, 0.23, 0.03)
    found = moved_coefficients({"T", "U", "K"}, [far, farther, unsure])
    assert [(one.code, one.where) for one in found] == [
        ("coefficient-far", "parameter 'U'"),
        ("coefficient-far", "parameter 'T'"),
    ]
    assert found[0].message == (
        "The fitted U, 1.200 +- 0.020 m/s, is 8.0 prior standard deviations from what the study states of it,"
        " 2.00 +- 0.10 m/s."
    )
    # What nobody stated is no belief, and without a standard error nothing is sure.
    assert moved_coefficients({"U"}, [far]) == []
    assert moved_coefficients({"T"}, [replace(far, stderr=float("nan"))]) == []


def test_an_error_larger_than_the_prior_s_does_not_make_it_less_sure() -> None:
    """A glider's added mass of 50 +- 8 kg came out at 150 +- 44, without a word: two of its errors are 88 kg."""
    (found,) = moved_coefficients({"A_33"}, [Coefficient("A_33", "kg", 50.0, 8.0, 150.0, 44.0)])
    assert "12.5 prior standard deviations" in found.message
    assert "yet it was not held there" in found.message
    assert "Fix it" in found.do


def test_beside_forces_of_no_name_it_is_half_of_the_story() -> None:
    """Of an ROV a bollard pull of 235 +- 30 N came out at 64, and forces of unknown cause held what it lacked."""
    one = Coefficient("k_V", "N", 235.0, 30.0, 64.0, 16.0)
    (found,) = moved_coefficients({"k_V"}, [one], beside_forces=True)
    assert "read it together with the formula of what is missing" in found.do
    (alone,) = moved_coefficients({"k_V"}, [one])
    assert "formula" not in alone.do


def test_one_at_its_bound_is_told_though_it_has_no_error() -> None:
    """An AUV's Y_dv of -86 +- 10 kg ended at -20, its bound, and nothing was said."""
    one = Coefficient("Y_dv", "kg", -86.0, 10.0, -20.0, float("nan"), at_bound=True)
    (found,) = moved_coefficients({"Y_dv"}, [one])
    assert found.message.startswith("The fitted Y_dv, -20 kg (at its bound), is 6.6 prior standard deviations from")
    assert moved_coefficients({"Y_dv"}, [replace(one, value=-42.0)]) == []


STUDY = """
[study]
name = "moved"
synthetic = true
[model]
use = "ship.py:Nomoto"
vary = ["K", "T"]
[parameters.K]
prior = { mean = 0.3, sd = 0.02 }
[parameters.T]
prior = { mean = 8.0, sd = 2.0 }
[noise]
r = "0.012 deg/s"
psi = "0.057 deg"
[[trials]]
file = "zigzag.csv"
[channels]
delta = { column = "rudder_deg", unit = "deg" }
r = { column = "yaw rate [deg/s]", unit = "deg/s" }
psi = { column = "Heading", unit = "deg" }
[time]
column = "Time(s)"
"""


def test_a_fit_that_contradicts_its_prior_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The boat has K = 0.12 1/s, and the study believes in 0.30 +- 0.02."""
    write_ship(tmp_path)
    (tmp_path / "study.toml").write_text(STUDY)
    assert call("identify", tmp_path / "study.toml", "--out", tmp_path / "out", "--workers", "1") == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "The fitted K, 0." in said
    assert "prior standard deviations from what the study states of it" in said
    assert "[coefficient-far]" in said
    assert "The fitted T," not in said
    assert "The fitted K, 0." in (tmp_path / "out" / "report.html").read_text()
