"""The gap between simulator and sea: where it lies, which effect causes it, how far it shrinks, what to try next."""

from __future__ import annotations

from seatruth.diagnosis.pipeline import diagnose
from seatruth.diagnosis.results import Diagnosis
from seatruth.diagnosis.settings import Settings

__all__ = ["Diagnosis", "Settings", "diagnose"]
