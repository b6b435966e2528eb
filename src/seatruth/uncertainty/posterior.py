"""The posterior of an estimate, sampled with emcee's ensemble of walkers.

The density is the cost's own: exp(-cost) inside the bounds, where the cost is minus the log of likelihood and priors. A
parameter without a prior is uniform between its bounds. A deviation that is estimated is inserted at its best value for
each candidate; that is the likelihood with the deviation integrated out under Jeffreys' prior, up to a constant. As
in the cost, the residuals count as white: where they are not, the sample is narrower than the linear intervals.

Walkers step by differential evolution (ter Braak 2006, Statistics and Computing 16, 239-249; Nelson and others 2014,
ApJS 210, 11): towards the difference of two others. On normal distributions of 3, 8 and 20 dimensions its
autocorrelation times were 10, 29 and 79 steps, those of the stretch move 40, 92 and 254. emcee's snooker move, often
mixed in, is left out: with a fifth of it emcee 3.1.6 gave standard deviations that were 2, 5 and 11 % too small.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from seatruth.arrays import Array
from seatruth.costs.base import Cost
from seatruth.errors import BadInput, SeatruthError
from seatruth.progress import Progress, ProgressEvent, remaining
from seatruth.statistics.covariance_root import covariance_root
from seatruth.statistics.posterior_sample import ENOUGH_TIMES, VALUE, Posterior, summarised
from seatruth.storage.checkpoint import Checkpoint
from seatruth.text import listed
from seatruth.trials.finding import Finding

LONG_TIMES = 100.0
"""Autocorrelation times at which a chain ends: what emcee's manual asks for (page on monitoring progress)."""
_BLOCK = 100
"""Stored steps after which a chain is stored and its length is judged. Chosen here [S]."""
_DIMENSIONS_A_STEP = 4
"""Of K dimensions every K/4-th step is stored: the autocorrelation time is some 3.5 K steps, so that nothing is lost,
and the checkpoint stays below 50 MB. Chosen here [S]."""
_WALKERS = 32
"""Walkers at least. Chosen here [S]: one population fills the processors; emcee needs twice the dimensions."""
_JUMPS = 0.1
"""Part of the steps that go the whole difference of two walkers, from one mode to another (ter Braak 2006)."""
_BURN_IN_TIMES = 5.0
"""Autocorrelation times left out at the beginning: exp(-5) is less than 1 % of what the start leaves. Chosen here
[S]; emcee's manual leaves out "a few"."""
_KEPT = 20_000
"""Rows of the chain that are kept for figures and bands. Chosen here [S]: quantiles are made of all steps before."""
_WIDER = 1.5
"""Linear standard errors over those of white noise from which a sample of the posterior is called too narrow. Chosen
here [S]: a 95 % interval then holds less than 81 %."""
_WIDEST = 0.25
"""Standard deviation of the start over the distance of the bounds, at most: most draws then lie within them. Chosen
here [S]."""
_FLATTEST = 1e-10
"""Smallest eigenvalue of the correlation of the start, so that the walkers span all dimensions. Chosen here [S]."""
_HALVINGS = 40
"""Times that a walker without a finite cost moves half its way to the estimate: 1e-12 of it is then left."""
_SPREADS = 2.0
"""Spread of the walkers in the last quarter of a chain, over that in the first, from which it has not settled. Chosen
here [S]: chance changes it by some 5 % in a chain that is long enough."""
_EVERY_S = 0.1


def require_emcee() -> Any:
    """The package emcee. Raises BadInput where it is not installed."""
    try:
        import emcee
    except ImportError as problem:
        what = f"sampling the posterior needs the package emcee ({problem})"
        raise BadInput(what, where="posterior", do='Install it: pip install "seatruth[posterior]".') from None
    return emcee


@dataclass
class _Chain:
    """A chain as far as it has come, every `every`-th step: places (n, W, K), log probabilities (n, W), how many of
    these steps' proposals were accepted, and the random state."""

    every: int

    places: list[Array]
    logs: list[Array]
    accepted: float
    random: Any

    @property
    def steps(self) -> int:
        return self.every * sum(len(part) for part in self.places)


def sample_posterior(
    cost: Cost,
    x: Array,
    covariance: Array,
    *,
    steps: int,
    seed: int,
    checkpoint: Checkpoint,
    progress: Progress,
) -> Posterior:
    """Samples exp(-cost) within the bounds.

    It ends after `steps`, or before once the chain has `LONG_TIMES` autocorrelation times.

    Args:
        cost: The cost; each half of the walkers is one population of `values`.
        x: (K,), the estimate, around which the walkers start.
        covariance: (K, K), its covariance; NaN where the trials determine none, 0 where it was not computed.
        steps: Steps at most.
        seed: Seed of all that is random.
        checkpoint: Finished blocks of steps are read from it and stored in it.
        progress: Called with a `ProgressEvent` about ten times a second.

    Raises:
        BadInput: emcee is not installed.
        SeatruthError: There is no posterior, or no finite cost around the estimate.
    """
    emcee = require_emcee()
    low, high = cost.bounds
    _refuse_unlimited(cost, covariance)
    # Nothing of a block depends on how many follow, so a run with more steps goes on where this one ended.
    key = f"posterior {seed}"

    def log_probability(X: Array) -> Array:
        found = np.full(len(X), -np.inf)
        inside = ((low <= X) & (high >= X)).all(axis=1)
        if inside.any():
            found[inside] = -cost.values(X[inside])
        return found

    random = np.random.RandomState(np.random.MT19937(np.random.SeedSequence(seed)))
    first = _first_places(cost, x, covariance, random)
    walkers = len(first)
    moves = [(emcee.moves.DEMove(), 1.0 - _JUMPS), (emcee.moves.DEMove(gamma0=1.0), _JUMPS)]
    every = min(max(1, len(x) // _DIMENSIONS_A_STEP), steps)
    chain = _Chain(every, [], [], 0.0, random.get_state())
    state = emcee.State(first, random_state=chain.random)
    began, before, shown = time.perf_counter(), 0, -math.inf
    found: tuple[int, Array] = (0, np.full(len(x), math.nan))
    while (size := min(_BLOCK, (steps - chain.steps) // every)) > 0:
        name = f"{key} {chain.steps} {size}"
        if name in checkpoint:
            _take(chain, checkpoint.get(name))
            before = chain.steps
        else:
            sampler = emcee.EnsembleSampler(walkers, len(x), log_probability, moves=moves, vectorize=True)
            # The check of the start needs walkers that differ, which normal draws do.
            runs = sampler.sample(state, iterations=size, thin_by=every, skip_initial_state_check=True)
            for done, _ in enumerate(runs, 1):
                if (now := time.perf_counter()) - shown > _EVERY_S:
                    shown, at = now, chain.steps + every * done
                    left = remaining(at - before, steps - before, now - began)
                    progress(ProgressEvent("Posterior", at, steps, "steps", remaining_s=left, may_end_early=True))
            checkpoint.put(name, _stored(sampler))
            _take(chain, checkpoint.get(name))
        state = emcee.State(chain.places[-1][-1], log_prob=chain.logs[-1][-1], random_state=chain.random)
        found = _burn_in(emcee, np.concatenate(chain.places))
        if (chain.steps // every - found[0]) / np.max(found[1]) >= LONG_TIMES:
            break
    progress(ProgressEvent("Posterior", chain.steps, chain.steps, "steps"))
    return _posterior(cost, chain, *found)


def _refuse_unlimited(cost: Cost, covariance: Array) -> None:
    """Raises SeatruthError where neither trials nor bounds nor a prior limit a parameter: walkers would run to 1e16."""
    low, high = cost.bounds
    unknown = np.isnan(np.diag(covariance))
    open_ended = unknown & np.isinf(low) & np.isinf(high)
    apart = [p.name for p, is_open in zip(cost.parameters, open_ended) if is_open and p.prior is None]
    if apart:
        raise SeatruthError(
            f"there is no posterior, as nothing limits {listed(apart)}",
            where="posterior",
            do="Bound or fix one of them, or give it a prior.",
        )


def _first_places(cost: Cost, x: Array, covariance: Array, random: np.random.RandomState) -> Array:
    """(W, K): normal draws around the estimate, mirrored at the bounds, nearer to it where the cost is not finite."""
    low, high = cost.bounds
    size = len(x)
    walkers = max(_WALKERS, 2 * (size + 1))
    width = high - low
    spread = np.where(np.isfinite(width), 0.01 * width, 0.01 * np.where(x == 0, 1.0, np.abs(x)))
    matrix = np.diag(spread**2)
    variance = np.diag(covariance)
    known = np.isfinite(variance) & (variance > 0)
    matrix[np.ix_(known, known)] = covariance[np.ix_(known, known)]
    too_wide = np.minimum(1.0, _WIDEST * width / np.sqrt(np.diag(matrix)))
    matrix *= np.outer(too_wide, too_wide)
    free = x + random.normal(size=(walkers, size)) @ covariance_root(matrix, _FLATTEST).T
    mirrored = np.where(free < low, 2.0 * low - free, np.where(free > high, 2.0 * high - free, free))
    draws: Array = np.clip(mirrored, low, high)
    for _ in range(_HALVINGS):
        lost = ~np.isfinite(cost.values(draws))
        if not lost.any():
            return draws
        draws[lost] = 0.5 * (draws[lost] + x)
    raise SeatruthError(
        "no finite cost was found around the estimate", where="posterior", do="Check that the fit converged."
    )


def _stored(sampler: Any) -> dict[str, Any]:
    kind, keys, position, has_gauss, gauss = sampler.random_state
    return {
        "places": np.asarray(sampler.get_chain()),
        "logs": np.asarray(sampler.get_log_prob()),
        "accepted": float(np.sum(sampler.backend.accepted)),
        "random": [str(kind), np.asarray(keys), int(position), int(has_gauss), float(gauss)],
    }


def _take(chain: _Chain, block: Mapping[str, Any]) -> None:
    chain.places.append(np.asarray(block["places"]))
    chain.logs.append(np.asarray(block["logs"]))
    chain.accepted += float(block["accepted"])
    kind, keys, *rest = block["random"]
    chain.random = (kind, np.asarray(keys), *rest)


def _burn_in(emcee: Any, places: Array) -> tuple[int, Array]:
    """Stored steps to leave out, and the autocorrelation times (K,) of those after them; of a short chain too low.

    Infinite where the walkers still run apart.
    """
    half = len(places) // 2
    times = _times(emcee, places[half:])
    longest = float(np.max(times))
    burn_in = half if not math.isfinite(longest) else min(half, math.ceil(_BURN_IN_TIMES * longest))
    kept = places[burn_in:]
    times = _times(emcee, kept)
    # Walkers that run apart all together have a short autocorrelation time all the same.
    quarter = max(1, len(kept) // 4)
    times[kept[-quarter:].std(axis=(0, 1)) > _SPREADS * kept[:quarter].std(axis=(0, 1))] = math.inf
    return burn_in, times


def _times(emcee: Any, places: Array) -> Array:
    if len(places) < 2:
        return np.full(places.shape[2], math.nan)
    with np.errstate(all="ignore"):
        return np.asarray(emcee.autocorr.integrated_time(places, tol=0), dtype=float)


def _posterior(cost: Cost, chain: _Chain, burn_in: int, times: Array) -> Posterior:
    places, logs = np.concatenate(chain.places), np.concatenate(chain.logs)
    stored, walkers, size = places.shape
    apart = max(1, math.ceil(stored * walkers / _KEPT))
    kept = np.arange(apart - 1, stored, apart)
    frame = pd.DataFrame(
        {
            "walker": np.tile(np.arange(1, walkers + 1), len(kept)),
            "step": np.repeat(chain.every * (kept + 1), walkers),
            "log_probability": logs[kept].ravel(),
        }
    )
    values = pd.DataFrame(places[kept].reshape(-1, size), columns=[f"{VALUE}{name}" for name in cost.names])
    return Posterior(
        chain=pd.concat([frame, values], axis=1),
        summary=summarised(cost.names, places[burn_in:], times, chain.every),
        walkers=walkers,
        steps=chain.steps,
        burn_in=chain.every * burn_in,
        acceptance=chain.accepted / (stored * walkers),
    )


def posterior_findings(found: Posterior, inflation: float) -> list[Finding]:
    """What a user should know of a sample.

    Args:
        found: The sample.
        inflation: Linear standard errors over those of white noise of the stated size.
    """
    findings = []
    if np.isinf(found.summary["autocorrelation_time"]).any():
        apart = [str(name) for name in found.summary.index[np.isinf(found.summary["autocorrelation_time"])]]
        findings.append(
            Finding(
                "warning",
                "posterior-drifts",
                f"After {found.steps} steps the walkers still run apart in {listed(apart)}: it has not settled.",
                "posterior",
                "Allow more steps (posterior_steps); bound or fix these parameters, or give them a prior.",
            )
        )
    elif not found.long_enough:
        findings.append(
            Finding(
                "warning",
                "posterior-short",
                f"The sample of the posterior is too short to rely on: {found.steps} steps hold {found.times:.0f} "
                f"autocorrelation times, and {ENOUGH_TIMES:.0f} are needed.",
                "posterior",
                "Allow more steps (posterior_steps); fix, bound or give a prior to what is not identifiable.",
            )
        )
    if inflation > _WIDER:
        findings.append(
            Finding(
                "warning",
                "posterior-narrow",
                f"The posterior takes the residuals as white, which they are not: its intervals are narrower than the "
                f"linear ones, by a factor of about {inflation:.2g}.",
                "posterior",
                "Rely on the linear intervals, and on the posterior for the shape alone.",
            )
        )
    return findings
