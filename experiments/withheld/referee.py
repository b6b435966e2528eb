"""The independent referee: how much of a cause these trials show, beyond noise and what a refit can absorb.

All signatures are differences of this benchmark's own simulations under the recorded inputs. They are whitened by
the true noise (white and coloured, channel by channel) and freed of what the first state of each trial can explain.
To first order, what the coefficients can take up under their priors is marginalised here; `refit.py` does it in full.
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
NUDGE = 0.01
"""Of the differences by a first state, in standard deviations of the channel's noise."""
FAR = 1e9
"""What stands for outputs of a motion that ran away."""
TELLS_APART = 9.0
"""Pairwise lambda below which two causes count as not to be told apart (three standard deviations)."""
Variant = tuple[str, Sequence[Present]]
"""A label, and what acts."""


@dataclass(frozen=True)
class Point:
    """Where reality's baseline is looked at: how far coefficients, sizes and first states are from the true ones."""

    moved: Array
    """(K,) coefficients, in standard deviations of their priors."""
    sizes: Array
    """(F,) values of the free mechanisms, in typical magnitudes."""
    firsts: Array
    """(trials, 6) first states, in standard deviations of the channels' noise."""

    def at(self, step: Array, firsts: Array) -> Point:
        """The point after a step of coefficients and sizes, and one of the first states."""
        size = len(self.moved)
        return Point(self.moved + step[:size], self.sizes + step[size:], self.firsts + firsts)


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
    whole: list[Array]
    """`whitened` before the first states are projected out."""
    whole_starts: list[Array]
    """(rows, 6): whitened changes by the first state."""

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


@dataclass(frozen=True)
class Rig:
    """A vehicle and its trials, to be run again under the recorded inputs.

    `free` are mechanisms that act at every point looked at, and whose magnitudes a refit may choose.
    """

    family: Family
    records: Sequence[Record]
    coefficients: Mapping[str, float]
    noise: Mapping[str, Noise]
    free: Sequence[Present] = ()

    @functools.cached_property
    def sd(self) -> dict[str, float]:
        """Standard deviation of each coefficient's prior."""
        return {name: PRIOR * abs(value) for name, value in self.family.coefficients.items()}

    @functools.cached_property
    def units(self) -> list[tuple[int, str, float]]:
        """Free mechanism, value of it that grows, typical magnitude of that value."""
        return [
            (k, name, max(abs(float(values.get(name, 0.0))) for values in one.mechanism.spans) or 1.0)
            for k, one in enumerate(self.free)
            for name in one.mechanism.grows
        ]

    def truth(self) -> Point:
        """The true coefficients and first states, and the free mechanisms as they are."""
        sizes = [self.free[k].values[name] / unit for k, name, unit in self.units]
        return Point(np.zeros(len(self.sd)), np.array(sizes), np.zeros((len(self.records), 6)))

    def acting(self, sizes: Array) -> list[Present]:
        """The free mechanisms at these sizes."""
        values = [dict(one.values) for one in self.free]
        for (k, name, unit), size in zip(self.units, sizes.tolist(), strict=True):
            values[k][name] = size * unit
        return [Present(one.mechanism, own) for one, own in zip(self.free, values, strict=True)]

    def look(self, point: Point, variants: Sequence[Variant] = (), aim: Array | None = None) -> Signatures:
        """What changes about a point: by coefficients, by free sizes (labelled ""), by variants (label, what acts too).

        With `aim` (samples, 6, trials), as of `outputs`, a last column labelled "aim" is aim less outputs there.
        """
        sd, family = self.sd, self.family
        here = {name: self.coefficients[name] + move * sd[name] for name, move in zip(sd, point.moved, strict=True)}
        acting = self.acting(point.sizes)
        still = (0.0,) * 6
        kinds: list[tuple[Mapping[str, float], Sequence[Present], tuple[float, ...]]] = [(here, acting, still)]
        kinds += [({**here, name: here[name] + STEP * sd[name]}, acting, still) for name in sd]
        deviations = np.array([family.noise[name] for name in family.outputs])
        kinds += [(here, acting, tuple(row)) for row in np.diag(NUDGE * deviations).tolist()]
        for k in range(len(point.sizes)):
            kinds.append((here, self.acting(point.sizes + STEP * np.eye(len(point.sizes))[k]), still))
        kinds += [(here, [*acting, *more], still) for _, more in variants]
        firsts = point.firsts * deviations
        lanes = [
            Lane(k, kind[0], kind[1], tuple((firsts[k] + kind[2]).tolist()))
            for kind in kinds
            for k in range(len(self.records))
        ]
        y = self._run(lanes).reshape(-1, 6, len(kinds), len(self.records))
        labels = [""] * len(point.sizes) + [label for label, _ in variants] + ([] if aim is None else ["aim"])
        size, sizes = len(sd), len(point.sizes)
        found = Signatures(size, labels, [], [], [], [], [], [])
        for k, record in enumerate(self.records):
            n = len(record.t)
            change = y[:n, :, 1:, k] - y[:n, :, :1, k]
            change[:, :, :size] /= STEP
            change[:, :, size + 6 : size + 6 + sizes] /= STEP
            change[:, :, size : size + 6] /= NUDGE
            if aim is not None:
                change = np.concatenate([change, aim[:n, :, k, None] - y[:n, :, :1, k]], axis=2)
            self._add(found, record, change)
        return found

    def outputs(self, acting: Sequence[Present]) -> Array:
        """(samples, 6, trials) at the true coefficients, with these acting."""
        return self._run([Lane(k, self.coefficients, acting) for k in range(len(self.records))])

    def there(self, point: Point) -> Array:
        """(samples, 6, trials) at a point."""
        sd = self.sd
        here = {name: self.coefficients[name] + move * sd[name] for name, move in zip(sd, point.moved, strict=True)}
        firsts = point.firsts * np.array([self.family.noise[name] for name in self.family.outputs])
        acting = self.acting(point.sizes)
        return self._run([Lane(k, here, acting, tuple(firsts[k].tolist())) for k in range(len(self.records))])

    def _run(self, lanes: Sequence[Lane]) -> Array:
        # Motions that run away are told by their size, not by a warning.
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            return np.clip(np.nan_to_num(replay(self.family, self.records, lanes), nan=FAR), -FAR, FAR)

    def whiten(self, record: Record, change: Array) -> Array:
        """Changes (samples, 6, ...) of one trial's outputs, channel after channel, in units of white noise."""
        n, names = len(record.t), self.family.outputs
        return np.concatenate(
            [
                solve_triangular(whitener(self.noise[o], n, self.family.dt), change[:n, j], lower=True)
                for j, o in enumerate(names)
            ]
        )

    def _add(self, found: Signatures, record: Record, change: Array) -> None:
        names, noise, size = self.family.outputs, self.noise, found.coefficients
        noisy = np.stack([record.outputs[o] - record.clean.get(o, record.outputs[o]) for o in names], axis=1)
        both = np.concatenate([change, noisy[:, :, None]], axis=2)
        stack = self.whiten(record, both)
        start, whole = stack[:, size : size + 6], np.delete(stack, np.s_[size : size + 6], axis=1)
        q, _ = np.linalg.qr(start / np.maximum(np.linalg.norm(start, axis=0), 1e-300))
        rest = whole - q @ (q.T @ whole)
        plain = np.concatenate([change[:, j] / noise[name].sd for j, name in enumerate(names)])
        found.whitened.append(rest[:, :-1])
        found.noise.append(rest[:, -1])
        found.raw.append(np.delete(plain, np.s_[size : size + 6], axis=1))
        found.starts.append(plain[:, size : size + 6])
        found.whole.append(whole[:, :-1])
        found.whole_starts.append(start)


def signatures(
    family: Family,
    records: Sequence[Record],
    coefficients: Mapping[str, float],
    noise: Mapping[str, Noise],
    variants: Sequence[Variant],
) -> Signatures:
    """Signatures of the coefficients and of `variants` on these trials, about the truth without a cause."""
    rig = Rig(family, records, coefficients, noise)
    return rig.look(rig.truth(), variants)


def spans(mechanisms: Sequence[Mechanism], share: float = 1.0) -> list[tuple[str, list[Present]]]:
    """The variants that stand for every mechanism of a catalogue, at a share of their typical magnitudes."""
    return [(one.key, [Present(one, one.scaled(values, share))]) for one in mechanisms for values in one.spans]
