"""The oracle: what one who knows the cause closes on trials left out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from withheld.reality.families import Family
from withheld.reality.motion import Array
from withheld.reality.sensors import Noise
from withheld.reality.simulate import Record
from withheld.referee import Signatures
from withheld.refit import Refit


def oracle_closure(
    found: Signatures,
    fit: Refit,
    family: Family,
    records: Sequence[Record],
    noise: Mapping[str, Noise],
    acting: Sequence[int],
    offset: Array,
    *,
    known: Sequence[int],
) -> dict[str, float]:
    """Closure that one who knows the cause reaches on trials left out, one after the other.

    E is the root mean square error of a left-out trial over all channels, in multiples of the noise, its first state
    fitted to its first fifth. Refit: the coefficients alone are fitted to the other trials, about the refit `fit` to
    all of them without noise, so that their curvature is in it. With effect: the causes' signatures too, the size of
    each free, about the truth. Floor: 1. The noise is that which was recorded. `offset` is the truth less the prior's
    mean in units of the prior's standard deviation. `fit` is of the baseline alone, with no mechanism free in it.
    `acting` numbers what acts among the labels, `known` what of that the oracle knows: the causes, not another form.
    """
    size = found.coefficients
    truth = np.zeros(found.grams.shape[1])
    truth[[size + k for k in acting]] = 1.0
    held = {
        "refit": _left_out(fit.here, range(size), _last(fit.here), offset + fit.point.moved, family, records, noise),
        "effect": _left_out(found, [*range(size), *(size + k for k in known)], truth, offset, family, records, noise),
    }
    refit, effect = (float(np.mean(held[use])) for use in ("refit", "effect"))
    closure = (refit - effect) / (refit - 1.0) if refit > 1.0 else 0.0
    return {"floor": 1.0, "refit": refit, "with_effect": effect, "closure": closure}


def _last(here: Signatures) -> Array:
    """The combination of columns that is what a refit left."""
    only = np.zeros(here.grams.shape[1])
    only[-1] = 1.0
    return only


def _left_out(
    found: Signatures,
    own: Sequence[int],
    truth: Array,
    offset: Array,
    family: Family,
    records: Sequence[Record],
    noise: Mapping[str, Noise],
) -> list[float]:
    """Error on each trial when `own` columns are fitted to the others; the data are a combination `truth` and noise."""
    size, own = found.coefficients, list(own)
    total = found.grams.sum(axis=0)
    pull = [w.T @ z for w, z in zip(found.whitened, found.noise, strict=True)]
    errors = []
    for k, record in enumerate(records):
        gram, right = total - found.grams[k], sum(p for j, p in enumerate(pull) if j != k)
        a = gram[np.ix_(own, own)].copy()
        a[range(size), range(size)] += 1.0
        # The prior's mean lies `offset` behind the point about which all is taken.
        b = gram[own] @ truth + np.asarray(right)[own]
        b[:size] -= offset
        step = np.zeros(len(truth))
        step[own] = np.linalg.lstsq(a, b, rcond=1e-12)[0]
        error = found.raw[k] @ (truth - step) + _noise_of(record, noise)
        errors.append(float(np.sqrt(np.mean(_without_start(error, found.starts[k], record, family) ** 2))))
    return errors


def _noise_of(record: Record, noise: Mapping[str, Noise]) -> Array:
    """The noise of a record over its true deviation, channel after channel."""
    return np.concatenate([(record.outputs[name] - record.clean[name]) / noise[name].sd for name in record.outputs])


def _without_start(error: Array, starts: Array, record: Record, family: Family) -> Array:
    """An error (rows,) less what the first state explains of its first fifth."""
    n = len(record.t)
    early = np.tile(np.arange(n) < max(12, n // 5), len(family.outputs))
    return np.asarray(error - starts @ np.linalg.lstsq(starts[early], error[early], rcond=None)[0])
