"""The parts of a study that a file describes: parameters, noise, trials, a user's model, optimizer and budget."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatruth.errors import BadInput, PluginError
from seatruth.models import Model, load_model
from seatruth.models.parameter import Parameter
from seatruth.optimizers import Chain
from seatruth.study import noise, parameters, parse, solver, trial_files
from seatruth.study.schema import ModelTable
from seatruth.study.validation import Problems
from seatruth.trials import Channel, Trials

SHIP = '''
"""A first-order yaw model."""

from seatruth.models.base import Model
from seatruth.models.parameter import Parameter
from seatruth.trials import Channel


class Nomoto(Model):
    name = "nomoto"
    title = "Nomoto first-order yaw"
    kind = "ship"
    states = (Channel("r", "rad/s"), Channel("psi", "rad", angle=True))
    inputs = (Channel("delta", "rad"),)
    outputs = (Channel("r", "rad/s"), Channel("psi", "rad", angle=True))
    parameters = (
        Parameter("K", 0.1, "1/s", min=0.0, max=1.0, vary=True),
        Parameter("T", 10.0, "s", min=1.0, max=100.0),
    )

    @staticmethod
    def rhs(s, i, p):
        return (p.K * i.delta - s.r) / p.T, s.r
'''
LOG = "time,rudder_deg,yaw,heading,flag\n" + "\n".join(
    f"{k / 10},{10 if k < 20 else -10},{k / 100:.4f},{k / 10:.3f},{int(k == 7)}" for k in range(40)
)
STUDY = """
[model]
use = "ship.py:Nomoto"

[time]
column = "time"

[channels]
delta = { column = "rudder_deg", unit = "deg" }
r = { column = "yaw", unit = "deg/s", sign = -1 }
psi = { column = "heading", unit = "deg", invalid_where = "flag == 1" }

[[trials]]
file = "run_*.csv"
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "ship.py").write_text(SHIP)
    for name in ("run_a", "run_b"):
        (tmp_path / f"{name}.csv").write_text(LOG)
    return tmp_path


def ship(folder: Path) -> Model:
    return load_model("ship.py:Nomoto", folder)


def read(text: str, folder: Path) -> tuple[Trials, Trials]:
    file, problems = parse(text, "study.toml")
    model = ship(folder)
    found = trial_files.recordings(file, folder, problems)
    trials = trial_files.read(file, model, found, problems, synthetic=file.study.synthetic)
    problems.stop()
    return trials


def read_refused(text: str, folder: Path) -> str:
    with pytest.raises(BadInput) as caught:
        read(text, folder)
    return caught.value.message


def test_a_pattern_takes_every_file_and_channels_are_converted(folder: Path) -> None:
    fitted, held = read(STUDY, folder)
    assert fitted.names == ("run_a", "run_b")
    assert len(held) == 0
    trial = fitted["run_a"]
    np.testing.assert_allclose(trial.inputs["delta"][0], np.deg2rad(10.0))
    np.testing.assert_allclose(trial.outputs["r"][10], -np.deg2rad(0.1))
    assert np.flatnonzero(np.isnan(trial.outputs["psi"])).tolist() == [7]


def test_a_trial_overrides_keys_and_can_be_held_out(folder: Path) -> None:
    text = STUDY.replace("run_*.csv", "run_a.csv") + (
        '[[trials]]\nname = "held"\nfile = "run_b.csv"\nrole = "holdout"\nwithout = ["psi"]\n'
        "conditions = { depth = 20.0 }\nchannels = { r = { sign = 1 } }\n"
        'prepare = [{ step = "cut", start = 1.0 }]\n[[prepare]]\nstep = "zero_time"\ntrials = ["h*"]\n'
    )
    fitted, held = read(text, folder)
    assert fitted.names == ("run_a",)
    trial = held["held"]
    assert "psi" not in trial.outputs
    np.testing.assert_allclose(trial.outputs["r"][0], np.deg2rad(0.1))
    assert trial.conditions["depth"] == 20.0
    assert [step.name for step in trial.steps][-2:] == ["cut", "zero_time"]
    assert trial.t[0] == 0.0
    assert [step.name for step in fitted["run_a"].steps] == ["read"]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("run_*.csv", "run_c.csv", ["line 14", "no file 'run_c.csv'", "Did you mean 'run_"]),
        ("run_*.csv", "walk_*.csv", ["no file fits 'walk_*.csv'"]),
        ("run_*.csv", ".", ["is a folder"]),
        ('"run_*.csv"', '"run_*.csv"\nname = "one"', ["line 15", "2 files"]),
        ('"run_*.csv"', '"run_*.csv"\n[[trials]]\nfile = "run_a.csv"', ["two trials are called 'run_a'"]),
        ('"run_*.csv"', '"run_*.csv"\nrole = "holdout"', ["every trial is held out"]),
        ("[[trials]]", "[[prepare]]\nstep='cut'\n#", ["no trials", "[[trials]]"]),
        ("rudder_deg", "ruder_deg", ["no column 'ruder_deg'", "Did you mean 'rudder_deg'"]),
        ('"deg/s"', '"deg/sec2"', ["unit"]),
        ('"deg/s"', '"m"', ["'m'", "rad"]),
        ("psi = {", "psy = {", ["line 11", "unknown channel 'psy'", "Did you mean 'psi'"]),
        ("[channels]", "[channels]\nt = 'time'", ["[time]"]),
        ('"run_*.csv"', '"run_*.csv"\nwithout = ["psy"]', ["line 15", "Did you mean 'psi'"]),
        ("flag == 1", "__import__('os').system('true')", ["column"]),
        ('"run_*.csv"', '"run_*.csv"\nprepare = [{ step = "ct" }]', ["line 15", "Did you mean 'cut'"]),
        ('"run_*.csv"', '"run_*.csv"\nprepare = [{ step = "cut", strt = 1 }]', ["'strt'", "Did you mean 'start'"]),
        ('"run_*.csv"', '"run_*.csv"\nprepare = [{ step = "cut", start = "a" }]', ["line 15", "a number"]),
        ('"run_*.csv"', '"run_*.csv"\n[[prepare]]\nstep = "cut"\ntrials = ["rn_a"]', ["no trial fits", "run_a"]),
        ('"run_*.csv"', '"run_*.csv"\nprepare = [{ step = "cut", trials = ["x"] }]', ["acts on that trial alone"]),
    ],
)
def test_wrong_trials_are_refused_with_the_line(folder: Path, old: str, new: str, words: list[str]) -> None:
    assert old in STUDY
    message = read_refused(STUDY.replace(old, new, 1), folder)
    for word in words:
        assert word in message


DECLARED = (
    Parameter("Y_v", -0.3, min=-1.0, max=0.0, vary=True),
    Parameter("Y_r", 0.1, min=0.0, max=1.0),
    Parameter("N_v", 0.2),
)


def merged(text: str, vary: list[str] | None = None) -> dict[str, Parameter]:
    file, problems = parse(f"[parameters]\n{text}", "study.toml")
    result = parameters.merged(DECLARED, ModelTable(use="x", vary=vary or []), file.parameters, problems)
    problems.stop()
    return {parameter.name: parameter for parameter in result}


def test_parameters_take_what_the_file_says_and_keep_the_rest() -> None:
    found = merged("Y_v = -0.5\nN_v = { prior = { mean = 0.1, sd = 0.2 }, start = [0, 1] }", ["N_*"])
    assert (found["Y_v"].value, found["Y_v"].min, found["Y_v"].vary) == (-0.5, -1.0, True)
    assert found["N_v"].vary
    assert found["N_v"].prior is not None
    assert found["N_v"].start == (0.0, 1.0)
    assert not found["Y_r"].vary
    assert not merged('Y_v = { expr = "-2 * N_v" }')["Y_v"].vary
    assert not merged("Y_v = { vary = false }", ["Y_*"])["Y_v"].vary


def test_what_is_believed_of_a_parameter_is_where_it_begins() -> None:
    """Of a stranger's boat, whose priors alone were stated, the search began at the values of another boat."""
    assert merged("N_v = { prior = { mean = 0.1, sd = 0.2 } }")["N_v"].value == 0.1
    assert merged("N_v = { value = 0.3, prior = { mean = 0.1, sd = 0.2 } }")["N_v"].value == 0.3
    assert merged('N_v = { expr = "2 * Y_r", prior = { mean = 0.1, sd = 0.2 } }')["N_v"].value == 0.2


@pytest.mark.parametrize(
    ("text", "vary", "words"),
    [
        ("Y_v = { prior = { mean = 0.5, sd = 0.1 } }", [], ["line 2", "outside its bounds"]),
        ("Y_w = 1.0", [], ["line 2", "no parameter 'Y_w'", "Did you mean 'Y_"]),
        ("Y_v = 2.0", [], ["line 2", "outside its bounds"]),
        ("Y_v = { min = 1.0, max = 0.5 }", [], ["bounds", "empty"]),
        ("Y_v = { start = [-5.0, 0.0] }", [], ["start region"]),
        ('Y_v = { scale = "log", max = 1.0 }', [], ["one side of zero"]),
        ('Y_v = { vary = true, expr = "N_v" }', [], ["set by an expression and cannot vary"]),
        ("Y_v = { unit = 'm' }", [], ["unit of a model's parameter"]),
        ("", ["Z_*"], ["no parameter 'Z_*'"]),
    ],
)
def test_impossible_parameters_are_refused(text: str, vary: list[str], words: list[str]) -> None:
    with pytest.raises(BadInput) as caught:
        merged(text, vary)
    for word in words:
        assert word in caught.value.message


@pytest.mark.parametrize(
    ("value", "unit", "expected"),
    [(0.01, "m/s", 0.01), ("0.1 deg", "rad", np.deg2rad(0.1)), ("2 kn", "m/s", 2 * 1852 / 3600), ("0.5", "1", 0.5)],
)
def test_noise_is_read_with_its_unit(value: float | str, unit: str, expected: float) -> None:
    assert noise.deviation(value, unit) == pytest.approx(expected)
    assert noise.deviation("estimate", unit) == "estimate"


def test_the_noise_of_latitude_and_longitude_is_that_of_the_position_they_make() -> None:
    outputs = (Channel("x", "m"), Channel("y", "m"), Channel("psi", "rad"))
    problems = Problems("study.toml")
    stated = {"latitude": "10 cm", "longitude": "0.2 m", "psi": "1 deg"}
    found = noise.deviations(stated, outputs, ("noise",), problems)
    assert found == pytest.approx({"x": 0.1, "y": 0.2, "psi": np.deg2rad(1.0)})
    assert not problems
    assert noise.deviations({"easting": 0.5}, outputs, ("noise",), problems) == {"y": 0.5}
    for wrong, says in [
        ({"latitude": 0.1}, 'Write it in metres: x = "0.1 m"'),
        ({"latitude": "0.1"}, "degrees or metres"),
        ({"latitude": "0.1 m", "x": 0.1}, "stated twice"),
        ({"latitude": "1e-6 deg"}, "length"),
    ]:
        refused = Problems("study.toml")
        noise.deviations(wrong, outputs, ("noise",), refused)
        with pytest.raises(BadInput, match=says):
            refused.stop()
    lacking = Problems("study.toml")
    noise.deviations({"latitude": "0.1 m"}, outputs[2:], ("noise",), lacking)
    with pytest.raises(BadInput, match="unknown channel 'latitude'"):
        lacking.stop()


@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), float("inf"), "deg", "0.1 m", "0.1 dge", "estimat", ""])
def test_impossible_noise_is_refused(value: float | str) -> None:
    with pytest.raises(BadInput):
        noise.deviation(value, "rad")


def solved(text: str) -> Any:
    file, problems = parse(text, "study.toml")
    answer = solver.optimizer(file.optimizer, problems), solver.budget(file.budget, problems)
    solver.starts(file.optimizer, problems)
    problems.stop()
    return answer


def test_one_optimizer_or_a_hybrid_with_shares() -> None:
    optimizer, budget = solved('[optimizer]\nuse = "nelder_mead"\n[budget]\nseconds = 3.0')
    assert optimizer.name == "nelder_mead"
    assert (budget.evaluations, budget.seconds) == (None, 3.0)
    hybrid, budget = solved(
        '[[optimizer]]\nuse = "differential_swarm"\nshare = 0.5\n[[optimizer]]\nuse = "least_squares"'
    )
    assert isinstance(hybrid, Chain)
    assert hybrid.shares == (0.5,)
    assert budget.evaluations == 20_000


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('[optimizer]\nuse = "least_square"', ["line 2", "Did you mean 'least_squares'"]),
        ('[optimizer]\nuse = "cma_es"\nnonsense = 1', ["line 3", "no option 'nonsense'"]),
        ('[optimizer]\nuse = "cma_es"\nname = 1', ["no option 'name'"]),
        ("optimizer = []", ["empty"]),
        ("[optimizer]\nstarts = 0", ["line 2", "greater than 0"]),
        (
            '[[optimizer]]\nuse = "cma_es"\n[[optimizer]]\nuse = "newton"\nstarts = 3',
            ["line 5", "started as a whole", "first table"],
        ),
        ('[optimizer]\nuse = "cma_es"\nshare = 0.5', ["single optimizer"]),
        ('[[optimizer]]\nuse = "cma_es"\n[[optimizer]]\nuse = "newton"\nshare = 0.1', ["every stage but the last"]),
    ],
)
def test_wrong_optimizers_are_refused(text: str, words: list[str]) -> None:
    with pytest.raises(BadInput) as caught:
        solved(text)
    for word in words:
        assert word in caught.value.message


def test_a_plugin_failure_keeps_its_kind_and_bad_input_wins() -> None:
    problems = Problems("study.toml")
    with problems.at("model", "use"):
        raise PluginError("it raised")
    with pytest.raises(PluginError):
        problems.stop()
    problems.add(("noise",), "wrong")
    with pytest.raises(BadInput, match="2 problems"):
        problems.stop()


def test_channels_outside_the_model_need_a_word(folder: Path) -> None:
    channel = 'second = { column = "yaw", unit = "m", extra = true }\n[[trials]]'
    fitted, _ = read(STUDY.replace("[[trials]]", channel, 1), folder)
    assert "second" in fitted["run_a"].outputs
    assert "extra = true" in read_refused(STUDY.replace("[[trials]]", channel.replace(", extra = true", ""), 1), folder)
