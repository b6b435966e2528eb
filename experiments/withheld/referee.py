"""The independent referee: how much of a cause these trials show, beyond noise and what a refit can absorb.

All signatures are differences of this benchmark's own simulations under the recorded inputs. They are whitened by
the true noise (white and coloured, channel by channel), freed of what the first state of each trial can explain, and
marginalised over the coefficients under their priors. lambda is the squared norm of what is left: the non-centrality
of the best test of that cause.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve_triangular

from withheld.reality.families import Family
from withheld.reality.mechanism import Mechanism
from withheld.reality.motion import Array
from withheld.reality.sensors import Noise
from withheld.reality.simulate import Lane, Present, Record, replay

PRIOR = 0.15
"""Standard deviation of the priors that the study hands out, relative to the nominal value."""
STEP = 1e-3
"""Of the differences by a coefficient, in standard deviations of its prior; small against the motion's curvature."""
TELLS_APART = 9.0
"""Pairwise lambda below which two causes count as not to be told apart (three standard deviations)."""


@dataclass(frozen=True)
class Signatures:
    """Whitened signatures of each trial, first states projected out: a list of (rows, K).

    Columns: the coefficients in units of their prior's standard deviation, then those of `labels`.
    """

    coefficients: int
    labels: list[str]
    whitened: list[Array]

    @functools.cached_property
    def grams(self) -> Array:
        """(trials, K, K)."""
        return np.stack([w.T @ w for w in self.whitened])

    def columns(self, label: str) -> list[int]:
        """Columns of a label, counted after the coefficients."""
        return [k for k, name in enumerate(self.labels) if name == label]

    def projected(self, trials: Sequence[int] | None = None) -> Array:
        """Gram matrix of the labelled columns after the coefficients are marginalised; over all trials or some."""
        total = self.grams.sum(axis=0) if trials is None else self.grams[list(trials)].sum(axis=0)
        return marginal(total, self.coefficients)


def marginal(gram: Array, coefficients: int) -> Array:
    """Schur complement on the coefficients, whose priors have unit variance."""
    a = gram[:coefficients, :coefficients] + np.eye(coefficients)
    b = gram[:coefficients, coefficients:]
    return np.asarray(gram[coefficients:, coefficients:] - b.T @ cho_solve(cho_factor(a), b))


def left_over(gram: Array, column: int, others: Sequence[int]) -> float:
    """Squared norm of a column after the best combination of others."""
    if not others:
        return float(gram[column, column])
    rest = gram[np.ix_(others, others)]
    cross = gram[others, column]
    scale = np.sqrt(np.maximum(np.diag(rest), 1e-300))
    solved = np.linalg.lstsq(rest / np.outer(scale, scale), cross / scale, rcond=1e-10)[0]
    return max(0.0, float(gram[column, column] - (cross / scale) @ solved))


@functools.lru_cache(maxsize=256)
def whitener(noise: Noise, n: int, dt: float) -> Array:
    """Lower Cholesky factor of the noise's covariance."""
    return np.asarray(np.linalg.cholesky(noise.covariance(n, dt)))


def signatures(
    family: Family,
    records: Sequence[Record],
    coefficients: Mapping[str, float],
    noise: Mapping[str, Noise],
    variants: Sequence[tuple[str, Sequence[Present]]],
) -> Signatures:
    """Signatures of the coefficients and of `variants` (label, what acts) on these trials."""
    sd = {name: PRIOR * abs(value) for name, value in family.coefficients.items()}
    still = (0.0,) * 6
    kinds: list[tuple[Mapping[str, float], Sequence[Present], tuple[float, ...]]] = [(coefficients, (), still)]
    kinds += [({**coefficients, name: coefficients[name] + STEP * sd[name]}, (), still) for name in sd]
    firsts = np.diag([0.01 * family.noise[name] for name in family.outputs])
    kinds += [(coefficients, (), tuple(row)) for row in firsts.tolist()]
    kinds += [(coefficients, acting, still) for _, acting in variants]
    lanes = [Lane(k, kind[0], kind[1], kind[2]) for kind in kinds for k in range(len(records))]
    y = replay(family, records, lanes).reshape(-1, 6, len(kinds), len(records))
    # What acts may carry the vehicle along from the start: the first state of such a lane is the recorded one.
    whitened = []
    for k, record in enumerate(records):
        n = len(record.t)
        change = y[:n, :, 1:, k] - y[:n, :, :1, k]
        parts = [
            solve_triangular(whitener(noise[name], n, family.dt), change[:, j], lower=True)
            for j, name in enumerate(family.outputs)
        ]
        stack = np.concatenate(parts)
        size = len(sd)
        stack[:, :size] /= STEP
        start, rest = stack[:, size : size + 6], np.delete(stack, np.s_[size : size + 6], axis=1)
        q, _ = np.linalg.qr(start / np.linalg.norm(start, axis=0))
        whitened.append(rest - q @ (q.T @ rest))
    return Signatures(len(sd), [label for label, _ in variants], whitened)


def spans(mechanisms: Sequence[Mechanism]) -> list[tuple[str, list[Present]]]:
    """The variants that stand for every mechanism of a catalogue."""
    return [(one.key, [Present(one, dict(values))]) for one in mechanisms for values in one.spans]


def pairwise(found: Signatures, gram: Array, column: int, names: Sequence[str]) -> dict[str, float]:
    """lambda that is left of a column after each of some mechanisms has taken what it can."""
    return {name: left_over(gram, column, found.columns(name)) for name in names}


def oracle_closure(found: Signatures, truth: Sequence[int], offset: Array, trials: int) -> dict[str, float]:
    """Closure that one who knows the cause reaches on trials left out, one after the other.

    E is the mean square of a left-out trial's whitened residual, its own first state fitted. Refit: coefficients alone
    are fitted to the other trials. With effect: the cause's own signature too, its size free. Floor: the truth.
    `offset` is the truth less the prior's mean in units of the prior's standard deviation. Expected values over the
    noise, on the linearised model. Returns E of each, in excess of the floor, and the closure.
    """
    size, n_rows = found.coefficients, sum(len(w) for w in found.whitened)
    cause = [size + k for k in truth]
    total = found.grams.sum(axis=0)
    refit = with_effect = 0.0
    for k in range(trials):
        train, test = total - found.grams[k], found.grams[k]
        for use, columns in (("refit", list(range(size))), ("effect", list(range(size)) + cause)):
            a = train[np.ix_(columns, columns)].copy()
            a[:size, :size] += np.eye(size)
            pull = np.zeros(len(columns))
            pull[:size] = -offset
            # Truth in these columns is zero for coefficients (we stand at the true ones) and one for the cause.
            if use == "refit":
                pull = pull + train[np.ix_(columns, cause)].sum(axis=1)
            solved = np.linalg.lstsq(a, pull, rcond=1e-12)[0]
            covariance = (
                np.linalg.pinv(a, rcond=1e-12) @ train[np.ix_(columns, columns)] @ np.linalg.pinv(a, rcond=1e-12)
            )
            inner = test[np.ix_(columns, columns)]
            spread = float(np.trace(inner @ covariance))
            miss = float(solved @ inner @ solved)
            if use == "refit":
                lump = float(test[np.ix_(cause, cause)].sum())
                cross = float(solved @ test[np.ix_(columns, cause)].sum(axis=1))
                refit += lump - 2 * cross + miss + spread
            else:
                with_effect += miss + spread
    closure = (refit - with_effect) / refit if refit > 0 else 0.0
    return {"floor": 1.0, "refit": 1 + refit / n_rows, "with_effect": 1 + with_effect / n_rows, "closure": closure}
