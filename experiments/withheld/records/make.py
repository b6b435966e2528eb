"""First step for the real set: public cases from recorded runs, and what is sealed of each."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from seatruth.errors import BadInput
from withheld.records import anemometer
from withheld.records.injected import injected
from withheld.records.plan import BASINS, CASES, ERRORS, QUICK, SOURCES, Plan
from withheld.records.ships import fitted_elsewhere
from withheld.records.studies import TOLD, ship, study_text
from withheld.records.tables import DATA, folder_of, read, text
from withheld.seal import digest_file, note, write

SET = "real"
SEED = 20261121
"""Of the order of the cases, which says nothing."""
USED = ("t", "x", "y", "psi", "u", "v", "r", "delta", "n", "pos_hold")


def order(count: int) -> list[int]:
    """For each name c001, c002, ... the number of its plan; a quick set is the first plans alone."""
    return [int(k) for k in np.random.default_rng(SEED).permutation(count)]


def make(out: Path, data: Path | None, quick: bool) -> None:
    """Makes the set, or what is missing of it. BadInput where the real trials are not there."""
    real = (data or DATA).resolve()
    count = QUICK if quick else len(CASES)
    for plan in CASES[:count]:
        folder_of(real, SOURCES[plan.source].study)
    settings_file = out / "sealed" / "_set.json"
    settings = {"set": SET, "cases": count, "seed": SEED}
    if settings_file.exists():
        if json.loads(settings_file.read_text(encoding="utf-8")) != settings:
            raise BadInput("another set is there already", where=str(out), do="Give another --out.")
    else:
        for part in ("public", "sealed"):
            (out / part).mkdir(parents=True, exist_ok=True)
        write(settings_file, json.dumps(settings) + "\n")
    plans = {f"c{k + 1:03d}": CASES[number] for k, number in enumerate(order(count))}
    missing = [name for name in plans if not (out / "sealed" / f"{name}.json").exists()]
    print(f"{count - len(missing)} of {count} real cases are there; {len(missing)} to make", flush=True)
    if missing:
        note(out, "generate", "begin", {"set": SET, "cases": count})
    for name in missing:
        one_case(plans, name, out, real)
        print(f"{name}: made", flush=True)
    seal = {name: digest_file(out / "sealed" / f"{name}.json") for name in plans}
    # The originals are shut off too: beside them an error that was put in would be plain, and the anemometer is there.
    public = {"set": SET, "sealed": seal, "denied": [str(real)]}
    write(out / "public" / "seal.json", json.dumps(public, indent=1) + "\n")
    if missing:
        note(out, "generate", "end", {"sealed": digest_file(out / "public" / "seal.json")})


def one_case(plans: Mapping[str, Plan], name: str, out: Path, data: Path) -> None:
    """Writes one case; the public part first, so that a sealed file says that all is there."""
    plan = plans[name]
    source = SOURCES[plan.source]
    folder = out / "public" / name
    folder.mkdir(parents=True, exist_ok=True)
    for k, run in enumerate(source.runs):
        table = read(data / source.study / f"{run}.csv")
        columns = {column: table.columns[column] for column in USED if column in table.columns}
        if plan.cause:
            columns = injected(columns, plan.cause, plan.values)
        write(folder / f"trial_{k + 1}.csv", text(columns, table.decimals))
    told = {key: dict(entry) for key, entry in ship(source.study).items() if key in TOLD}
    if plan.kind == "basin":
        for parameter, prior in fitted_elsewhere(plan.source, data).items():
            told["parameters"][parameter] = {"value": prior["mean"], "vary": True, "prior": prior}
    write(folder / "study.toml", study_text(name, source, told))
    truth = sealed(plans, name, data)
    write(out / "sealed" / f"{name}.json", json.dumps(truth, indent=1) + "\n")


def sealed(plans: Mapping[str, Plan], name: str, data: Path) -> dict[str, Any]:
    """What is sealed of a case. `control` names the case with the same runs and nothing put in; "" where none is.

    A real model lacks something whatever is put in, so that `effects` are what must be among the causes, not all of
    them.
    """
    plan = plans[name]
    source = SOURCES[plan.source]
    error = ERRORS.get(plan.cause)
    effects = ["wind"] if plan.kind == "wind" else [error.name] if error else []
    alike = [other for other, own in plans.items() if own.source == plan.source and own.kind in ("control", "wind")]
    truth: dict[str, Any] = {
        "case": name,
        "synthetic": False,
        "family": plan.source,
        "ship": source.ship,
        "kind": plan.kind,
        "runs": list(source.runs),
        "day": source.day,
        "effects": effects,
        "causes": [],
        "places": ["surge", "sway", "yaw"] if plan.kind == "wind" else error.place.split(",") if error else [],
        "control": alike[0] if plan.kind == "injected" and alike else "",
        "fitted_to": BASINS[plan.source] if plan.kind == "basin" else "",
    }
    if error:
        cause = {"key": error.key, "name": error.name, "number": error.number, "times_typical": plan.times}
        truth["causes"] = [{**cause, "values": dict(plan.values), "units": dict(error.units)}]
    if plan.kind == "wind":
        winds = {run: anemometer.of_run(run, data) for run in source.runs}
        truth["wind"] = {"runs": winds, "day": anemometer.of_day(list(winds.values()))}
    return truth
