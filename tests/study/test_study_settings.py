"""What a study file says is what runs, from Python as from the command line; arguments replace settings visibly."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from known_glide import same
from known_glide import study as glide

sys.path.append(str(Path(__file__).parents[1] / "diagnosis"))
import small_case as small  # (another folder of tests)

from seatruth import Budget, diagnose, identify, load_study
from seatruth.cli import run
from seatruth.errors import BadInput
from seatruth.estimate import Estimate
from seatruth.optimizers import Optimizer
from seatruth.study import OutputSettings

LOG = "t,x\n" + "\n".join(f"{0.5 * k},{10.0 * (1.0 - np.exp(-0.1 * k)):.6f}" for k in range(60))
MODEL = """
from seatruth import Channel, Model, Parameter


class Lag(Model):
    name = "lag"
    states = (Channel("x", "m"),)
    outputs = states
    parameters = (
        Parameter("T", 4.0, "s", 0.5, 20.0, vary=True, source="test"),
        Parameter("goal", 8.0, "m", 1.0, 30.0, vary=True, source="test"),
    )

    @staticmethod
    def rhs(s, i, p):
        return ((p.goal - s.x) / p.T,)
"""
STUDY = """
[study]
seed = 7
synthetic = true

[model]
use = "lag.py:Lag"

[[trials]]
name = "one"
file = "log.csv"

[[trials]]
name = "two"
file = "log.csv"

[noise]
x = 0.01

[optimizer]
use = "cma_es"

[budget]
evaluations = 300

[output]
folder = "made"
cross_validate = true
profile = ["T"]
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "log.csv").write_text(LOG + "\n")
    (tmp_path / "lag.py").write_text(MODEL)
    (tmp_path / "study.toml").write_text(STUDY)
    return tmp_path


def test_the_study_holds_what_the_file_says(folder: Path) -> None:
    study = load_study(folder / "study.toml")
    assert isinstance(study.optimizer, Optimizer)
    assert study.optimizer.name == "cma_es"
    assert study.budget == Budget(evaluations=300)
    assert study.seed == 7
    assert study.output == OutputSettings(folder / "made", True, True, ("T",))
    assert study.source == folder / "study.toml"


def test_python_and_the_command_line_run_the_file_alike(folder: Path) -> None:
    python = identify(load_study(folder / "study.toml"))
    assert run(["identify", str(folder / "study.toml"), "--quiet"]) == 0
    command = Estimate.load(folder / "made")
    for found in (python, command):
        assert found.optimizer["name"] == "cma_es"
        assert found.outcome["code"] == "budget"
        assert found.outcome["evaluations"] == 300
        assert found.seed == 7
        assert {entry["from"] for entry in found.provenance["settings"].values()} == {"study file"}
    same(python, command)
    assert python.profile is not None
    assert command.profile is not None
    pd.testing.assert_frame_equal(python.profile["T"], command.profile["T"], check_exact=True)
    assert python.cross_validation is not None
    pd.testing.assert_frame_equal(python.cross_validation, command.cross_validation, check_exact=True)


def test_an_argument_replaces_a_setting_and_the_estimate_says_so(folder: Path) -> None:
    study = load_study(folder / "study.toml")
    python = identify(study, "least_squares", seed=3, budget=Budget(evaluations=200), cross_validate=False, profile=())
    settings = python.provenance["settings"]
    assert settings["seed"] == {"value": 3, "from": "argument", "replaces": 7, "study_file": True}
    assert settings["budget"]["replaces"]["evaluations"] == 300
    assert settings["optimizer"]["value"]["name"] == "least_squares"
    assert settings["optimizer"]["replaces"]["name"] == "cma_es"
    assert (python.seed, python.optimizer["name"], python.cross_validation) == (3, "least_squares", None)
    assert not python.profile
    said = [finding for finding in python.findings if finding.code == "settings-replaced"]
    assert len(said) == 1
    assert "optimizer, budget, seed, cross_validate, profile" in said[0].message
    assert run(["identify", str(folder / "study.toml"), "--seed", "3", "--evaluations", "100", "--quiet"]) == 0
    command = Estimate.load(folder / "made").provenance["settings"]
    assert command["seed"]["from"] == command["budget"]["from"] == "argument"
    assert command["optimizer"]["from"] == command["profile"]["from"] == "study file"


def test_the_same_value_as_an_argument_replaces_nothing(folder: Path) -> None:
    found = identify(load_study(folder / "study.toml"), seed=7, budget=Budget(evaluations=300))
    assert found.provenance["settings"]["seed"] == {"value": 7, "from": "argument"}
    assert not [finding for finding in found.findings if finding.code == "settings-replaced"]


def test_starts_come_from_the_file_or_the_command_line(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = folder / "study.toml"
    path.write_text(STUDY.replace('use = "cma_es"', 'use = "least_squares"\nstarts = 3'))
    study = load_study(path)
    assert study.starts == 3
    file = identify(study, cross_validate=False, profile=())
    assert file.starts is not None
    assert file.provenance["settings"]["starts"] == {"value": 3, "from": "study file"}
    assert run(["identify", str(path), "--starts", "4", "--quiet"]) == 0
    found = Estimate.load(folder / "made")
    assert found.starts is not None
    assert len(found.starts) == 4
    assert found.provenance["settings"]["starts"]["replaces"] == 3
    pd.testing.assert_frame_equal(found.starts.iloc[:3, :2], file.starts.iloc[:, :2])
    printed = capsys.readouterr().out
    assert "Where the starts ended" in printed
    assert not list((folder / "made").glob("checkpoint*"))


def test_a_study_made_in_python_is_run_with_its_own_settings() -> None:
    study = glide().replace(optimizer=["cma_es", "least_squares"], budget=Budget(evaluations=400), seed=5)
    found = identify(study)
    assert found.seed == 5
    assert found.optimizer["name"] == "chain"
    assert found.provenance["settings"]["seed"] == {"value": 5, "from": "study"}
    same(found, identify(glide(), ["cma_es", "least_squares"], budget=Budget(evaluations=400), seed=5))


def test_profiles_by_pattern_from_the_command_line(folder: Path) -> None:
    assert run(["identify", str(folder / "study.toml"), "--profile", "g*", "--quiet"]) == 0
    found = Estimate.load(folder / "made")
    assert found.profile is not None
    assert list(found.profile) == ["goal"]
    assert run(["identify", str(folder / "study.toml"), "--profile", "h*", "--quiet"]) == 2


def test_a_diagnosis_takes_the_seed_of_the_study(tmp_path: Path) -> None:
    place = small.folder_with_model(tmp_path)
    study = small.study(place, small.shortened(small.trials(place), 30)[:2]).replace(seed=11)
    found = [
        diagnose(study, ["gyro_bias"], seed=seed, validate=False, suggest=False, threads=1).seed for seed in (None, 4)
    ]
    assert found == [11, 4]


def test_unknown_settings_are_refused() -> None:
    with pytest.raises(BadInput, match=r"no 'sed'.*Did you mean 'seed'"):
        glide().replace(sed=1)
