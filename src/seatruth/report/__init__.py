"""The report of an identification: one HTML page that stands alone, and its figures for notebooks.

from seatruth.report import figures, write_report

write_report(estimate, Path("report.html"))
figures.traces(estimate, "zigzag_10_10")
"""

from seatruth.report.plotting_library import import_matplotlib

import_matplotlib()  # before any other module of this package imports it

from seatruth.report.page import render, write_report  # noqa: E402

__all__ = ["render", "write_report"]
