"""The report of a diagnosis: its sections, its figures, and the words that the terminal shares with them."""

from seatruth.report.diagnosis.sections import diagnosis_facts, diagnosis_sections

__all__ = ["diagnosis_facts", "diagnosis_sections"]
