"""What the how-tos say to write and to call: their tables stand in a study that loads, and their commands exist."""

from __future__ import annotations

import json
import re
import shlex
import shutil
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import typer
from documents import ROOT

from seatruth import cli, load_study, optimizers
from seatruth.sample import copy_to

PAGES = sorted((ROOT / "docs" / "how-to").glob("*.md"))
RUN_WHOLE = {"csv", "parquet", "matlab", "hdf5", "excel", "ros1", "ros2", "mcap", "px4", "ardupilot", "nmea", "fmu"}
RUN_WHOLE |= {"prepare_a_diagnosis"}
"""Pages that `test_documents.py` runs whole, or whose study it reads with a vehicle of its own."""
_TOML = re.compile(r"^```toml\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_COMMAND = re.compile(r"(?:^(?:\$ )?|`)(seatruth [a-z][^`\n]*)", re.MULTILINE)
_OPTION = re.compile(r"`(--[a-z][a-z-]*)")
_GROUP: Any = typer.main.get_command(cli.app)


def commands() -> dict[str, Any]:
    """The commands of the command line, by name."""
    context = typer.Context(_GROUP)
    return {name: _GROUP.get_command(context, name) for name in cli.COMMANDS}


def tables(page: Path) -> list[dict[str, Any]]:
    """The blocks of TOML that a page shows."""
    return [tomllib.loads(block) for block in _TOML.findall(page.read_text(encoding="utf-8"))]


BLOCKS = [
    pytest.param(block, id=f"{page.stem}-{number}")
    for page in PAGES
    if page.stem not in RUN_WHOLE and page.stem != "own_solver"
    for number, block in enumerate(tables(page))
]


def sample_with(block: dict[str, Any], folder: Path) -> Path:
    """The sample's study with the tables of a block; the columns and files that it names are there."""
    study = tomllib.loads(copy_to(folder).read_text(encoding="utf-8"))
    for name, channel in block.get("channels", {}).items():
        flag = channel.get("invalid_where", "").split(" ")[0]
        for file in folder.glob("*.csv"):
            log = pd.read_csv(file, comment="#").rename(columns=lambda title: title.partition(" ")[0])
            log = log.rename(columns={name: channel.get("column", name)})
            log.assign(**({flag: 0} if flag else {})).to_csv(file, index=False)
        channel.setdefault("unit", study["channels"][name]["unit"])
    for trial in block.get("trials", []):
        shutil.copy(folder / "zigzag_20_10.csv", folder / trial["file"])
    for key, value in block.items():
        if isinstance(value, list) and isinstance(study.get(key), list):
            study[key] = [*study[key], *value]
        elif isinstance(value, dict) and isinstance(study.get(key), dict):
            study[key] = {**study[key], **value}
        else:
            study[key] = value
    if any("turn_*" in step.get("trials", []) for step in block.get("prepare", [])):
        long_turn(folder / "turn_35.csv")
        study["trials"].append({"file": "turn_35.csv"})
    file = folder / "study.toml"
    file.write_text("\n".join(f"{key} = {inline(value)}" for key, value in study.items()), encoding="utf-8")
    return file


def inline(value: Any) -> str:
    """A value in TOML on one line."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {inline(one)}" for key, one in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(inline(one) for one in value) + "]"
    return json.dumps(value)


def long_turn(file: Path) -> None:
    """A turn of 900 deg at a steady rate in a current of 0.1 m/s to the north (synthetic)."""
    t = np.arange(0.0, 300.0, 0.2)
    psi = np.radians(3.0) * t
    x, y = 20.0 * np.sin(psi) + 0.1 * t, -20.0 * np.cos(psi)
    speed = 20.0 * np.radians(3.0)
    log = {"t": t, "delta": 35.0, "n": 12.0, "x": x, "y": y, "psi": np.degrees(psi) % 360.0}
    log |= {"u": speed + 0.1 * np.cos(psi), "v": -0.1 * np.sin(psi), "r": 3.0}
    pd.DataFrame(log).to_csv(file, index=False)


@pytest.mark.parametrize("block", BLOCKS)
def test_the_tables_of_a_how_to_stand_in_a_study(block: dict[str, Any], tmp_path: Path) -> None:
    study = load_study(sample_with(block, tmp_path))
    steps = [step.name for trial in study.trials for step in trial.steps]
    assert {step["step"] for step in block.get("prepare", [])} <= {*steps}


def test_a_table_with_a_wrong_key_is_noticed(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="posterior_step"):
        load_study(sample_with({"output": {"posterior_step": 3}}, tmp_path))


def test_the_line_of_a_solver_stands_where_solvers_are_found() -> None:
    (block,) = tables(ROOT / "docs" / "how-to" / "own_solver.md")
    assert list(block["project"]["entry-points"]) == [optimizers.registry.GROUP]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_commands_of_a_how_to_can_be_parsed(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    known = commands()
    text = page.read_text(encoding="utf-8")
    for line in _COMMAND.findall(text):
        _, name, *arguments = shlex.split(line, comments=True)
        assert name in known, line
        if arguments:  # a command that is only named has none
            known[name].make_context(name, list(arguments))
    with pytest.raises(Exception, match="--no-such-option"):
        known["identify"].make_context("identify", ["study.toml", "--no-such-option"])
    options = {option for command in known.values() for parameter in command.params for option in parameter.opts}
    assert set(_OPTION.findall(text)) <= options
