"""What evidence counts for: it is divided by a temperature, since no effect has exactly the form that it is given.

An effect of another form than reality's leaves a part of its signature unexplained. Rivals that stand in its place may
explain all of that part, so the temperature by which sets are compared grows with what the best of them explains. A
further effect beside it has a signature of its own, to which what is left of the first one hardly has a likeness. So
evidence that no set of fewer effects reaches counts at a lower temperature: of what these sets explain, only the part
`beside` enters it. What two effects explain that one effect explains as well counts as it does for the one. An error of
a sensor of another form leaves marks in the channels of that sensor alone, which what acts on the vehicle cannot
explain, nor an error of another sensor: beside it, nothing of what it explains enters the temperature of these. Of sets
with as many effects, none counts for less for that than one which explains less.

Where missing forces explain most of what a set does, they would show most of what its form leaves as well
(`form_limit`). A rival cannot gain more than that from the form, so that what it is further behind counts in full.

An error of a sensor moves what that sensor says, and not the vehicle. Where missing forces stand beside other effects,
they show what the form of these leaves, since they move all sensors alike. What an error of a sensor explains beside
more than it does itself, beyond what forces do not show, counts at a temperature of its own (`errors_beside_forces`).
So does what an actuator or a weight explains beside a current: what the current's form leaves keeps its direction on
the earth, and over courses all round pushes to no side of the vehicle.

Of two causes that push in the same way and differ only in how strongly at each angle, neither form is known well enough
to be told from the other by the few nats that a wrong form costs (`in_another_form`).

A temperature of 1 + m is what follows where the nats that a form leaves have an exponential distribution of mean m: a
rival that is d nats behind then wins with a probability of the order of exp(-d / (1 + m)). The limit cuts that
distribution off.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence

import numpy as np

from seatruth.arrays import Array, Flags, Indices


def tempered_deviation(deviation: Array, prior: Array, temperature: Array | float) -> Array:
    """Posterior standard deviations, with what the data say divided by a temperature as evidence is.

    Evidence and sizes rest on the same likelihood: where it is too sure of the one, it is too sure of the other. On 48
    development cases the intervals without it held 6 of 11 sizes, and with it 10.

    Args:
        deviation: posterior standard deviations (n,); 0 for what is fixed.
        prior: prior standard deviations (n,), which no tempered one exceeds.
        temperature: divides the information of the data, 1 or more, for all or for each (n,).

    Example:
        >>> import numpy as np
        >>> tempered_deviation(np.array([0.1, 1.0, 0.0]), np.array([10.0, 1.0, 1.0]), 4.0).round(3)
        array([0.2, 1. , 0. ])
    """
    known = deviation > 0.0
    found = np.zeros_like(deviation)
    from_prior = prior[known] ** -2.0
    from_data = np.maximum(deviation[known] ** -2.0 - from_prior, 0.0)
    found[known] = (from_data / np.broadcast_to(temperature, deviation.shape)[known] + from_prior) ** -0.5
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
    by_sensors: tuple[Array, Indices] | None = None,
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
        by_sensors: what errors of sensors among the effects of each hypothesis explain by themselves, see
            `sensors_alone`; None where there are none.

    Example:
        >>> import numpy as np
        >>> evidence, counts = np.array([0.0, 60.0, 100.0]), np.array([0, 1, 2])
        >>> tempered(evidence, counts, 0.0, temperature=2.0, model_form=0.02, beside=0.0).round(2)
        array([ 0.  , 15.  , 29.29])
    """
    top = max(float(evidence.max()), lowest)
    last = np.full(len(evidence), temperature + model_form * (top - lowest + max(0.0, ahead)))
    found: Array = evidence / last
    sensed, sensors = by_sensors or (np.full(len(evidence), -math.inf), counts)
    for number in range(2, int(counts.max()) + 1):
        reached = max(float(evidence[counts < number].max(initial=lowest)), lowest)
        apart = np.where(sensors < number, np.clip(sensed - lowest, 0.0, reached - lowest), 0.0)
        explained = beside * (reached - lowest - apart) + top - reached + max(0.0, ahead)
        now = temperature + model_form * explained
        above = np.where(counts >= number, np.maximum(evidence - reached, 0.0), 0.0)
        found += above * (1.0 / now - 1.0 / last)
        last = now
        found = _in_order(found, evidence, (counts == number) & (above > 0.0), now)
    return found


def _in_order(found: Array, evidence: Array, those: Flags, temperature: Array) -> Array:
    """Tempered evidence (H,) in which none of those sets, of as many effects, is behind one that explains less.

    What a set explains more may be what the form of its first effect leaves, and counts at its temperature (H,). But it
    is no reason to put it behind: it explains what the other does.
    """
    rows = np.flatnonzero(those)
    ahead = evidence[rows][:, None] - evidence[rows][None, :]
    least = np.where(ahead >= 0.0, found[rows][None, :] + ahead / temperature[rows][:, None], -math.inf)
    found = found.copy()
    found[rows] = np.maximum(found[rows], least.max(axis=1, initial=-math.inf))
    return found


def sensors_alone(
    evidence: Array, keys: Sequence[tuple[str, ...]], sensors: Mapping[str, frozenset[str]]
) -> tuple[Array, Indices]:
    """Log-evidence (H,) nats of what leaves no marks where the rest of a hypothesis does, and how many effects that is.

    Of the effects of each hypothesis, that is the errors of sensors; where all are, those of one sensor beside those of
    others, of which the ones that explain most. -inf where there is no such part, or it was not fitted by itself.

    Args:
        evidence: log-evidence of the hypotheses (H,) nats.
        keys: their effects.
        sensors: the channels of each effect that is an error of a sensor.

    Example:
        >>> import numpy as np
        >>> keys = [("wind",), ("gyro_bias",), ("gyro_bias", "wind"), ("gyro_bias", "speed_bias")]
        >>> channels = {"gyro_bias": frozenset({"r"}), "speed_bias": frozenset({"u"})}
        >>> sensors_alone(np.array([1.0, 20.0, 28.0, 24.0]), keys, channels)
        (array([-inf, -inf,  20.,  20.]), array([0, 0, 1, 1]))
    """
    best: dict[tuple[str, ...], float] = {}
    for key, value in zip(keys, evidence.tolist()):
        best[key] = max(value, best.get(key, -math.inf))
    alone, counts = np.full(len(keys), -math.inf), np.zeros(len(keys), dtype=np.intp)
    for place, key in enumerate(keys):
        parts = [part for part in _apart(key, sensors) if part in best]
        if parts:
            chosen = max(parts, key=lambda part: best[part])
            alone[place], counts[place] = best[chosen], len(chosen)
    return alone, counts


def _apart(key: tuple[str, ...], sensors: Mapping[str, frozenset[str]]) -> list[tuple[str, ...]]:
    """Parts of a set that are errors of sensors and share no sensor with the rest of it."""
    own = tuple(name for name in key if name in sensors)
    if own != key:
        return [own] if own else []
    groups: list[set[str]] = []
    for name in key:
        near = [group for group in groups if any(sensors[name] & sensors[other] for other in group)]
        groups = [group for group in groups if group not in near] + [set().union({name}, *near)]
    return [tuple(name for name in key if name in group) for group in groups] if len(groups) > 1 else []


def form_limit(explained: float, by_forces: float, beside: float, unseen: float) -> float:
    """Nats that the form of a set of effects can leave to its rivals at most, as missing forces tell.

    Args:
        explained: log-evidence (nats) of the set, with forces or without, over the model alone.
        by_forces: that of forces without effects, over the model alone.
        beside: what forces add to the set, nats.
        unseen: nats of a wrong form that forces do not show, since they must pay for their freedom.

    Returns:
        Infinite where forces explain nothing of what the set does: then they would show nothing of its form either.

    Example:
        >>> round(form_limit(279.0, 262.0, beside=-2.0, unseen=6.0), 1)
        6.4
    """
    part = min(1.0, by_forces / explained) if explained > 0.0 else 0.0
    return (unseen + max(0.0, beside)) / part if part > 0.0 else math.inf


def beyond_the_form(
    found: Array, evidence: Array, apart: Flags, limit: float, temperature: float, against: Indices | None = None
) -> Array:
    """Tempered evidence with what no wrong form of the leader explains counted in full, (H,) nats.

    Args:
        found: tempered evidence (H,).
        evidence: the same before it was tempered, (H,).
        apart: whether a hypothesis has no effect of the leader's (H,): it is a rival, not the leader with another form.
        limit: nats that the form of the leader can leave to it, see `form_limit`.
        temperature: divides all evidence, whatever it is about.
        against: place of the hypothesis with which each is compared (H,); the best of all where None.

    Example:
        >>> import numpy as np
        >>> evidence = np.array([262.0, 279.0])
        >>> beyond_the_form(evidence / 16.0, evidence, np.array([True, False]), 6.4, 1.0).round(2)
        array([ 5.78, 17.44])
    """
    best, top = (evidence.max(), found.max()) if against is None else (evidence[against], found[against])
    behind, counts = np.maximum(best - evidence, 0.0), np.maximum(top - found, 0.0)
    full = np.minimum(counts + np.maximum(0.0, behind - limit), np.maximum(behind / temperature, counts))
    return np.where(apart & (behind > 0.0), np.minimum(found, top - full), found)


def errors_beside_forces(
    found: Array,
    evidence: Array,
    keys: Sequence[tuple[str, ...]],
    forces: Sequence[bool],
    sensors: Collection[str],
    unseen: float,
    temperature: float,
    model_form: float,
    *,
    on_board: Collection[str] = (),
    currents: Collection[str] = (),
) -> Array:
    """Tempered evidence (H,) nats in which what acts on the vehicle heats no error of a sensor beside it and forces.

    Of a boat in a short sea, whose drift explained 290 nats, a gyro 0.4 deg/s off explained 32 more, and had the same
    probability as none. Where the error explains more than the rest it leads, and the rest is what stands beside it: of
    a ship on a pond whose late position explained 83 nats, a drift that had been fitted alone was certain beside that,
    and a current that had not, 0.9 nats behind, impossible.

    Nor do currents heat what turns with the vehicle. Of a ship in a current, which explained 820 nats, a rudder 1.6 deg
    off explained 196 more, and had less than even odds.

    What stands beside a raised set is raised with it. No set of as many errors of sensors that explains more is behind
    one that is raised, nor any set behind one that stands on a current: of an ROV in a current a thruster beside that
    was certain, which did not act, and a line that pulled at it, 40 nats ahead, impossible.

    Args:
        found: tempered evidence (H,).
        evidence: the same before it was tempered, (H,).
        keys: the effects of each hypothesis.
        forces: whether missing forces stand beside them.
        sensors: the effects that are errors of sensors.
        unseen: nats of a wrong form that forces do not show.
        temperature: divides all evidence, whatever it is about.
        model_form: is added to it for each nat that the error of the sensor explains.
        on_board: effects that turn with the vehicle.
        currents: effects that keep their direction on the earth, of an exact form, where courses lie all round.

    Example:
        >>> import numpy as np
        >>> keys = [("wave_drift",), ("gyro_bias", "wave_drift"), ("gyro_bias",)]
        >>> evidence = np.array([290.0, 322.0, 30.0])
        >>> errors_beside_forces(evidence / 16.0, evidence, keys, [True] * 3, {"gyro_bias"}, 5.7, 1.0, 0.05).round(1)
        array([18.1, 28.2,  1.9])
    """
    raised, places, best = found.copy(), dict[tuple[str, ...], int](), dict[tuple[str, ...], float]()
    for place, (key, on) in enumerate(zip(keys, forces, strict=True)):
        best[key] = max(float(evidence[place]), best.get(key, -math.inf))
        if on:
            places[key] = place
    many = np.array([len(key) for key in keys], dtype=np.intp)
    of_sensors = np.array([{*key} <= {*sensors} for key in keys], dtype=np.bool_)
    above, on_currents = np.zeros((2, len(keys)), dtype=np.bool_)
    alone = evidence[many == 0]
    lowest = float(alone.max() if alone.size else evidence.min())
    heat = temperature + model_form * max(0.0, float(evidence.max()) - lowest)
    # The fewer effects first: what is raised there, what stands beside it is raised from.
    for number in np.unique(many):
        for key, place in places.items():
            for name in key if len(key) == number else ():
                rest = places.get(tuple(other for other in key if other != name), -1)
                if rest >= 0 and raised[rest] > found[rest] and evidence[place] > evidence[rest]:
                    # A further effect counts beside what was raised for what it did before.
                    raised[place] = max(raised[place], raised[rest] + max(0.0, found[place] - found[rest]))
                    on_currents[place] |= on_currents[rest]
                apart = name in sensors or (name in on_board and {*key} - {name} <= {*currents})
                if not apart or len(key) < 2 or rest < 0:
                    continue
                if (name,) in places and evidence[places[name,]] > evidence[rest]:
                    continue
                gain = float(evidence[place]) - best[keys[rest]]
                # What explains less than its part is behind it in full.
                counts = min(gain, 0.0) + max(0.0, gain - unseen) / (temperature + model_form * max(0.0, gain))
                on_currents[place] |= name not in sensors and raised[rest] + counts > raised[place]
                raised[place] = max(raised[place], raised[rest] + counts)
        above |= (raised > found) & (many == number)
        rows, less = np.flatnonzero(many == number), np.flatnonzero((many == number) & above)
        ahead = evidence[rows][:, None] - evidence[less][None, :] - unseen
        # What acts on the vehicle may take the form of what stands beside an error of a sensor, and stays behind it.
        comes = (ahead > 0.0) & (of_sensors[rows][:, None] | on_currents[less][None, :])
        least = np.where(comes, raised[less][None, :] + ahead / heat, -math.inf)
        raised[rows] = np.maximum(raised[rows], least.max(axis=1, initial=-math.inf))
        on_currents[rows] |= (comes & on_currents[less][None, :]).any(axis=1)
    for place, (key, on) in enumerate(zip(keys, forces)):
        # The same set without forces, which needs them not, is behind it by no more than its evidence.
        if not on and key in places and above[places[key]]:
            ahead_of_it = float(evidence[place] - evidence[places[key]])
            raised[place] = max(raised[place], raised[places[key]] + ahead_of_it / (heat if ahead_of_it > 0.0 else 1.0))
    return raised


def in_another_form(found: Array, evidence: Array, forms: Sequence[Sequence[int]], unseen: float) -> Array:
    """Tempered evidence (H,) nats in which what a wrong form costs tells no form from another.

    Args:
        found: tempered evidence (H,).
        evidence: the same before it was tempered, (H,).
        forms: for each hypothesis, the places of those that hold another form of the same force instead.
        unseen: nats that a wrong form costs.

    Example:
        >>> import numpy as np
        >>> evidence = np.array([30.0, 25.0, 10.0])
        >>> in_another_form(evidence / 2.0, evidence, [[1, 2], [0, 2], [0, 1]], 6.0).round(2)
        array([15., 15.,  8.])
    """
    raised = found.copy()
    for place, others in enumerate(forms):
        for other in others:
            ahead = float(evidence[other] - evidence[place])
            if ahead > 0.0:
                counts = float(found[other] - found[place]) * max(0.0, ahead - unseen) / ahead
                raised[place] = max(raised[place], found[other] - counts)
    return raised
