"""A study file: its schema, where its keys stand, what is wrong with it, and how it becomes a study."""

from __future__ import annotations

from seatruth.study.load import Plan, load_study, parse, parsed, read_plan, read_text

__all__ = ["Plan", "load_study", "parse", "parsed", "read_plan", "read_text"]
