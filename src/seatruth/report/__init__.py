"""The report of an identification: one HTML page that stands alone, and its figures for notebooks.

from seatruth.report import figures, write_report

write_report(estimate, Path("report.html"))
figures.traces(estimate, "zigzag_10_10")
"""

from seatruth.report.page import render, write_report

__all__ = ["render", "write_report"]
