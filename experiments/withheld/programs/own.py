"""The library's diagnosis."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from seatruth import load_study
from seatruth.diagnosis import Diagnosis, diagnose

OF_HYPOTHESIS = ("effects", "discrepancy", "like", "log_evidence", "log_prior")
"""Fields of each hypothesis, from which constants are calibrated."""
OF_DECISION = (
    *("temperature", "model_form", "form_beside"),
    *("prior_none", "prior_unknown", "prior_sets", "prior_discrepancy"),
)
"""Settings that log-priors and probabilities rest on."""
OF_EFFECT = ("name", "probability", "log_evidence", "noncentrality", "in_words", "parameters")
"""Fields of each effect's result that are kept for real records."""


def diagnosed(study: Path) -> dict[str, Any]:
    """What `seatruth diagnose` says of a study, in the form that is scored, with every hypothesis that it compared.

    Of real records it also says what it thinks of every effect, named or not, and nothing of a next trial, which nobody
    can sail any more.
    """
    loaded = load_study(study)
    found = diagnose(loaded, suggest=loaded.synthetic)
    said = dict(found.as_verdict(study.parent.name))
    said["hypotheses"] = [
        {name: getattr(one, name) for name in OF_HYPOTHESIS} | {"effects": list(one.effects), "like": list(one.like)}
        for one in found.hypotheses
    ]
    said["settings"] = {name: found.outcome["settings"][name] for name in OF_DECISION}
    return said if loaded.synthetic else {**said, **_of_every_effect(found)}


def _of_every_effect(found: Diagnosis) -> dict[str, Any]:
    content = found.content()
    return {
        "which": [{key: row[key] for key in OF_EFFECT} for row in content["effects"]],
        "shares": content["shares"],
        "noise": {channel.channel: math.hypot(channel.white, channel.slow) for channel in found.noise},
        "folds": content["validation"]["folds"] if content["validation"] is not None else [],
        "seconds": found.outcome["wall_s"],
    }
