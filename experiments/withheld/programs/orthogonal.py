"""A discrepancy as a Gaussian process that is orthogonal to the model's parameters (Plumlee 2017).

    residuals = derivatives by the parameters * step + delta + white noise

delta is a Gaussian process in time, by channel and trial, conditioned on being orthogonal to all derivatives, so that
what a parameter can say is the parameter's:

    cov(delta) = K - K J (J' K J)^-1 J' K

K: exponential covariance, of one amplitude and one correlation time for all channels in units of their white noise, by
maximum likelihood on a grid. The paper names no cause. Here the posterior mean of delta is regressed on the signatures
of one effect after the other, also freed of the derivatives: the share that each explains is compared as if delta had
as many samples as the process has degrees of freedom, less BIC's price. Where no effect explains half of it, the
cause is called unknown; where the likelihood does not ask for a process, there is none.

M. Plumlee, Bayesian Calibration of Inexact Computer Models, JASA 112 (2017) 1274-1285.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from withheld.programs.common import Array, Rows, refitted, soft
from withheld.programs.linear import left
from withheld.verdicts import verdict

AMPLITUDES = (0.5, 1.0, 2.0, 5.0, 15.0)
"""Of the process, in deviations of the white noise."""
TIMES = (3.0, 12.0, 48.0)
"""Samples over which the process keeps e^-1 of itself."""
HALF = 0.5
"""Share of the discrepancy that a named effect has to explain [S]."""
EVERY = 3
"""Every so many samples are used: linear algebra of a thousand samples a trial would take minutes."""


@dataclass(frozen=True)
class Fitted:
    """A discrepancy: its log-likelihood over that of white noise alone, posterior mean (n,), degrees of freedom."""

    gain: float
    mean: Array
    freedom: float


def discrepancy(residuals: Array, derivatives: Array, runs: list[Rows]) -> Fitted:
    """The likeliest orthogonal process; residuals (n,) and derivatives (n, p) in units of white noise; `runs` are the
    rows of each channel of each trial."""
    q, _ = np.linalg.qr(derivatives / np.maximum(np.linalg.norm(derivatives, axis=0), 1e-300))
    r = residuals - q @ (q.T @ residuals)
    nothing = Fitted(0.0, np.zeros(len(r)), 0.0)
    tried = [_process(r, q, runs, a, tau) for a in AMPLITUDES for tau in TIMES]
    # Two numbers are chosen.
    best = max(tried, key=lambda one: one.gain)
    return best if best.gain > math.log(len(r)) else nothing


def _process(r: Array, q: Array, runs: list[Rows], amplitude: float, tau: float) -> Fitted:
    """One process: by blocks, and the orthogonality by Woodbury's identity."""
    kq, ar, akq = np.empty_like(q), np.empty_like(r), np.empty_like(q)
    log_det, freedom = 0.0, 0.0
    blocks: dict[int, tuple[Array, Any, float, float]] = {}
    for rows in runs:
        n = len(rows)
        if n not in blocks:
            lag = np.abs(np.subtract.outer(np.arange(n), np.arange(n)))
            k = amplitude**2 * np.exp(-lag / tau)
            factor = cho_factor(k + np.eye(n), lower=True)
            solved = cho_solve(factor, k)
            blocks[n] = (k, factor, 2 * float(np.log(np.diag(factor[0])).sum()), float(np.trace(solved)))
        k, factor, one, free = blocks[n]
        kq[rows] = k @ q[rows]
        ar[rows] = cho_solve(factor, r[rows])
        akq[rows] = cho_solve(factor, kq[rows])
        log_det, freedom = log_det + one, freedom + free
    c = q.T @ kq
    ridge = 1e-9 * np.trace(c) / len(c) * np.eye(len(c))
    inner = c - kq.T @ akq + ridge
    solved = ar + akq @ np.linalg.solve(inner, kq.T @ ar)
    log_det += float(np.linalg.slogdet(inner)[1] - np.linalg.slogdet(c + ridge)[1])
    mean = r - solved  # K_o (K_o + I)^-1 r
    gain = 0.5 * float(r @ r) - 0.5 * float(r @ solved) - 0.5 * log_det
    return Fitted(gain, mean - q @ (q.T @ mean), max(1.0, freedom - q.shape[1]))


def orthogonal(study: Path) -> dict[str, Any]:
    """Refits the coefficients, lets an orthogonal process hold what is left, and names what explains its mean."""
    found = refitted(study)
    white = found.white()
    runs, rows, begin = [], [], 0
    for _, own in found.runs:
        own = own[::EVERY]
        rows.append(own)
        runs.append(np.arange(begin, begin + len(own)))
        begin += len(own)
    at = np.concatenate(rows)
    derivatives = found.nuisances[at] / white[at, None]
    fit = discrepancy(found.residuals[at] / white[at], derivatives, runs)
    if not fit.gain:
        return verdict(study.parent.name, [([], 1.0)])
    signatures = {name: own[at] / white[at, None] for name, own in found.signatures.items()}
    return verdict(study.parent.name, soft(named_by(fit, signatures, derivatives)))


def named_by(fit: Fitted, signatures: Mapping[str, Array], derivatives: Array) -> dict[str, float]:
    """Log scores of effects, by what their signatures (n, k) explain of a discrepancy, and of "unknown"."""
    q, _ = np.linalg.qr(derivatives / np.maximum(np.linalg.norm(derivatives, axis=0), 1e-300))
    whole = float(fit.mean @ fit.mean)
    scores = {"unknown": -0.5 * fit.freedom * math.log(1 - HALF)}
    for name, columns in signatures.items():
        rest = left(fit.mean, columns - q @ (q.T @ columns))
        share = max(float(rest @ rest) / whole, 1e-12)
        scores[name] = -0.5 * fit.freedom * math.log(share) - 0.5 * columns.shape[1] * math.log(fit.freedom)
    return scores
