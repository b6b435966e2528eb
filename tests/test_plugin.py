"""The optimizer of docs/optimizers.md: one file, installed by pip, then listed, run from a study file, and tested."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from documents import execute, files

from seatruth.sample import copy_to

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The package of the document, beside a folder `site` into which pip has installed it, and the sample study."""
    folder = tmp_path_factory.mktemp("plugin")
    for name, text in files("docs/optimizers.md").items():
        (folder / name).write_text(text)
    pip = [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check", "install"]
    subprocess.run([*pip, "--no-deps", "--no-build-isolation", "--target", "site", "."], cwd=folder, check=True)
    (folder / "hill_climber.py").unlink()  # what is found from now on is the installed one
    copy_to(folder)
    return folder


def call(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": str(folder / "site")}
    command = [sys.executable, *arguments]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=300)


def test_it_is_listed(folder: Path) -> None:
    done = call(folder, "-m", "seatruth", "list", "optimizers", "--long")
    assert done.returncode == 0, done.stderr
    assert "hill_climber" in done.stdout
    assert "Random steps from the best point" in done.stdout
    assert "steps tried at once" in done.stdout


def test_it_identifies_a_study(folder: Path) -> None:
    study = (folder / "study.toml").read_text()
    changed = study.replace('use = "least_squares"', 'use = "hill_climber"\nbatch = 40').replace("20000", "2000")
    (folder / "climbed.toml").write_text(changed)
    done = call(folder, "-m", "seatruth", "identify", "climbed.toml", "--quiet", "--json", "climbed.json")
    assert done.returncode == 0, done.stderr
    result = json.loads((folder / "climbed.json").read_text())["result"]
    assert result["optimizer"]["name"] == "hill_climber"
    assert result["optimizer"]["options"]["batch"] == 40
    assert result["outcome"]["evaluations"] <= 2000
    assert (folder / "climbed-result" / "report.html").exists()


def test_it_passes_the_conformance_suite(folder: Path) -> None:
    done = call(folder, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--rootdir", ".", "test_hill_climber.py")
    assert done.returncode == 0, done.stdout[-3000:]
    assert " passed" in done.stdout


def test_the_document_as_it_stands(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    monkeypatch.syspath_prepend(str(folder / "site"))
    found = execute("docs/optimizers.md")
    assert found["hybrid"].outcome["code"] in ("converged", "budget", "stall")
    assert found["hybrid"].optimizer["name"] != found["estimate"].optimizer["name"]
