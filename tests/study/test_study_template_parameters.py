"""The parameters of a first study file."""

from __future__ import annotations

import tomllib
from typing import Any

import pytest

from seatruth.diagnosis.settings import Settings
from seatruth.models import Channel, Model, Parameter, load_model
from seatruth.models.parameter import Prior
from seatruth.study.template_parameters import one_line, parameter_lines


class Few(Model):
    """A model whose parameters are known in different ways."""

    name = "few"
    states = outputs = (Channel("u", "m/s"),)
    parameters = (
        Parameter("m", 1900.0, "kg", min=1000.0, max=4000.0),
        Parameter("X_u", -340.0, "kg/s", min=-1500.0, max=0.0, description="damping"),
        Parameter("Y_v", 0.0, "kg/s", min=-10.0, max=10.0),
        Parameter("N_r", -2.0, "kg m2/s", min=-10.0, max=10.0, prior=Prior(-2.0, 0.1)),
    )

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return ((p.X_u + p.Y_v + p.N_r) * s.u / p.m,)


def test_free_parameters_have_a_prior_to_be_corrected() -> None:
    """As a diagnosis takes it; open where nothing gives its size, and none where the model says it."""
    lines = parameter_lines(Few(), own=True)
    assert 'vary = ["X_u", "Y_v", "N_r"]' in lines
    assert [line for line in lines if "prior = " in line and line.startswith("# X_u")] == [
        "# X_u = { prior = { mean = -340.0, sd = 68 } }   # damping [kg/s]"
    ]
    assert "# Y_v = { prior = { mean = 0.0, sd = ? } }   # [kg/s]" in lines
    assert not any(line.startswith("# N_r") for line in lines)
    assert "# m = 1900.0   # [kg]" in lines
    assert any(f"{100 * Settings().coefficient_sd:.0f} % of the value" in line for line in lines)


def test_the_lines_hold_without_their_mark() -> None:
    lines = parameter_lines(load_model("mmg"), own=False)
    free = next(line for line in lines if line.startswith("# Y_v = "))
    stated = tomllib.loads(free.removeprefix("# "))["Y_v"]["prior"]
    assert stated["sd"] == pytest.approx(0.2 * abs(stated["mean"]), rel=1e-5)


def test_a_comment_stays_on_its_line() -> None:
    assert one_line("a\n b\x07c") == "a b c"


def test_masses_added_masses_and_gravity_stay_and_it_is_said_why() -> None:
    class Own(Few):
        parameters = (
            *Few.parameters,
            *(
                Parameter(name, 4.0, "kg", min=0.0, max=9.0)
                for name in ("m_0", "m_h", "a_11", "A_33", "lambda_22", "Y_dv")
            ),
            Parameter("m_x", 0.05, "1", min=0.0, max=0.3),
            Parameter("k_0", 0.5, "1", min=0.3, max=0.7, source="open-water curve"),
            Parameter("Y_d", 79.0, "kg/(m rad)", min=10.0, max=300.0, source="slope of a low aspect ratio"),
            Parameter("I_px", 4.0, "kg m2", min=0.0, max=9.0),
            Parameter("g", 9.81, "m/s2", min=9.7, max=9.9),
            Parameter("M_q", -4.0, "kg m2/s", min=-9.0, max=0.0),
        )

    lines = parameter_lines(Own(), own=True)
    place = lines.index('vary = ["X_u", "Y_v", "N_r", "Y_d", "M_q"]')
    assert "no scale, drawing or data sheet gives" in lines[place - 2]


def test_no_reason_is_given_where_the_model_frees_its_own() -> None:
    assert not any("no scale" in line for line in parameter_lines(load_model("mmg"), own=False))


def test_an_added_mass_that_is_guessed_is_free_and_a_coefficient_of_a_sheet_is_not() -> None:
    class Guessed(Few):
        parameters = (
            Few.parameters[0].replace(source="guess"),
            Parameter("Y_dv", 4.0, "kg", min=0.0, max=9.0, source="sister boat, scaled"),
            Parameter("N_dr", 4.0, "kg m2", min=0.0, max=9.0, source="strip theory"),
            Parameter("X_u", -340.0, "kg/s", min=-1500.0, max=0.0, source="data sheet, estimated"),
            Parameter("k_0", 0.5, "1", min=0.3, max=0.7, source="propeller sheet"),
        )

    assert 'vary = ["Y_dv", "X_u"]' in parameter_lines(Guessed(), own=True)


def test_of_a_model_with_one_source_for_everything_the_forces_are_free() -> None:
    class Sheet(Few):
        parameters = tuple(p.replace(source="data sheet", prior=None) for p in Few.parameters)

    assert 'vary = ["X_u", "Y_v", "N_r"]' in parameter_lines(Sheet(), own=True)
