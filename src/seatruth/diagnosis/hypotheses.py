"""Hypotheses, which are sets of effects with and without discrepancy beside them, and what is known of each so far."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TypeVar

import numpy as np

from seatruth.arrays import Array
from seatruth.diagnosis.fit import Fit
from seatruth.diagnosis.problem import Point, Problem
from seatruth.diagnosis.sizes import NoisePrior
from seatruth.storage.checkpoint import Checkpoint

T = TypeVar("T")
Key = tuple[str, ...]
HOPE = 100.0
"""Log-evidence (nats) behind the best by which a set's linearized one may be wrong, or half of the gap. [S]"""


def _silent(key: Key) -> None:
    """Tells nobody."""


@dataclass
class Search:
    """Every fitted hypothesis by its effects, in alphabetical order, and whether discrepancy stands beside them."""

    problem: Problem
    known: NoisePrior
    fits: dict[tuple[Key, bool], Fit] = field(default_factory=dict)
    screened: dict[tuple[Key, bool], float] = field(default_factory=dict)
    """Linearized evidence of sets, whether fitted or not, without and with discrepancy."""
    starts: dict[str, Array] = field(default_factory=dict)
    """Finite values (k, n), the best first, from which an effect is fitted, where they are better than its null."""
    begun: dict[Key, tuple[Key, bool, float]] = field(default_factory=dict)
    """The fit beside which a set was begun: its effects, whether it has discrepancy, and its evidence then."""
    waves: dict[str, Array] = field(default_factory=dict)
    """Values (n,) from which effects of waves begin, where what the model alone leaves shows a narrow band."""
    replaced: dict[tuple[Key, bool, str, str], list[float]] = field(default_factory=dict)
    """Evidence (nats) of the sets in which an effect was begun anew, or another in its place, each time that it was."""
    ended: set[tuple[Key, bool, float]] = field(default_factory=set)
    """Sets, whether with discrepancy, and evidence (nats), of which a fit was taken up again from where it ended."""
    failed: dict[Key, str] = field(default_factory=dict)
    """Hypotheses, or parts of the search in words, that were set aside, with the reason."""
    store: Checkpoint = field(default_factory=lambda: Checkpoint(None, ""))
    """Finished fits and screens, for a run that goes on."""
    rival: float = -math.inf
    """Evidence that a fit has to come near; it changes between fits that run at once, never beside them."""
    may_cut: bool = False
    """Whether its trials can be cut into sections where whole ones cannot be fitted."""
    bare: bool = False
    """Whether sets are fitted without discrepancy only: forces of a black box cost many runs, see `forces_beside`."""
    tell: Callable[[Key], None] = _silent
    """Told each set before it is fitted, in a stage that nobody knows the end of."""
    interrupted: bool = False
    spent: bool = False
    """Whether it was the budget of evaluations that ended it."""

    @property
    def scope(self) -> str:
        """The effects that take part, as what is stored goes by: how many, and whose priors are wider."""
        wider = self.problem.settings.wider
        return f"{len(self.problem.effects)} effects{f', wider {wider}' if wider else ''}"

    @property
    def null(self) -> Fit:
        """The model alone, as it fits best."""
        return max((f for (key, _), f in self.fits.items() if not key), key=lambda f: f.evidence)

    @property
    def leader(self) -> Fit:
        """The fit of highest evidence."""
        return min(self.fits.values(), key=_rank)

    def best(self, effects: Collection[str]) -> Fit | None:
        """The better of a set's fits, with or without discrepancy; None where neither was fitted."""
        key = tuple(sorted(effects))
        fits = [self.fits[key, on] for on in (False, True) if (key, on) in self.fits]
        return max(fits, key=lambda fit: fit.evidence) if fits else None

    def beside(self, effects: Sequence[str], others: Key) -> Fit | None:
        """The fit that speaks for a set: beside those of `others` with which it explains most; None if it has no fit.

        Of an AUV that dives, whose damping has another form, a pitch bias of 2 deg was 1.1 +- 0.4 deg in the fit
        without the term that takes the place of that form, about which trials disagreed, and 1.9 in the one with it. Of
        a boat in a short sea the drift of its waves was 90 deg off in the fit without their first-order forces.
        """
        some = itertools.chain.from_iterable(itertools.combinations(others, n) for n in range(len(others) + 1))
        found = [fit for one in some if (fit := self.best({*effects, *one})) is not None]
        return max(found, key=lambda fit: fit.evidence, default=None)

    def sets(self) -> list[Fit]:
        """The better fit of each set, the one of highest evidence first."""
        found: dict[Key, Fit] = {}
        for fit in sorted(self.fits.values(), key=_rank):
            found.setdefault(fit.effects, fit)
        return list(found.values())

    def evidence(self, key: Key) -> float:
        """Evidence of a set: of its fits, and linearized where one is missing; -inf where nothing is known."""
        return max(
            self.fits[key, on].evidence if (key, on) in self.fits else self.screened.get((key, on), -math.inf)
            for on in (False, True)
        )

    def expected(self, key: Key) -> float:
        """Linearized evidence of a set."""
        return max(self.screened.get((key, on), -math.inf) for on in (False, True))

    def explaining(self, count: int) -> list[str]:
        """Effects that bring most to the model without forces, among those that were fitted so: `count` at most.

        Beside forces an effect without a slope at its null looks like nothing: of a craft with two thrusters in wind,
        with forces, the drift of waves stood first, and the wind, which explained 1400 nats more without, was not
        fitted.
        """
        plain = self.fits.get(((), False))
        if plain is None:
            return []
        alone = [fit for (key, on), fit in self.fits.items() if len(key) == 1 and not on]
        alone = [fit for fit in alone if fit.evidence > plain.evidence + HOPE]
        return [fit.effects[0] for fit in sorted(alone, key=_rank)[:count]]

    def known_end(self, key: Key, discrepancy: bool) -> Callable[[Point], bool] | None:
        """Where a further fit of a set is broken off: at the optimum of the fit that it has, if it has one."""
        fit = self.fits.get((key, discrepancy))
        return None if fit is None else partial(fit.leads_here, self.problem)

    def or_set_aside(self, what: str, stage: Callable[[], T], otherwise: T) -> T:
        """What a stage gives; where its algebra fails it is named among what was set aside, and all fits stay."""
        try:
            return stage()
        except np.linalg.LinAlgError as trouble:
            self.failed.setdefault((what,), str(trouble))
            return otherwise

    def hopeful(self, key: Key) -> bool:
        """Whether a set's fit could come near the rival: its linearized evidence may be wrong by half of the gap.

        What could not keeps its share by its linearized evidence, far below any probability that is shown.
        """
        margin = max(HOPE, (self.rival - self.null.evidence) / 2.0)
        return self.evidence(key) > self.rival - margin


def strays(found: Search) -> bool:
    """Whether runs of the model alone are so far from their records that forces must hold them."""
    plain = found.fits.get(((), False))
    return plain is not None and bool(plain.evidence < found.null.evidence - HOPE)


def comparable(found: Search) -> bool:
    """Whether a fit near the leader came to its end: sets are told apart by fits that did."""
    near = found.leader.evidence - found.problem.settings.hopeless
    return any(fit.settled for fit in found.fits.values() if fit.evidence > near)


def _rank(fit: Fit) -> tuple[float, Key, bool]:
    """Order of fits: the highest evidence first, then by name, without discrepancy first."""
    return -fit.evidence, fit.effects, fit.discrepancy
