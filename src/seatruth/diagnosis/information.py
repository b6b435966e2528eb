"""What the trials tell of each effect: how clear it is, how like another one, and from which size it would show."""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np

from seatruth.arrays import Array
from seatruth.diagnosis.fit import Fit
from seatruth.diagnosis.hypotheses import Search
from seatruth.diagnosis.marginal_likelihood import Likelihood


class Information:
    """Information on the effects of a finished search: all of them linearized at the best fit, all else integrated out.

    An effect is taken at its values in a fit that holds it, by default its own alone.
    """

    def __init__(self, search: Search) -> None:
        self.search, self.problem = search, search.problem
        self.at = search.leader
        """The fit of highest evidence; parts that are fitted later, for comparison, change nothing here."""

    def noncentrality(self, name: str, fit: Fit | None) -> float:
        """Squared size of an effect's signature, everything else refitted; NaN where it was not fitted."""
        distance = self._distance(name, fit)
        return math.nan if distance is None else float(distance @ self._of(name) @ distance)

    def noncentrality_between(self, name: str, other: str, fit: Fit | None = None) -> float:
        """What is left of an effect's signature when the other one is fitted in its place; inf where it was not."""
        distance = self._distance(name, fit or self.search.best((name,)))
        if distance is None:
            return math.inf
        both, n = self._of(name, other), len(distance)
        held = both[n:, n:] + np.diag(1.0 / self.problem.sd[self.problem.columns[other]] ** 2)
        left = both[:n, :n] - both[:n, n:] @ np.linalg.solve(held, both[n:, :n])
        return float(distance @ left @ distance)

    @cached_property
    def detectable(self) -> dict[str, dict[str, float]]:
        """Smallest magnitude of each effect's parameters that these trials show."""
        found: dict[str, dict[str, float]] = {}
        for name, effect in self.problem.effects.items():
            information = self._of(name)
            found[name] = {}
            for k, q in enumerate(effect.parameters):
                rest = [j for j in range(len(information)) if j != k]
                left = float(information[k, k])
                if rest:
                    block = np.linalg.pinv(information[np.ix_(rest, rest)], hermitian=True)
                    left -= float(information[k, rest] @ block @ information[rest, k])
                found[name][q.name] = self.problem.settings.power / math.sqrt(left) if left > 0.0 else math.inf
        return found

    def undetectable(self) -> list[str]:
        """Effects none of whose magnitudes would show at its typical size."""
        found = []
        for name, limits in self.detectable.items():
            priors = self.problem.effects[name].priors(self.problem.study.model)
            if all(limits[q] > priors[q].sd for q in self.problem.effects[name].magnitudes):
                found.append(name)
        return found

    @cached_property
    def _likelihood(self) -> Likelihood:
        return Likelihood(self.problem, self.problem.linearize(self.at.point, tuple(self.problem.effects)))

    def _of(self, *names: str) -> Array:
        return self._likelihood.information(self.at.sizes, names)[0]

    def _distance(self, name: str, fit: Fit | None) -> Array | None:
        """Fitted parameters of an effect less their prior means; None where it was not fitted."""
        columns = self.problem.columns[name]
        return None if fit is None else fit.point.shared[columns] - self.problem.mean[columns]
