"""Trials in sections, for a vehicle whose whole runs no fit follows.

Of a course-unstable boat that nothing holds, errors grow along a run. Over minutes its motion bends so strongly with
each coefficient that steps towards a fit become tiny (`steps.py`), and what stops short says nothing of any cause. Cut
into sections, each with initial states of its own, the same record is followed easily: that is multiple shooting (Bock
and Plitt 1984, IFAC Proceedings 17(2), 1603-1608) without its conditions that sections meet, which leave little where
the states are measured. What is lost is what only the ends of long runs show, such as a drift far below the noise.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from seatruth.costs.growth import FEWEST
from seatruth.diagnosis.settings import Settings
from seatruth.models.base import SECTION, whole_name
from seatruth.trials.finding import Finding
from seatruth.trials.trial import Trial

MOST = 8
"""Sections of the longest trial at most. [S] Of a catamaran whose runs of 120 to 200 s could not be fitted, every fit
came to its end in sections of 25 s, and half of them in sections of 50 s."""
_USUAL = 50
"""Samples of such a section at least. [S] Initial states and forces take some twenty unknowns of each."""

_LEAST_KNOTS = 3
"""Knots of a section's forces at least: with two a force could not rise and fall again. [S]"""


class RunsBend(Exception):
    """Runs bend so much with the unknowns that the model alone, with forces, could not be fitted to its end."""


def in_sections(trials: Sequence[Trial], settings: Settings) -> list[Trial]:
    """Trials cut into sections of about the same time, so many of the longest; their times go on.

    Example:
        >>> import numpy as np
        >>> from seatruth import Trial
        >>> t = np.arange(101.0)
        >>> runs = [Trial("turn", t, {}, {"r": t}), Trial("stop", t[:51], {}, {"r": t[:51]})]
        >>> [(part.name, len(part), float(part.t[0])) for part in in_sections(runs, Settings(sections=2))]
        [('turn §1', 50, 0.0), ('turn §2', 51, 50.0), ('stop', 51, 0.0)]
    """
    if settings.sections == 1:
        return list(trials)
    length = max(trial.duration for trial in trials) / settings.sections
    found: list[Trial] = []
    for trial in trials:
        count = max(1, min(round(trial.duration / length), len(trial) // FEWEST))
        ends = [round(k * len(trial) / count) for k in range(count + 1)]
        names = [trial.name] if count == 1 else [f"{trial.name}{SECTION}{k + 1}" for k in range(count)]
        found += [trial.section(ends[k], ends[k + 1], name) for k, name in enumerate(names)]
    return found


def knots_of_section(knots: int, sections: int) -> int:
    """Knots of the forces of one section, about as far apart as so many over the whole trial: 3 or more.

    Example:
        >>> knots_of_section(12, 8), knots_of_section(45, 8)
        (3, 6)
    """
    return max(_LEAST_KNOTS, 1 + (knots - 1) // sections)


def left_out_together(trials: Sequence[Trial]) -> list[list[int]]:
    """Places of the trials, or sections, that are predicted from the others together: sections of one trial.

    Of a single trial each section stands alone.

    Example:
        >>> import numpy as np
        >>> from seatruth import Trial
        >>> t = np.arange(101.0)
        >>> runs = [Trial("turn", t, {}, {"r": t}), Trial("stop", t[:51], {}, {"r": t[:51]})]
        >>> left_out_together(in_sections(runs, Settings(sections=2)))
        [[0, 1], [2]]
    """
    groups: dict[str, list[int]] = {}
    for number, trial in enumerate(trials):
        groups.setdefault(whole_name(trial.name), []).append(number)
    return list(groups.values()) if len(groups) > 1 else [[number] for number in range(len(trials))]


def most_sections(trials: Sequence[Trial]) -> int:
    """Sections into which the longest of these trials, whole, is cut at most; 1 where none is long enough."""
    return min(MOST, max(len(trial) for trial in trials) // _USUAL) or 1


def finding(trials: Sequence[Trial], sections: int) -> Finding:
    """What is said of trials that were cut into sections, of these."""
    seconds = max(trial.duration for trial in trials) / sections
    text = (
        "A small change of a coefficient or of the first motion turns a long run into another one, so that no fit "
        f"follows whole trials. They were cut into sections of about {seconds:.2g} s with initial states of their "
        "own. What only the ends of long runs show, such as a slow drift, is lost. Errors are those of the sections."
    )
    do = (
        "This is usual for a vehicle whose course a pilot or an autopilot holds, as most ROVs. Where coefficients are "
        "far off, better ones (`seatruth identify`) may follow whole trials."
    )
    return Finding("warning", "trials-in-sections", text, "trials", do)


def recorded(trials: Iterable[Trial], settings: Settings) -> list[dict[str, Any]]:
    """The trials in words and numbers; where they are in sections, those of one together."""
    found: dict[str, dict[str, Any]] = {}
    for trial in trials:
        name = whole_name(trial.name) if settings.sections > 1 else trial.name
        known = found.setdefault(
            name,
            {
                "name": name,
                "samples": 0,
                "duration_s": 0.0,
                "conditions": dict(trial.conditions),
                "steps": [{"name": step.name, "effect": step.effect} for step in trial.steps],
            },
        )
        known["samples"] += len(trial)
        known["duration_s"] += trial.duration
    return list(found.values())
