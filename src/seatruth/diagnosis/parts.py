"""Parts of a diagnosis beside its verdict: noise, shares, coefficients, what is missing, validation, the next trial.

The classes below are part of the layout of `diagnosis.json`; see `results.py` for units.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class ChannelNoise:
    """Measurement noise of one channel: white, and slow (Ornstein-Uhlenbeck)."""

    channel: str
    """An output."""
    unit: str
    """Its unit."""
    white: float
    """Standard deviation."""
    slow: float
    """Standard deviation; 0 where there is none."""
    tau: float
    """s, correlation time of the slow part."""
    declared: float
    """White standard deviation that the study states; NaN where it states none."""
    samples: int
    """Of all trials together."""


@dataclass(frozen=True)
class Shares:
    """The misfit of the model as it was declared, split; the parts sum to 1."""

    noise: float
    """Measurement noise."""
    parameters: float
    """Removed by refitting coefficients."""
    effects: float
    """Removed by the verdict's effects."""
    left: float
    """What nothing explains."""
    misfit_before: float
    """Mean squared error in multiples of the noise variance, before the refit."""
    misfit_refit: float
    """The same after the refit."""
    misfit_effects: float
    """The same with the verdict's effects."""


@dataclass(frozen=True)
class MissingForce:
    """The missing acceleration of one equation in one trial: the discrepancy as a function of time."""

    trial: str
    """A trial."""
    equation: str
    """An equation of motion."""
    t: tuple[float, ...]
    """s."""
    value: tuple[float, ...]
    """Missing acceleration."""
    stderr: tuple[float, ...]
    """Its standard error."""
    unit: str
    """Of the acceleration."""


@dataclass(frozen=True)
class MissingTerm:
    """One term of the formula of what is missing in an equation: coefficient times a function of motion and inputs."""

    equation: str
    """The equation to which it is added."""
    term: str
    """Function of motion and inputs in the units of the model's channels; 1 for a constant."""
    coefficient: float
    """Acceleration where the function is 1."""
    stderr: float
    """Its standard error."""
    unit: str
    """Of the acceleration."""


@dataclass(frozen=True)
class Discrepancy:
    """What the model's structure lacks, beside the verdict's effects."""

    sizes: Mapping[str, float]
    """By equation: size of the missing acceleration as a part of the usual one."""
    forces: tuple[MissingForce, ...]
    """The missing acceleration over time, by trial and equation."""
    terms: tuple[MissingTerm, ...]
    """The terms that stand out, the clearest first."""
    log_evidence: float
    """Of discrepancy beside the verdict's effects, over none."""


@dataclass(frozen=True)
class Fold:
    """One trial predicted from the others.

    Errors are root mean square, in standard deviations of the noise, of what the others determine of the trial.
    """

    trial: str
    """The trial left out."""
    effects: tuple[str, ...]
    """Effects that the other trials alone select among the leading hypotheses."""
    error_refit: float
    """Coefficients refitted to the other trials, no effect."""
    error_effects: float
    """The effects of the verdict as well, refitted to the other trials."""
    error_discrepancy: float
    """Control: discrepancy terms refitted to the other trials instead of effects."""
    error_both: float
    """Discrepancy terms and the effects of the verdict refitted to the other trials; NaN where they were not."""
    error_noise: float
    """What the best fit to all trials leaves of this one: noise."""
    left_open: float
    """What the others leave open about the trial, as a root mean square in standard deviations of the noise."""
    predictive_gain: float
    """Log predictive density, given others, with the effects less without (nats)."""


@dataclass(frozen=True)
class Validation:
    """Leave-one-trial-out cross-validation of the named effects."""

    folds: tuple[Fold, ...]
    """One per trial."""
    gap_explained: float
    """(refit - effects) / (refit - noise) of the mean errors of trials left out; NaN where there is no gap."""
    lower: float
    """Lower end of its 95 % interval over trials; infinite where the trials do not bound it."""
    upper: float
    """Upper end of it."""
    control: float
    """The same for the control."""
    own_sizes: bool = False
    """Whether an effect has a size of its own in each trial, which is fitted to the trial that is left out."""


@dataclass(frozen=True)
class MenuEntry:
    """One candidate trial."""

    manoeuvre: str
    """Its name."""
    text: str
    """What the crew does."""
    noncentrality: float
    """Noncentrality of the most probable cause to the nearest other one, with this trial added."""
    gain: float
    """Factor by which that of the true cause grows, in the mean over the causes by probability; clipped at 8."""
    weakest: tuple[str, ...]
    """The most probable cause and the nearest other one."""


@dataclass(frozen=True)
class NextTrial:
    """The trial that best separates the causes that are left; `manoeuvre` is empty where none of the menu helps."""

    manoeuvre: str
    """Name of the suggested trial."""
    text: str
    """What the crew does."""
    survivors: tuple[str, ...]
    """Causes that it is to separate: effects, or "unknown"."""
    noncentrality_now: float
    """Noncentrality of the most probable of them to the nearest other one on the recorded trials."""
    noncentrality_then: float
    """The same with the suggested trial added."""
    gain: float
    """Factor by which that of the true cause grows, in the mean over the causes by probability; clipped at 8."""
    menu: tuple[MenuEntry, ...]
    """All candidates, the best first."""
    t: tuple[float, ...]
    """s."""
    inputs: Mapping[str, tuple[float, ...]]
    """Inputs to apply over `t`."""
    motion: Mapping[str, tuple[float, ...]]
    """Expected outputs over `t`."""
    units: Mapping[str, str]
    """Unit of each input and output."""
