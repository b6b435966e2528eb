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
    raw: list[Array]
    """The same over the noise's true deviation, neither whitened nor projected."""
    starts: list[Array]
    """(rows, 6): changes by the first state, over the noise's true deviation."""
    noise: list[Array]
    """The whitened noise of the records, first states projected out; empty where a record has no clean outputs."""

    @functools.cached_property
    def grams(self) -> Array:
        """(trials, K, K)."""
        return np.stack([w.T @ w for w in self.whitened])

    def columns(self, label: str) -> list[int]:
        """Columns of a label, counted after the coefficients."""
        return [k for k, name in enumerate(self.labels) if name == label]

    def projected(self) -> Array:
        """Gram matrix of the labelled columns over all trials, after the coefficients are marginalised."""
        return marginal(self.grams.sum(axis=0), self.coefficients)


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
    size, whitened, raw, firsts_of, drawn = len(sd), [], [], [], []
    for k, record in enumerate(records):
        n = len(record.t)
        change = y[:n, :, 1:, k] - y[:n, :, :1, k]
        change[:, :, :size] /= STEP
        noisy = np.stack([record.outputs[o] - record.clean.get(o, record.outputs[o]) for o in family.outputs], axis=1)
        parts = [
            solve_triangular(
                whitener(noise[name], n, family.dt), np.column_stack([change[:, j], noisy[:, j]]), lower=True
            )
            for j, name in enumerate(family.outputs)
        ]
        stack = np.concatenate(parts)
        start, rest = stack[:, size : size + 6], np.delete(stack, np.s_[size : size + 6], axis=1)
        q, _ = np.linalg.qr(start / np.linalg.norm(start, axis=0))
        rest = rest - q @ (q.T @ rest)
        plain = np.concatenate([change[:, j] / noise[name].sd for j, name in enumerate(family.outputs)])
        whitened.append(rest[:, :-1])
        drawn.append(rest[:, -1])
        raw.append(np.delete(plain, np.s_[size : size + 6], axis=1))
        firsts_of.append(plain[:, size : size + 6])
    return Signatures(size, [label for label, _ in variants], whitened, raw, firsts_of, drawn)


def spans(mechanisms: Sequence[Mechanism]) -> list[tuple[str, list[Present]]]:
    """The variants that stand for every mechanism of a catalogue."""
    return [(one.key, [Present(one, dict(values))]) for one in mechanisms for values in one.spans]


def pairwise(found: Signatures, gram: Array, column: int, names: Sequence[str]) -> dict[str, float]:
    """lambda that is left of a column after each of some mechanisms has taken what it can."""
    return {name: left_over(gram, column, found.columns(name)) for name in names}


def oracle_closure(
    found: Signatures,
    family: Family,
    records: Sequence[Record],
    noise: Mapping[str, Noise],
    causes: Sequence[int],
    offset: Array,
) -> dict[str, float]:
    """Closure that one who knows the cause reaches on trials left out, one after the other.

    E is the root mean square error of a left-out trial over all channels, in multiples of the noise, its first state
    fitted to its first fifth. Refit: the coefficients alone are fitted to the other trials. With effect: the causes'
    signatures too, the size of each free. Floor: 1. All on the linearised model, with the noise that was recorded.
    `offset` is the truth less the prior's mean in units of the prior's standard deviation.
    """
    size = found.coefficients
    columns = {"refit": list(range(size)), "effect": [*range(size), *(size + k for k in causes)]}
    total = found.grams.sum(axis=0)
    held: dict[str, list[float]] = {"refit": [], "effect": []}
    pull = [w.T @ z for w, z in zip(found.whitened, found.noise, strict=True)]
    truth = np.zeros(found.grams.shape[1])
    truth[[size + k for k in causes]] = 1.0
    for k, record in enumerate(records):
        gram, right = total - found.grams[k], sum(p for j, p in enumerate(pull) if j != k)
        for use, own in columns.items():
            a = gram[np.ix_(own, own)].copy()
            a[range(size), range(size)] += 1.0
            # About the true coefficients: the data hold the causes and the noise, the prior sits at minus the offset.
            b = gram[own] @ truth + np.asarray(right)[own]
            b[:size] -= offset
            step = np.zeros(len(truth))
            step[own] = np.linalg.lstsq(a, b, rcond=1e-12)[0]
            error = found.raw[k] @ (truth - step) + _noise_of(record, noise)
            held[use].append(float(np.sqrt(np.mean(_without_start(error, found.starts[k], record, family) ** 2))))
    refit, effect = float(np.mean(held["refit"])), float(np.mean(held["effect"]))
    closure = (refit - effect) / (refit - 1.0) if refit > 1.0 else 0.0
    return {"floor": 1.0, "refit": refit, "with_effect": effect, "closure": closure}


def _noise_of(record: Record, noise: Mapping[str, Noise]) -> Array:
    """The noise of a record over its true deviation, channel after channel."""
    return np.concatenate([(record.outputs[name] - record.clean[name]) / noise[name].sd for name in record.outputs])


def _without_start(error: Array, starts: Array, record: Record, family: Family) -> Array:
    """An error (rows,) less what the first state explains of its first fifth."""
    n = len(record.t)
    early = np.tile(np.arange(n) < max(12, n // 5), len(family.outputs))
    return np.asarray(error - starts @ np.linalg.lstsq(starts[early], error[early], rcond=None)[0])
