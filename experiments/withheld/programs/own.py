"""The library's diagnosis."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from seatruth import load_study
from seatruth.gap import diagnose


def diagnosed(study: Path) -> dict[str, Any]:
    """What `seatruth diagnose` says of a study, in the form that is scored."""
    return dict(diagnose(load_study(study)).as_verdict(study.parent.name))
