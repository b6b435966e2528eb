"""The library's diagnosis."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from seatruth import load_study
from seatruth.diagnosis import Diagnosis, diagnose

OF_CAUSE = ("name", "probability", "log_evidence", "lambda", "in_words", "parameters")


def diagnosed(study: Path) -> dict[str, Any]:
    """What `seatruth diagnose` says of a study, in the form that is scored.

    Of real records it also says what it thinks of every effect, named or not, and nothing of a next trial, which nobody
    can sail any more.
    """
    loaded = load_study(study)
    found = diagnose(loaded, suggest=loaded.synthetic)
    said = dict(found.as_verdict(study.parent.name))
    return said if loaded.synthetic else {**said, **_of_every_effect(found)}


def _of_every_effect(found: Diagnosis) -> dict[str, Any]:
    return {
        "which": [{key: row[key] for key in OF_CAUSE} for row in found.which],
        "shares": found.shares,
        "noise": {row["channel"]: row["sd"] for row in found.noise},
        "folds": (found.how_far or {}).get("folds", []),
        "seconds": found.outcome["wall_s"],
    }
