"""Measurement noise of the channels: stated or estimated, channel by channel or with the full covariance R.

The errors of a candidate are (N, D): N samples of D channels. With stated standard deviations the cost is half the
weighted sum of squares. A deviation that is not stated is estimated by maximum likelihood and inserted into the
likelihood (the concentrated likelihood). Then n samples of a channel with sum of squares SS cost

    n/2 log(1 + SS / (n f^2))       with the estimate sigma^2 = SS / n + f^2

where f is a floor far below any real noise, so that a perfect fit costs zero and not minus infinity. With correlated
channels the cost is n/2 log det(I + F^-1 S / n), S the sums of products and F = diag(f^2).

That cost depends on the candidate alone, so solvers that use values need nothing else. Residuals are errors over the
deviations of the last `estimate`; half their sum of squares touches the same cost from above (log is concave), so that
least squares and new estimates in turn descend to the same minimum.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from seatruth.arrays import Array, Flags, Indices
from seatruth.errors import BadInput

_MIN_SAMPLES = 5
"""Fewest samples for an estimated deviation: its relative error is then 1/sqrt(2 n) = 0.3 (chosen here [S])."""
_UNCHANGED = 1e-6
"""Relative change of a covariance below which it counts as unchanged (chosen here [S])."""
_FLOOR = 1e-6
"""Smallest deviation that an estimate can reach, as a part of the channel's spread (chosen here [S])."""


@dataclass
class _Block:
    """Samples `rows` (n,) of channels `columns` (d,) with one covariance, whose Cholesky root is `factor` (d, d)."""

    rows: Indices
    columns: Indices
    estimated: bool
    floor: Array
    factor: Array
    place: slice
    """Slice of its residuals in the residual vector, sample by sample."""

    @property
    def size(self) -> int:
        return len(self.rows)

    def part_of(self, errors: Array) -> Array:
        """The block's part (n, d, ...) of errors (N, D, ...)."""
        if len(self.columns) == 1:
            return np.asarray(errors[self.rows, self.columns[0]][:, None])
        return np.asarray(errors[self.rows[:, None], self.columns])

    def cost(self, products: Array) -> Array:
        """Cost of sums of products (..., d, d) of the errors."""
        scaled = products / (self.size * self.floor[:, None] * self.floor)
        if len(self.columns) == 1:
            return np.asarray(0.5 * self.size * np.log1p(scaled[..., 0, 0]))
        with np.errstate(invalid="ignore", over="ignore"):
            found = np.linalg.slogdet(scaled + np.eye(len(self.columns)))[1]
        return np.asarray(0.5 * self.size * found)

    def covariance(self, errors: Array) -> Array:
        part = self.part_of(errors)
        return np.asarray(part.T @ part / self.size + np.diag(self.floor**2))


class Noise:
    """Weights and likelihood of errors (N, D).

    `measured` (N, D) gives each channel's spread, `valid` (N, D) the samples that count. `known` holds the stated
    deviations by channel; the others are estimated. With `correlated` all of them are estimated, together with their
    covariances, for each set of channels that is recorded together (samples of rare sets count channel by channel);
    `known` is then a first guess. Residual k belongs to sample `rows[k]` and channel `columns[k]`, (M,) each.
    """

    def __init__(
        self,
        channels: Sequence[str],
        measured: Array,
        valid: Flags,
        known: Mapping[str, float],
        *,
        correlated: bool = False,
        where: str = "noise",
    ) -> None:
        self.channels = tuple(channels)
        self.correlated = correlated
        self.floor = np.array([_floor(measured[:, k]) for k in range(len(self.channels))])
        first = [_first_guess(measured[:, k], self.floor[k]) for k in range(len(self.channels))]
        self._first = np.array([known.get(name, guess) for name, guess in zip(self.channels, first)])
        self._blocks: list[_Block] = []
        self.size = 0
        for rows, columns in _sets(valid) if correlated else _columns(valid):
            names = [self.channels[k] for k in columns]
            self._add(rows, columns, correlated or names[0] not in known, where)
        if not self._blocks:
            raise BadInput("no channel of the trials has a valid sample", where=where, do="Check the channels.")
        self.rows = np.concatenate([np.repeat(b.rows, len(b.columns)) for b in self._blocks])
        self.columns = np.concatenate([np.tile(b.columns, b.size) for b in self._blocks])
        self.estimated = frozenset(self.channels[k] for b in self._blocks if b.estimated for k in b.columns)
        self.weights = self._weights(valid.shape)
        counts = np.zeros(len(self.channels))
        for block in self._blocks:
            counts[block.columns] += block.size
        self._count = counts
        self._is_estimated = np.array([name in self.estimated for name in self.channels])

    @property
    def sigma(self) -> dict[str, float]:
        """Standard deviation that weights each channel now; channels without samples are left out."""
        total, count = np.zeros(len(self.channels)), np.zeros(len(self.channels))
        for block in self._blocks:
            total[block.columns] += block.size * (block.factor**2).sum(axis=1)
            count[block.columns] += block.size
        return {name: math.sqrt(total[k] / count[k]) for k, name in enumerate(self.channels) if count[k]}

    def cost_of_squares(self, squares: Array) -> Array:
        """Cost (P,) of sums of squares (P, D) weighted with `weights`; only for channels without covariances."""
        estimated = 0.5 * self._count * np.log1p(squares / np.maximum(self._count, 1.0))
        return np.asarray(np.where(self._is_estimated, estimated, 0.5 * squares).sum(axis=1))

    def cost_of_errors(self, errors: Array) -> Array:
        """Cost of errors (P, N, D); inf where one is not finite."""
        found = np.zeros(len(errors))
        with np.errstate(all="ignore"):
            for block in self._blocks:
                whole = block.size == errors.shape[1]
                part = errors if whole else np.take(errors, block.rows, axis=1)
                if len(block.columns) < errors.shape[2]:
                    part = part[:, :, block.columns]
                if block.estimated:
                    found += block.cost(np.matmul(part.transpose(0, 2, 1), part))
                else:
                    found += 0.5 * (part**2).sum(axis=(1, 2)) / block.factor[0, 0] ** 2
        return np.where(np.isfinite(found), found, np.inf)

    def residuals(self, errors: Array) -> Array:
        """Errors (N, D) over their deviations: (M,)."""
        found = np.empty(self.size)
        for block in self._blocks:
            found[block.place] = _over(block.factor, block.part_of(errors)).ravel()
        return found

    def derivatives(self, errors: Array) -> Array:
        """The same for derivatives of errors (N, D, K): (M, K)."""
        found = np.empty((self.size, errors.shape[2]))
        for block in self._blocks:
            part = block.part_of(errors)
            if len(block.columns) == 1:
                found[block.place] = part[:, 0] / block.factor[0, 0]
            else:
                found[block.place] = np.einsum("ij,njk->nik", np.linalg.inv(block.factor), part, optimize=True).reshape(
                    -1, errors.shape[2]
                )
        return found

    def cost_of_residuals(self, residuals: Array) -> float:
        """Cost of residuals (M,) under the present weights: the same number as that of their errors."""
        total = 0.0
        for block in self._blocks:
            part = residuals[block.place].reshape(block.size, -1)
            if not block.estimated:
                total += 0.5 * float(part.ravel() @ part.ravel())
                continue
            errors = part @ block.factor.T
            total += float(block.cost(errors.T @ errors))
        return total if math.isfinite(total) else math.inf

    def estimate(self, errors: Array) -> bool:
        """Estimates the deviations from these errors (N, D); True if any of them changed."""
        changed = False
        for block in self._blocks:
            if not block.estimated:
                continue
            found = block.covariance(errors)
            if not np.isfinite(found).all():
                return False
            before = block.factor @ block.factor.T
            size = np.sqrt(np.diag(before))
            if np.abs((found - before) / np.outer(size, size)).max() > _UNCHANGED:
                changed = True
        if changed:
            for block in self._blocks:
                if block.estimated:
                    block.factor = np.asarray(np.linalg.cholesky(block.covariance(errors)), dtype=np.float64)
        return changed

    def _add(self, rows: Indices, columns: Indices, estimated: bool, where: str) -> None:
        if estimated and len(rows) < _MIN_SAMPLES:
            raise BadInput(
                f"channel {self.channels[columns[0]]!r} has {len(rows)} valid sample{'s' if len(rows) > 1 else ''}: "
                "its noise cannot be estimated",
                where=where,
                do="State its standard deviation.",
            )
        place = slice(self.size, self.size + len(rows) * len(columns))
        factor = np.diag(self._first[columns])
        self._blocks.append(_Block(rows, columns, estimated, self.floor[columns], factor, place))
        self.size = place.stop

    def _weights(self, shape: tuple[int, ...]) -> Array:
        """Weights (N, D) for sums of squares: 1 / stated deviation or 1 / floor; 0 for samples that do not count."""
        found = np.zeros(shape)
        for block in self._blocks:
            for column in block.columns:
                sigma = self.floor[column] if block.estimated else self._first[column]
                found[block.rows, column] = 1.0 / sigma
        found.setflags(write=False)
        return found


def _over(factor: Array, errors: Array) -> Array:
    """factor^-1 errors for each row of errors (n, d)."""
    if len(factor) == 1:
        return np.asarray(errors / factor[0, 0])
    return np.asarray(scipy.linalg.solve_triangular(factor, errors.T, lower=True, check_finite=False).T)


def _columns(valid: Flags) -> Iterator[tuple[Indices, Indices]]:
    """(rows, column) of each channel that has valid samples."""
    for column in range(valid.shape[1]):
        rows = np.flatnonzero(valid[:, column])
        if rows.size:
            yield rows, np.array([column], dtype=np.intp)


def _sets(valid: Flags) -> Iterator[tuple[Indices, Indices]]:
    """(rows, columns) of each set of channels recorded together; samples of rare sets follow channel by channel."""
    kinds, kind_of = np.unique(valid, axis=0, return_inverse=True)
    rest = np.zeros_like(valid)
    for number, kind in enumerate(kinds):
        rows, columns = np.flatnonzero(kind_of.ravel() == number), np.flatnonzero(kind)
        if not columns.size:
            continue
        if rows.size < 5 * (columns.size + 1):
            rest[rows] = valid[rows]
        else:
            yield rows, columns
    for rows, columns in _columns(rest):
        if rows.size >= _MIN_SAMPLES:
            yield rows, columns


def _floor(values: Array) -> float:
    """A deviation below any real one: a part of the channel's spread, or of its resolution if that is larger."""
    finite = values[np.isfinite(values)]
    if not finite.size:
        return 1.0
    spread = float(finite.std()) or abs(float(finite[0])) or 1.0
    steps = np.diff(np.unique(finite))
    digit = float(steps.min()) if steps.size else 0.0
    with np.errstate(over="ignore"):
        whole = bool(digit > 0 and (np.abs(steps / digit - np.rint(steps / digit)) < 1e-3).all())
    # 1/sqrt(12) of the digit is the noise of rounding; a quarter of that leaves the estimate itself alone.
    return max(_FLOOR * spread, digit / math.sqrt(12.0) / 4.0 if whole else 0.0)


def _first_guess(values: Array, floor: float) -> float:
    """A deviation to start with: a twentieth of the channel's spread (chosen here [S])."""
    finite = values[np.isfinite(values)]
    return max(float(finite.std()) / 20.0 if finite.size else 1.0, 2.0 * floor)
