"""The library's diagnosis."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from seatruth import load_study
from seatruth.diagnosis import Diagnosis, diagnose


def diagnosed(study: Path) -> dict[str, Any]:
    """What `seatruth diagnose` says of a study, in the form that is scored, with every hypothesis that it compared.

    Of real records it also says what it thinks of every effect, named or not, and nothing of a next trial, which nobody
    can sail any more.
    """
    loaded = load_study(study)
    found = diagnose(loaded, suggest=loaded.synthetic)
    said = dict(found.as_verdict(study.parent.name))
    said["hypotheses"] = [
        {
            "effects": list(one.effects), "discrepancy": one.discrepancy, "log_evidence": one.log_evidence,
            "log_prior": one.log_prior,
        }
        for one in found.hypotheses
    ]  # fmt: skip
    said["seconds"] = found.outcome["wall_s"]
    return said if loaded.synthetic else {**said, **_of_every_effect(found)}


def _of_every_effect(found: Diagnosis) -> dict[str, Any]:
    return {
        "which": [
            {
                "name": one.name, "probability": one.probability, "log_evidence": one.log_evidence,
                "lambda": one.noncentrality, "in_words": one.in_words,
                "parameters": [{"name": q.name, "value": q.value, "stderr": q.stderr} for q in one.parameters],
            }
            for one in found.effects
        ],
        "noise": {one.channel: one.white for one in found.noise},
        "folds": [] if found.validation is None else [vars(fold) for fold in found.validation.folds],
    }  # fmt: skip
