"""Third step for the real set: the seal is opened, verdicts are set beside what was put in and what was measured."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from seatruth.errors import BadInput
from withheld.diagnose import MANIFEST
from withheld.records import measures
from withheld.records.left_out import VARIANTS, left_out, relative
from withheld.records.plan import SOURCES
from withheld.score import opened, said
from withheld.seal import digest_file, log, note, write

KEPT = "sealed/left_out"
"""Folder of what the fits without each run gave, which hold the wind: kept, as they take minutes, and as well shut."""


def score(out: Path, data: Path | None) -> dict[str, Any]:
    """Scores every program's verdicts; writes score.json and returns its content for the page.

    `data` is the folder of the real trials, by default the one that the set was made from.
    """
    names = sorted((folder.parent.name for folder in (out / "verdicts").glob(f"*/{MANIFEST}")), key=_first)
    order = [(line["step"], line["what"]) for line in log(out)]
    if ("generate", "end") not in order or not names:
        raise BadInput("nothing was diagnosed", where=str(out), do="Run generate and diagnose first.")
    note(
        out, "score", "begin", {"manifests": {name: digest_file(out / "verdicts" / name / MANIFEST) for name in names}}
    )
    truths = opened(out)
    real = data or Path(json.loads((out / "public" / "seal.json").read_text(encoding="utf-8"))["denied"][0])
    runs = by_run(out, truths, real)
    programs = {name: rows(out, truths, said(out, name)) for name in names}
    for row in programs[names[0]]["wind"]:
        for run in runs:
            if run["case"] == row["case"] and row["estimate"]:
                run["of_day"] = row["estimate"]
                run["off_day"] = measures.difference(row["estimate"], run["measured"])
    table = {
        name: [asdict(one) for one in measures.summary(of["wind"], runs, of["put"], of["calm"])]
        for name, of in programs.items()
    }
    settings = json.loads((out / "sealed" / "_set.json").read_text(encoding="utf-8"))
    content = {
        "synthetic": False, **settings, "programs": table, "rows": programs, "runs": runs,
        "truths": truths, "log": log(out),
    }  # fmt: skip
    write(out / "score.json", json.dumps(content, indent=1) + "\n")
    note(out, "score", "end", {"score": digest_file(out / "score.json")})
    return content


def rows(
    out: Path, truths: Mapping[str, Mapping[str, Any]], verdicts: Mapping[str, Mapping[str, Any]]
) -> dict[str, list[dict[str, Any]]]:
    """The three tables of one program: days on the pond, errors put in, calm basins."""
    found: dict[str, list[dict[str, Any]]] = {"wind": [], "put": [], "calm": []}
    for name, truth in truths.items():
        if name not in verdicts:
            continue
        own = verdicts[name]
        if truth["kind"] == "wind":
            found["wind"].append(measures.of_wind(truth, own))
        elif truth["kind"] == "injected":
            control = verdicts.get(truth["control"])
            found["put"].append(measures.of_injected(truth, own, control))
        else:
            found["calm"].append(measures.of_calm(truth, own))
        found_row = next(of[-1] for of in found.values() if of and of[-1]["case"] == name)
        found_row["failed"] = own.get("failed", "")
    turn = list(SOURCES)
    return {kind: sorted(of, key=lambda row: (turn.index(row["family"]), row["case"])) for kind, of in found.items()}


def by_run(out: Path, truths: Mapping[str, Mapping[str, Any]], data: Path) -> list[dict[str, Any]]:
    """By run of the pond: the measured wind, the one that the other runs give, and what both predict of it."""
    found: list[dict[str, Any]] = []
    for name, truth in truths.items():
        if truth["kind"] != "wind":
            continue
        parts = _left_out(out, name, truth["family"], data)
        ratios: dict[str, Sequence[float]] = {variant: relative(parts, variant) for variant in VARIANTS}
        for k, part in enumerate(parts):
            wind = truth["wind"]["runs"][part["run"]]
            row = {key: part[key] for key in ("run", "errors")}
            row |= {
                "case": name,
                "family": truth["family"],
                "day": truth["day"],
                "measured": wind,
                "of_day": None,
                "off_day": None,
            }
            for whose in ("others", "itself"):
                estimated = part[f"wind_of_{whose}"]
                row |= {f"of_{whose}": estimated, f"off_{whose}": measures.difference(estimated, wind)}
            found.append(row | {"estimated": ratios[VARIANTS[1]][k], "with_measured": ratios[VARIANTS[2]][k]})
    turn = list(SOURCES)
    return sorted(found, key=lambda row: (turn.index(str(row["family"])), str(row["run"])))


def _left_out(out: Path, name: str, source: str, data: Path) -> list[dict[str, Any]]:
    kept = out / KEPT / f"{name}.json"
    if kept.exists():
        found: list[dict[str, Any]] = json.loads(kept.read_text(encoding="utf-8"))
        return found
    print(f"{source}: each run left out of the fits in turn", flush=True)
    parts = left_out(out / "public" / name / "study.toml", source, data)
    kept.parent.mkdir(exist_ok=True)
    write(kept, json.dumps(parts, indent=1) + "\n")
    return parts


def _first(name: str) -> tuple[bool, str]:
    return name != "seatruth", name
