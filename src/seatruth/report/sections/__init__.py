"""The sections of the report, in the order in which an engineer reads them."""

from __future__ import annotations

from collections.abc import Callable

from seatruth.report.blocks import Section
from seatruth.report.sections import parameters, posterior, run, starts, tables, trials
from seatruth.report.sections.pictures import Album
from seatruth.report.view import View

ORDER: tuple[Callable[[View, Album], Section | None], ...] = (
    run.summary,
    parameters.estimates,
    parameters.combinations,
    parameters.correlation,
    parameters.sensitivity,
    trials.fit,
    tables.rows,
    trials.histories,
    trials.tracks,
    trials.residuals,
    trials.held_out,
    trials.cross_validation,
    parameters.profiles,
    posterior.posterior,
    run.search,
    starts.starts,
    run.discretisation,
    run.steps,
    run.findings,
    run.provenance,
)


def sections(data: View) -> list[Section]:
    """Those that have something to say."""
    album = Album()
    return [section for build in ORDER if (section := build(data, album)) is not None]
