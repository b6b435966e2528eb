"""Inputs that state a rule of their own between samples."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from seatruth import BadInput, load_study
from seatruth.sample import copy_to
from seatruth.study import Study


def study(folder: Path, *changes: tuple[str, str]) -> Study:
    """The sample with its orders held, and these changes."""
    copy_to(folder)
    text = (folder / "study.toml").read_text()
    for old, new in (("initial = ", 'hold = "zoh"\ninitial = '), *changes):
        assert old in text
        text = text.replace(old, new, 1)
    (folder / "s.toml").write_text(text)
    return load_study(folder / "s.toml")


MEASURED = ('n = { unit = "rev/s" }', 'n = { unit = "rev/s", hold = "foh" }')


def test_a_measured_input_is_joined_by_lines_beside_orders_that_are_held(tmp_path: Path) -> None:
    held, own = study(tmp_path), study(tmp_path, MEASURED)
    assert (dict(held.model.holds), dict(own.model.holds)) == ({}, {"n": "foh"})
    assert held.content_hash != own.content_hash, "a run that was cut off does not go on with the other"


@pytest.mark.parametrize(("hold", "usual"), [("foh", "zoh"), ("zoh", "foh")])
def test_an_input_on_a_clock_of_its_own_is_brought_over_as_it_says(tmp_path: Path, hold: str, usual: str) -> None:
    copy_to(tmp_path / "sample")
    head = (tmp_path / "sample" / "study.toml").read_text().split("[channels]")[0]
    rows = [f"{0.1 * k:.2f},{k % 7},{0.1 * k + 0.05:.2f},0,0,0,0,1" for k in range(40)]
    (tmp_path / "own.csv").write_text("\n".join(["t,n,n_clock,delta,x,y,psi,u", *rows]) + "\n")
    (tmp_path / "s.toml").write_text(
        f'{head}[channels]\nn = {{ time = "n_clock", hold = "{hold}" }}\n[[trials]]\nfile = "own.csv"\n'
        f'without = ["v", "r"]\n[cost]\nkind = "trajectory"\nhold = "{usual}"\n'
    )
    (trial,) = load_study(tmp_path / "s.toml").trials
    halves = np.isclose(trial.inputs["n"] % 1.0, 0.5)
    assert halves.any() == (hold == "foh"), "half way between two samples of its own"


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (('psi = { unit = "deg" }', 'psi = { unit = "deg", hold = "zoh" }'), "has no input 'psi'"),
        (("conditions = {", 'channels.n.hold = "foh"\nconditions = {'), "it is the same in all trials"),
        (('n = { unit = "rev/s" }', 'n = { unit = "rev/s", hold = "linear" }'), "hold"),
    ],
)
def test_what_is_wrong_is_said_with_its_line(tmp_path: Path, change: tuple[str, str], said: str) -> None:
    with pytest.raises(BadInput, match=said) as refused:
        study(tmp_path, change)
    assert "line " in str(refused.value)


def test_a_simulator_that_integrates_by_itself_is_told_so(tmp_path: Path) -> None:
    (tmp_path / "box.py").write_text(
        "from seatruth import BlackBox, Channel, Parameter\n"
        "def make():\n"
        "    def run(trial, p, first):\n"
        "        return {'x': p.k * trial.inputs['n']}\n"
        "    n, x = Channel('n', 'rev/s'), Channel('x', 'm')\n"
        "    return BlackBox('box', run, inputs=[n], outputs=[x], parameters=[Parameter('k', 1.0, '1', vary=True)])\n"
    )
    (tmp_path / "run.csv").write_text("t,n,x\n" + "".join(f"{k},1,{k}\n" for k in range(30)))
    (tmp_path / "s.toml").write_text(
        '[study]\nname = "box"\n[model]\nuse = "box.py:make"\n[channels]\nn = { hold = "zoh" }\n'
        '[[trials]]\nfile = "run.csv"\n[cost]\nkind = "trajectory"\n'
    )
    with pytest.raises(BadInput, match="integrates by itself: it joins or holds all its inputs alike"):
        load_study(tmp_path / "s.toml")
