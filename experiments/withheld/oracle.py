"""The oracle: what one who knows the cause closes on trials left out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from withheld.reality.motion import Array
from withheld.reality.sensors import Noise
from withheld.reality.simulate import Record
from withheld.referee import Signatures
from withheld.refit import Refit

AT_MOST = 3.0
"""Standard deviations up to which coefficients and sizes may lie elsewhere than the other trials say."""


def oracle_closure(
    found: Signatures,
    fit: Refit,
    records: Sequence[Record],
    noise: Mapping[str, Noise],
    acting: Sequence[int],
    offset: Array,
    *,
    known: Sequence[int],
) -> dict[str, float]:
    """Closure that one who knows the cause reaches on trials left out, one after the other.

    Refit: the coefficients alone are fitted to the other trials, about the refit `fit` to all of them without noise, so
    that their curvature is in it. With effect: the causes' signatures too, the size of each free, about the truth.
    Floor: the noise that was recorded. Errors of a trial are root mean square over all channels, in multiples of the
    noise, its first state fitted to it, and of what the other trials determine of it: what they leave open about
    coefficients and sizes counts as noise, up to three deviations, for all three alike. `offset` is the truth less the
    prior's mean in units of the prior's standard deviation. `fit` is of the baseline alone, with no mechanism free in
    it. `acting` numbers what acts among the labels, `known` what of that the oracle knows: the causes, no other form.
    """
    size = found.coefficients
    truth = np.zeros(found.grams.shape[1])
    truth[[size + k for k in acting]] = 1.0
    last = np.zeros(fit.here.grams.shape[1])
    last[-1] = 1.0
    own = [*range(size), *(size + k for k in known)]
    errors = []
    for k, record in enumerate(records):
        measure = _Measure(found, own, k)
        noise_k = _noise_of(record, noise)
        refit = _left_out(fit.here, range(size), last, offset + fit.point.moved, k) + noise_k
        effect = _left_out(found, own, truth, offset, k) + noise_k
        errors.append([measure(refit), measure(effect), measure(noise_k)])
    mean_refit, mean_effect, floor = (float(x) for x in np.mean(errors, axis=0))
    closure = (mean_refit - mean_effect) / (mean_refit - floor) if mean_refit > floor else 0.0
    return {"floor": floor, "refit": mean_refit, "with_effect": mean_effect, "closure": closure}


class _Measure:
    """Error of a trial that others predict, relative to noise and what they leave open about `own` columns."""

    def __init__(self, found: Signatures, own: Sequence[int], trial: int) -> None:
        self._starts = found.starts[trial]
        precision = _precision(found, own, trial)
        values, vectors = np.linalg.eigh(precision)
        root = vectors / np.sqrt(np.maximum(values, values[-1] * 1e-12))
        self._along, self._open, _ = np.linalg.svd(
            self._fitted(found.raw[trial][:, list(own)] @ root), full_matrices=False
        )

    def __call__(self, error: Array) -> float:
        fitted = self._fitted(error)
        along = self._along.T @ fitted
        taken = np.clip(along * self._open / (1.0 + self._open**2), -AT_MOST, AT_MOST)
        left = fitted - self._along @ (self._open * taken)
        return float(np.sqrt((left @ left + taken @ taken) / len(fitted)))

    def _fitted(self, error: Array) -> Array:
        """An error (rows, ...) less what the first state explains of it."""
        return np.asarray(error - self._starts @ np.linalg.lstsq(self._starts, error, rcond=None)[0])


def _precision(found: Signatures, own: Sequence[int], left: int) -> Array:
    """What the other trials, and the priors of the coefficients, know of `own` columns."""
    gram = np.delete(found.grams, left, axis=0).sum(axis=0)[np.ix_(list(own), list(own))]
    coefficients = np.arange(found.coefficients)
    gram[coefficients, coefficients] += 1.0
    return np.asarray(gram)


def _left_out(found: Signatures, own: Sequence[int], truth: Array, offset: Array, left: int) -> Array:
    """Error on a trial, without its noise, when `own` columns are fitted to the others; the data are a combination
    `truth` and noise."""
    own, size = list(own), found.coefficients
    others = [j for j in range(len(found.raw)) if j != left]
    pull = sum(found.whitened[j].T @ found.noise[j] for j in others)
    right = found.grams[others].sum(axis=0)[own] @ truth + np.asarray(pull)[own]
    # The prior's mean lies `offset` behind the point about which all is taken.
    right[:size] -= offset
    step = np.zeros(len(truth))
    step[own] = np.linalg.lstsq(_precision(found, own, left), right, rcond=1e-12)[0]
    return np.asarray(found.raw[left] @ (truth - step))


def _noise_of(record: Record, noise: Mapping[str, Noise]) -> Array:
    """The noise of a record over its true deviation, channel after channel."""
    return np.concatenate([(record.outputs[name] - record.clean[name]) / noise[name].sd for name in record.outputs])
