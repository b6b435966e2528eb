"""What is handed out of a real case: the study file. It says which ship it is, and nothing of weather or sensors."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from withheld.records.plan import Source

SHIPS = Path(__file__).resolve().parents[2] / "real_ships"
"""The studies that say how each ship is modelled and what is believed of its coefficients."""
TOLD = ("model", "actuators", "parameters")
"""Tables of a ship's study that its cases hold too."""
RATE = 2.0
"""Hz to which records are brought."""
BRIDGED = 0.35
"""s: longest repetition of a position across which it is read off on a straight line."""
HELD = ("x", "y")
"""Channels whose samples do not count where `pos_hold` says that they repeat the one before."""


def ship(study: str) -> Mapping[str, Any]:
    """The study file of a ship, as tables."""
    return tomllib.loads((SHIPS / f"{study}.toml").read_text(encoding="utf-8"))


def study_text(name: str, source: Source, told: Mapping[str, Any]) -> str:
    """A study file of a source's runs, trial_1.csv and so on. `told` are its tables in `TOLD`.

    The noise is not stated: what the ships' own studies state is the error that they expect of their model, and a
    diagnosis is to find that, not to be told it. The runs are taken at 2 Hz, which is fast for these ships and makes a
    diagnosis several times as quick.
    """
    pond = source.study == "esso_osaka"
    lines = [
        "# Real records, with an error of a sensor put into some cases and not into others (docs/withheld.md).",
        "[study]",
        f'name = "{name}"',
        f'description = "Withheld-effect benchmark, case {name}: {source.ship}. Records are under their own licences."',
        "",
        "[model]",
        *(f"{key} = {_toml(value)}" for key, value in told["model"].items()),
        "",
    ]
    for key, entry in told.get("actuators", {}).items():
        lines += [f"[actuators.{key}]", *(f"{field} = {_toml(value)}" for field, value in entry.items()), ""]
    for key, entry in told["parameters"].items():
        lines.append(f"[parameters.{key}]")
        lines += [f"{field} = {_toml(value)}" for field, value in entry.items()]
    lines += ["", "[channels]"]
    if not pond:
        lines.append('u = { column = "u" }')
    else:
        lines += [f'{key} = {{ invalid_where = "pos_hold == 1" }}' for key in HELD]
    for k, manoeuvre in enumerate(source.manoeuvres):
        lines += [
            "", "[[trials]]", f'name = "t{k + 1}"', f'file = "trial_{k + 1}.csv"',
            f'conditions = {{ manoeuvre = "{manoeuvre}" }}',
        ]  # fmt: skip
    lines += ["", "[[prepare]]", 'step = "resample"', f"rate = {RATE}", f"max_gap = {BRIDGED}"]
    lines += ["", "[cost]", 'kind = "trajectory"', f'hold = "{"zoh" if pond else "foh"}"', 'initial = "free"']
    lines += ["", "[optimizer]", 'use = "least_squares"']
    return "\n".join(lines) + "\n"


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key} = {_toml(inner)}" for key, inner in value.items()) + " }"
    if isinstance(value, Sequence):
        return "[" + ", ".join(_toml(inner) for inner in value) + "]"
    return repr(value)
