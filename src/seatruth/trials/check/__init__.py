"""Checks at the door: what is wrong with the data before any fit.

    for finding in check_trials(trials, model):
        print(finding)

Every threshold stands with its reason in `limits`. Which parameters a log can move is computed elsewhere, from the
model's sensitivities; here the data speak alone.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from seatruth.trials.check.depths import check_depths
from seatruth.trials.check.duplicates import check_columns, check_duplicates
from seatruth.trials.check.excitation import beside_others, check_coverage, check_inputs, check_rate, excitation_table
from seatruth.trials.check.ground_track import check_ground_track
from seatruth.trials.check.headings import check_headings
from seatruth.trials.check.helpers import Channels
from seatruth.trials.check.planes import check_planes
from seatruth.trials.check.positions import check_positions
from seatruth.trials.check.rates import check_common_lags, check_rates
from seatruth.trials.check.sensors import check_sensors
from seatruth.trials.check.steering import check_steering
from seatruth.trials.check.table import check_tables
from seatruth.trials.check.timing import check_missing, check_model_channels, check_time
from seatruth.trials.check.units import check_units
from seatruth.trials.finding import Finding, gravest_first
from seatruth.trials.trial import Trial

__all__ = ["check_tables", "check_trial", "check_trials", "excitation_table"]

_FEWEST = 3
"""Samples below which there is nothing to compare."""


def check_trials(trials: Iterable[Trial], model: Channels | None = None) -> list[Finding]:
    """All findings about trials, gravest first.

    Args:
        trials: the trials.
        model: a model, whose units and required channels are checked as well; or None.

    Returns:
        The findings, each with severity, code, message, where, and what to do.

    Raises:
        Nothing: what is wrong with the data is a finding.

    Example:
        >>> import seatruth.sample
        >>> from seatruth import check_trials
        >>> study = seatruth.sample.load("study.toml")
        >>> [finding for finding in check_trials(study.trials, study.model) if finding.severity == "error"]
        []
    """
    runs = list(trials)
    findings = beside_others([finding for trial in runs for finding in _of_one(trial, model)], runs)
    findings += _in_the_diving_plane(runs, findings, model)
    findings += _in_the_plane(runs, findings)
    with np.errstate(all="ignore"):
        findings = check_common_lags(_sound(runs, findings, "psi", "theta", "phi", "p", "q", "r"), findings)
    findings += check_duplicates(runs)
    findings += check_coverage(runs)
    return gravest_first(findings)


def check_trial(trial: Trial, model: Channels | None = None) -> list[Finding]:
    """The findings about one trial."""
    findings = list(_of_one(trial, model))
    findings += _in_the_diving_plane([trial], findings, model)
    return [*findings, *_in_the_plane([trial], findings)]


def _in_the_diving_plane(trials: Sequence[Trial], known: Sequence[Finding], model: Channels | None) -> list[Finding]:
    """The findings about planes and depths, of all trials together."""
    planes, depths = _sound(trials, known, "theta", "q", "delta_s"), _sound(trials, known, "theta")
    with np.errstate(all="ignore"):
        return [*check_planes(planes, model), *check_depths(depths)]


def _in_the_plane(trials: Sequence[Trial], known: Sequence[Finding]) -> list[Finding]:
    """The findings about headings, of all trials together."""
    with np.errstate(all="ignore"):
        return list(check_headings(_sound(trials, known, "psi", "x", "y", "sog", "cog", "v_n", "v_e")))


def _sound(trials: Sequence[Trial], known: Sequence[Finding], *channels: str) -> list[Trial]:
    """The trials of which nothing is wrong that these channels would only show again."""
    bad_times = {one.trial for one in known if one.code in ("time-order", "time-unit")}
    wrong = {(one.trial, one.channel) for one in known if one.severity == "error" and one.code != "wrapped"}
    return [
        trial
        for trial in trials
        if len(trial) >= _FEWEST
        and trial.name not in bad_times
        and not any((trial.name, channel) in wrong for channel in channels)
    ]


def _of_one(trial: Trial, model: Channels | None) -> Iterator[Finding]:
    if model is not None:
        yield from check_model_channels(trial, model)
    yield from check_missing(trial)
    yield from check_columns(trial)
    in_time = list(check_time(trial))
    yield from in_time
    if any(finding.code == "time-order" for finding in in_time) or len(trial) < _FEWEST:
        return
    with np.errstate(all="ignore"):  # overflow in absurd data is what the checks are there to say in words
        alone = [*check_units(trial, model), *check_rates(trial)]
        yield from alone
        if any(finding.code == "time-unit" for finding in alone):
            return  # every speed and rate below would be blamed for the time
        wrong = {finding.channel for finding in alone if finding.severity == "error" and finding.code != "wrapped"}
        # What is built on a channel that is wrong already would only repeat it in other words.
        if not wrong & {"psi", "r", "delta"}:
            yield from check_steering(trial, model)
        if not wrong & {"psi", "theta", "phi"}:
            yield from check_positions(trial)
        yield from check_ground_track(trial)
        yield from check_sensors(trial, model)
        yield from check_inputs(trial, model)
        yield from check_rate(trial)
