"""`seatruth list`: what is installed, in the terminal and as JSON."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from nomoto_ship import answered, call

from seatruth.commands import list_installed


def test_list_optimizers_in_the_terminal_and_as_json(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    assert call("list", "optimizers", "--long", "--json", tmp_path / "out.json") == 0
    shown = capsys.readouterr().out
    assert "least_squares" in shown
    assert "\x1b" not in shown
    assert max(len(line.rstrip()) for line in shown.splitlines()) <= 80
    found = {entry["name"]: entry for entry in answered(tmp_path / "out.json")["result"]["optimizers"]}
    assert found["ls_svm"]["needs"] == ["regression"]
    assert found["cma_es"]["options"]


@pytest.mark.parametrize("detail", [(), ("--long",)])
@pytest.mark.parametrize("kind", list(list_installed.Kind))
def test_every_list_fits_a_terminal_of_80_columns(
    kind: str,
    detail: tuple[str, ...],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    assert call("list", kind, *detail, "--json", tmp_path / "out.json") == 0
    shown = capsys.readouterr().out
    assert max(len(line.rstrip()) for line in shown.splitlines()) <= 80
    names = [entry["name"] for entry in answered(tmp_path / "out.json")["result"][kind]]
    assert names
    assert not set(names) - set(shown.split())  # no name is broken to make room for the other columns


def test_list_costs_says_what_the_study_file_takes(capsys: pytest.CaptureFixture[str]) -> None:
    assert call("list", "costs", "--long") == 0
    shown = capsys.readouterr().out
    assert "max_step" in shown
    assert "`" not in shown


@pytest.mark.parametrize("kind", ["models", "effects"])
def test_a_long_list_explains_the_tags_of_its_sources(kind: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert call("list", kind, "--long") == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert "source: [L]" in shown
    assert "[L] other literature; [S] chosen here" in shown
    assert call("list", kind) == 0
    assert "Tags:" not in capsys.readouterr().out


def test_a_model_plugin_that_cannot_be_loaded_is_listed_with_its_error(monkeypatch: pytest.MonkeyPatch) -> None:
    from seatruth import models

    monkeypatch.setattr(models, "broken", lambda: {"a_broken_one": "no module named 'x'"})
    found = {entry["name"]: entry for entry in list_installed.list_installed(list_installed.Kind.models).data["models"]}
    assert "no module named" in found["a_broken_one"]["error"]
    assert "delta" in found["mmg"]["inputs"]


def test_an_optimizer_added_as_one_file_is_listed(tmp_path: Path) -> None:
    """A package of one module with an entry point, as `pip install` leaves it."""
    (tmp_path / "random_search.py").write_text(
        "from dataclasses import dataclass\n"
        "from seatruth.optimizers import Optimizer, option\n\n"
        "@dataclass(frozen=True)\n"
        "class RandomSearch(Optimizer):\n"
        "    name = 'random_search'\n"
        "    title = 'Uniform random search'\n"
        "    batch: int = option(50, 'candidates a call', low=1)\n\n"
        "    def run(self, problem, rng):\n"
        "        while True:\n"
        "            problem.values(problem.sample(rng, self.batch))\n"
    )
    info = tmp_path / "random_search-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: random-search\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[seatruth.optimizers]\nrandom_search = random_search:RandomSearch\n")
    code = f"import sys; sys.path.insert(0, {str(tmp_path)!r}); from seatruth.cli import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", code, "list", "optimizers", "--long"], capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 0, done.stderr
    assert "random_search" in done.stdout
    assert "Uniform random search" in done.stdout
    assert "candidates a call" in done.stdout


def test_a_kind_that_is_missing_or_unknown_is_answered_in_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert call("list") == 2
    lacking = capsys.readouterr().err.strip()
    assert "Missing argument 'KIND'. Choose from: models, effects, optimizers, costs, readers." in lacking
    assert "\n" not in lacking
    assert call("list", "boats") == 2
    assert "Invalid value for 'KIND': 'boats' is not one of 'models'" in capsys.readouterr().err
