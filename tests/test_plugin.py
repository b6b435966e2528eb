"""The optimizer and the effect of the documents: one file each, installed by pip, then listed, used, and tested."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from documents import execute, install

from seatruth.sample import copy_to


@pytest.fixture(scope="module")
def optimizer(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The package of docs/optimizers.md beside the sample study."""
    folder = tmp_path_factory.mktemp("optimizer")
    install("docs/optimizers.md", folder)
    (folder / "hill_climber.py").unlink()  # what is found from now on is the installed one
    copy_to(folder)
    return folder


@pytest.fixture(scope="module")
def effect(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The package of docs/effects.md beside the sample study."""
    folder = tmp_path_factory.mktemp("effect")
    install("docs/effects.md", folder)
    (folder / "askew_log.py").unlink()
    copy_to(folder)
    return folder


def call(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": str(folder / "site")}
    command = [sys.executable, "-m", *arguments]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=300)


def conforms(folder: Path, test: str) -> None:
    done = call(folder, "pytest", "-q", "-p", "no:cacheprovider", "--rootdir", ".", test)
    assert done.returncode == 0, done.stdout[-3000:]
    assert " passed" in done.stdout


def test_an_optimizer_is_listed(optimizer: Path) -> None:
    done = call(optimizer, "seatruth", "list", "optimizers", "--long")
    assert done.returncode == 0, done.stderr
    assert "hill_climber" in done.stdout
    assert "Random steps from the best point" in done.stdout
    assert "steps tried at once" in done.stdout


@pytest.mark.slow
def test_an_optimizer_identifies_a_study(optimizer: Path) -> None:
    study = (optimizer / "study.toml").read_text()
    changed = study.replace('use = "least_squares"', 'use = "hill_climber"\nbatch = 40').replace("20000", "2000")
    (optimizer / "climbed.toml").write_text(changed)
    done = call(optimizer, "seatruth", "identify", "climbed.toml", "--quiet", "--json", "climbed.json")
    assert done.returncode == 0, done.stderr
    result = json.loads((optimizer / "climbed.json").read_text())["result"]
    assert result["optimizer"]["name"] == "hill_climber"
    assert result["optimizer"]["options"]["batch"] == 40
    assert result["outcome"]["evaluations"] <= 2000
    assert (optimizer / "climbed-result" / "report.html").exists()


@pytest.mark.slow
def test_an_optimizer_conforms(optimizer: Path) -> None:
    conforms(optimizer, "test_hill_climber.py")


@pytest.mark.slow
def test_the_document_on_optimizers_as_it_stands(optimizer: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(optimizer)
    monkeypatch.syspath_prepend(str(optimizer / "site"))
    found = execute("docs/optimizers.md")
    assert found["hybrid"].outcome["code"] in ("converged", "budget", "stall")
    assert found["hybrid"].optimizer["name"] != found["estimate"].optimizer["name"]


@pytest.mark.slow
def test_an_effect_is_listed_and_named_by_a_study(effect: Path) -> None:
    assert "velocity log mounted askew" in call(effect, "seatruth", "list", "effects").stdout
    study = (effect / "study.toml").read_text().replace('["current"]', '["current", "askew_log"]')
    (effect / "askew.toml").write_text(study.replace('vary = ["current_*"', 'vary = ["askew_log_angle", "current_*"'))
    done = call(effect, "seatruth", "check", "askew.toml")
    assert done.returncode == 0, done.stderr
    assert "askew_log_angle" in done.stdout


@pytest.mark.slow
def test_an_effect_conforms(effect: Path) -> None:
    conforms(effect, "test_askew_log.py")
