"""Installed models and a user's own file: found by name, or refused with one clear message."""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import pytest

from seatruth import plugins
from seatruth.errors import BadInput, PluginError
from seatruth.models import BlackBox, available, broken, load_model, registry
from seatruth.models.mmg import MMGShip

MINE = """
from seatruth.models import Channel, Model, Parameter

class Mine(Model):
    name = "mine"
    states = (Channel("r", "rad/s"),)
    inputs = (Channel("delta", "rad"),)
    outputs = states
    parameters = (Parameter("K", 0.1, "1/s"),)

    @staticmethod
    def rhs(s, i, p):
        return (p.K * i.delta - s.r,)
"""


@pytest.fixture
def write(tmp_path: Path) -> Callable[[str], Path]:
    def write(text: str) -> Path:
        (tmp_path / "mine.py").write_text(text)
        return tmp_path

    return write


def test_built_in_models_are_installed() -> None:
    found = available()
    assert found["mmg"] is MMGShip
    assert {"mmg", "abkowitz", "diving_plane"} <= set(found)
    assert not broken()
    for name, kind in found.items():
        assert kind().name == name


def test_name_and_parameter_set() -> None:
    assert load_model("mmg").parameter("L").value == 7.0
    assert load_model("mmg", parameter_set="ESSO_OSAKA").parameter("L").value == 3.0
    with pytest.raises(BadInput, match="ESSO_OSAKA"):
        load_model("mmg", parameter_set="ESO_OSAKA")
    with pytest.raises(BadInput, match="no parameter sets"):
        load_model("abkowitz", parameter_set="mariner")


def test_wrong_name_gives_the_nearest() -> None:
    with pytest.raises(BadInput, match="Did you mean 'diving_plane'"):
        load_model("divingplane")


def test_own_file(write: Callable[[str], Path]) -> None:
    folder = write(MINE)
    model = load_model("mine.py:Mine", folder)
    assert model.name == "mine"
    assert model.nominal() == {"K": 0.1}
    assert load_model(f"{folder}/mine.py:Mine").name == "mine"


def test_an_edit_counts_at_once(write: Callable[[str], Path]) -> None:
    load_model("mine.py:Mine", write(MINE))
    assert load_model("mine.py:Mine", write(MINE.replace("0.1", "0.7"))).nominal() == {"K": 0.7}


def test_own_file_with_an_object_or_a_function(write: Callable[[str], Path]) -> None:
    folder = write(
        MINE
        + """
from seatruth.models import BlackBox
ready = Mine()
def make():
    return Mine()
box = BlackBox("box", lambda trial, p, s: {"r": 0 * trial.t}, inputs=[], outputs=Mine.outputs, parameters=[])
"""
    )
    assert load_model("mine.py:ready", folder).name == "mine"
    assert load_model("mine.py:make", folder).name == "mine"
    assert isinstance(load_model("mine.py:box", folder), BlackBox)


@pytest.mark.parametrize(
    ("text", "spec", "error", "message"),
    [
        ("class Mine(\n", "mine.py:Mine", BadInput, "mine.py, line 1: it is not valid Python"),
        ("x = 1\ny = 1 / 0\n", "mine.py:Mine", PluginError, "mine.py, line 2: running it raised ZeroDivisionError"),
        ("import no_such_module\n", "mine.py:Mine", PluginError, "line 1.*no_such_module"),
        ("raise SystemExit\n", "mine.py:Mine", PluginError, "ended the program"),
        (MINE, "mine.py:Mime", BadInput, "Did you mean 'Mine'"),
        (MINE, "mine.py", BadInput, "mine.py:Mine"),
        (MINE, "mimes.py:Mine", BadInput, "there is no model file 'mimes.py'. Did you mean 'mine.py'"),
        (MINE, "mine.txt:Mine", BadInput, "names no Python file"),
        ("Mine = 3\n", "mine.py:Mine", BadInput, "it is no Model"),
        ("def Mine():\n    raise ValueError('no')\n", "mine.py:Mine", PluginError, "ValueError: no"),
        (MINE.replace("rhs", "right"), "mine.py:Mine", BadInput, "no rhs"),
        (MINE.replace('"delta", "rad"', '"de lta", "rad"'), "mine.py:Mine", BadInput, "Use an identifier"),
        (MINE.replace("0.1", "float('nan')"), "mine.py:Mine", BadInput, "its value is nan"),
    ],
)
def test_what_is_wrong_with_a_file_is_said(
    write: Callable[[str], Path], text: str, spec: str, error: type[Exception], message: str
) -> None:
    folder = write(text)
    with pytest.raises(error, match=message):
        load_model(spec, folder)


def test_a_broken_plug_in_does_not_hide_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    points = [
        EntryPoint("mmg", "seatruth.models.mmg:MMGShip", registry.GROUP),
        EntryPoint("gone", "no_such_package:Gone", registry.GROUP),
        EntryPoint("number", "math:pi", registry.GROUP),
        EntryPoint("twice", "seatruth.models.mmg:MMGShip", registry.GROUP),
        EntryPoint("twice", "seatruth.models.abkowitz:AbkowitzShip", registry.GROUP),
    ]

    def entry_points(group: str) -> Any:
        return points

    monkeypatch.setattr(plugins, "entry_points", entry_points)
    assert list(available()) == ["mmg"]
    reasons = broken()
    assert "no_such_package" in reasons["gone"]
    assert "not a Model" in reasons["number"]
    assert "several packages" in reasons["twice"]
    with pytest.raises(PluginError, match="no_such_package"):
        load_model("gone")


def test_equations_without_staticmethod_are_named(write: Callable[[str], Path]) -> None:
    with pytest.raises(BadInput, match=r"rhs starts with 's'.*@staticmethod"):
        load_model("mine.py:Mine", write(MINE.replace("    @staticmethod\n", "")))
