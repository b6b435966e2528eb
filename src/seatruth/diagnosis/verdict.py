"""What a diagnosis says, and the effects and hypotheses that this rests on.

The classes below are part of the layout of `diagnosis.json`; see `results.py` for units.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

UNKNOWN = "unknown"
"""Stands among effects for a cause that is not in the library."""

Kind = Literal["effects", "inseparable", "no_gap", "underpowered", "unknown"]


@dataclass(frozen=True)
class EffectParameter:
    """One parameter of an effect as the trials give it, with its 95 % interval."""

    name: str
    """Of the parameter, as the effect names it."""
    unit: str
    """Its unit."""
    value: float
    """Fitted together with the verdict's effects, or in the most probable set that holds it."""
    stderr: float
    """Standard error; coefficients, initial states, noise and discrepancy are marginalised."""
    lower: float
    """Lower end of the 95 % interval."""
    upper: float
    """Upper end of it."""
    null: float
    """Value at which the effect vanishes."""
    prior_sd: float
    """Standard deviation of what is believed of it before the trials."""
    systematic_error: float = 0.0
    """Part of the standard error that no trial reduces, in the same direction for all magnitudes of the effect."""


@dataclass(frozen=True)
class EffectResult:
    """One effect of the library: how probable, how large, and what it can be confused with."""

    name: str
    """As study files and `--effects` name it."""
    title: str
    """In words."""
    cause: str
    """Its node in the tree of causes, "environment.force_fixed_to_earth.wind"."""
    acts_on: tuple[str, ...]
    """Equations ("surge"), "kinematics", "actuator:INPUT", "sensor:OUTPUT"."""
    equation: str
    """As text."""
    probability: float
    """Posterior inclusion probability: that it acts, alone or with others."""
    log_evidence: float
    """Of the effect alone over the model without effects; linearized where it was not fitted."""
    noncentrality: float
    """Lambda: squared size of its signature in standard deviations, once all else is refitted; NaN if unfitted."""
    parameters: tuple[EffectParameter, ...]
    """Empty where it was not fitted."""
    in_words: str
    """Size and direction in words, where it has a direction."""
    detectable: Mapping[str, float]
    """Smallest magnitude of each parameter that these trials show with power 0.8 in a test at 0.05."""
    typical: Mapping[str, float]
    """Typical distance of each magnitude from its null on such a vehicle; shape parameters have none."""
    units: Mapping[str, str]
    """Unit of each parameter."""
    confusable: Mapping[str, float]
    """Pairwise noncentrality to effects that it is easily taken for."""
    equivalent: tuple[str, ...]
    """Effects and parameters from which no trial can tell it."""
    share: float
    """Part of the gap (misfit above noise after the refit) that it closes; NaN where it is not in the verdict."""
    predictive_gain: float
    """Log predictive density of the trials, each given others, with it less without it (nats); NaN where not asked."""
    predictive_gain_lower: float
    """One-sided 95 % bound of the same: an effect is named only where this is positive, or where the refitted model
    meets its noise and the gain is clear without its best trial."""
    prior_deviations: float
    """Largest distance of a parameter from its null in prior standard deviations."""


@dataclass(frozen=True)
class Hypothesis:
    """A set of effects, with or without model discrepancy beside it."""

    effects: tuple[str, ...]
    """Names of its effects."""
    discrepancy: bool
    """Whether model discrepancy acts beside them."""
    log_evidence: float
    """Laplace approximation of the log marginal likelihood, over that of the model without effects, with
    discrepancy or without, whichever explains more."""
    log_prior: float
    """Logarithm of its prior probability."""
    probability: float
    """Posterior probability; all hypotheses sum to 1."""
    settled: bool
    """Whether its fit converged."""
    fitted: bool = True
    """Whether it was fitted: if not, its log evidence is that of a linearization."""
    like: tuple[str, ...] = ()
    """Terms whose fit stands for its discrepancy: damping of another form than the model's, which shows the same."""


@dataclass(frozen=True)
class NamedCause:
    """One cause at the finest level that reaches its probability."""

    cause: str
    """Node of the tree of causes."""
    title: str
    """The node in words."""
    effects: tuple[str, ...]
    """The effects that these trials cannot tell apart, first the one that stands for it in what is simulated, then the
    most probable; one where the cause is an effect."""
    probability: float
    """Of the cause at this level."""
    in_words: str
    """Size with its uncertainty, of the first effect."""
    share: float
    """Part of the gap that it closes; of what is explained of the trials where runs stray (`of_evidence`)."""
    small: bool
    """Probable, but a negligible part of the gap."""
    implausible: bool
    """Its size is beyond what is believed of the vehicle: it looks like this cause, it need not be it."""
    beyond: str = ""
    """What of it is: "size", or a parameter that says how well its form is known: "ln x ratio of 2.1"; empty where
    nothing is."""
    direction: str = ""
    """On the earth, that several effects have in common: "303 +- 15 deg"; empty for one effect, or where none has."""
    sizes: tuple[str, ...] = ()
    """Size of each effect in words, were it the one that acts; empty for one that was not fitted in the others'
    place."""
    of_evidence: bool = False
    """Whether `share` is that of the evidence, and not about that of the misfit: runs that stray from their records
    have no misfit that tells anything."""
    over_typical: float = math.nan
    """Size over a typical one of such a vehicle, of the effect of which it is largest: far below 1 all are small for
    what they are."""


def least_probable(causes: Sequence[NamedCause], otherwise: float) -> float:
    """Probability that all causes of practical size act, of the least probable; `otherwise` where there is none.

    What is said to be a negligible part of the gap makes the others no less sure.
    """
    return min((cause.probability for cause in causes if not cause.small), default=otherwise)


@dataclass(frozen=True)
class Verdict:
    """What is said, no surer than its weakest assumption."""

    kind: Kind
    """ "effects": each cause is one effect; "inseparable": some cause is a set of effects that look alike; "no_gap";
    "underpowered": these trials cannot decide; "unknown": something acts that is not in the library."""
    causes: tuple[NamedCause, ...]
    """What is named, the largest share of the gap first."""
    probability: float
    """Of the verdict."""
    discrepancy: bool
    """Whether the model also lacks something that no effect describes."""
    places: tuple[str, ...]
    """Where the causes act."""
    sentence: str
    """The headline."""
    possible: tuple[str, ...] = ()
    """Where something acts, and these trials cannot decide what: the effects that it looks like; empty where that
    cannot be said either."""

    @property
    def effects(self) -> tuple[str, ...]:
        """The most probable effect of each named cause."""
        return tuple(cause.effects[0] for cause in self.causes)

    @property
    def members(self) -> tuple[str, ...]:
        """All effects of causes that are sets."""
        return tuple(name for cause in self.causes if len(cause.effects) > 1 for name in cause.effects)


def answer(effects: tuple[str, ...]) -> str:
    """A set of effects in words."""
    if not effects:
        return "no effect"
    return "a cause that is not in the library" if effects == (UNKNOWN,) else " and ".join(effects)
