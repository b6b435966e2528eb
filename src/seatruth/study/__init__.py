"""A study: what a study file says, and how the file becomes one object."""

from __future__ import annotations

from seatruth.study.load import load_study, parse, parsed, read_text, study_from
from seatruth.study.study import OutputSettings, Study
from seatruth.study.table import formula_study, table_trial

__all__ = [
    "OutputSettings",
    "Study",
    "formula_study",
    "load_study",
    "parse",
    "parsed",
    "read_text",
    "study_from",
    "table_trial",
]
