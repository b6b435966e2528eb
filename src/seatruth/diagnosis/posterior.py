"""From evidence to probabilities: hypotheses are sets of effects, with and without model discrepancy beside them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from seatruth.arrays import Array, Flags, Indices
from seatruth.diagnosis.fit import Fit
from seatruth.diagnosis.hypotheses import Key, Search
from seatruth.diagnosis.other_forms import hull_forms_in, seas_in
from seatruth.diagnosis.settings import Settings
from seatruth.diagnosis.tempering import (
    beyond_the_form,
    errors_beside_forces,
    form_limit,
    in_another_form,
    sensors_alone,
    tempered,
)
from seatruth.diagnosis.verdict import Hypothesis
from seatruth.effects import Effect
from seatruth.effects.causes import ancestors, is_within, parent
from seatruth.trials.trial import Trial

_NEGLIGIBLE = 1e-3
"""Probability up to which a cause or a place is not listed: 0.1 %, the last digit that is shown."""

ENVIRONMENT = "environment"
"""Family of causes that are weather, and may differ from trial to trial."""
FIXED_TO_EARTH = "environment.force_fixed_to_earth"
"""Family of forces that push the same way, each as strongly at an angle as the one that published it found."""
MOVING_WATER = "environment.moving_water"
"""Family of causes that move the water over the ground."""
_ON_BOARD = ("actuator", "loading")
_ROUND = 0.5
"""Length of the mean of the headings' unit vectors up to which they lie all round. [S] Two courses a third of a turn
apart have 0.5."""
SENSOR = "sensor"
"""Family of causes that change what a sensor says of the motion, and not the motion."""


def hypotheses(search: Search, settings: Settings) -> list[Hypothesis]:
    """Every hypothesis with its probability, the most probable first.

    Effects that were not fitted take part with their linearized evidence, so that they keep their share, and so does
    the model alone with forces where it was not fitted.
    """
    base = search.null.evidence
    rows: list[tuple[Key, bool, float, bool, bool]] = [
        (key, on, found.evidence - base, found.settled, True) for (key, on), found in search.fits.items()
    ]
    fitted = {key for key, _ in search.fits}
    rows += [
        (key, on, value - base, False, False)
        for (key, on), value in search.screened.items()
        if (key, on) not in search.fits
        and (not key or (len(key) == 1 and (on or key not in fitted)))
        and math.isfinite(value)
        # Linearized, a few per cent of what acts wholly or not at all take the shape of anything.
        and not any(search.problem.effects[name].wholly for name in key)
    ]
    many = len(search.problem.effects)
    priors = [log_prior(causes_in(key, search.problem.effects), on, many, settings) for key, on, *_ in rows]
    gains = np.array([gain for _, _, gain, *_ in rows])
    sets = [(key, on) for key, on, *_ in rows]
    weight = counted(search, gains, sets, explained_from(search) - base) + priors
    weight = np.exp(weight - weight.max())
    weight /= weight.sum()
    found = [
        Hypothesis(key, on, gain, prior, float(p), settled, fitted)
        for (key, on, gain, settled, fitted), prior, p in zip(rows, priors, weight)
    ]
    return sorted(found, key=lambda one: (-one.probability, -one.log_evidence, one.effects, one.discrepancy))


def explained_from(search: Search) -> float:
    """Log-evidence (nats) from which it is counted what effects explain: that of the model alone.

    With discrepancy where the leader has it: what discrepancy explains does not depend on the form of any effect. Nor
    does, next to other effects of the leader, what a term explains beside it that stands for another form of the hull,
    or what a sea does, which shows by its waves: of an AUV whose planes were off, 42 nats counted as 1.7 beside the 392
    of a cross-flow drag; of a boat whose thruster gave 12 % less, 375 counted as 5 beside the 1370 of waves and drift.
    """
    leader, effects = _leader(search), search.problem.effects
    alone = search.fits.get(((), leader.discrepancy)) or search.null
    if not leader.discrepancy:
        return alone.evidence
    form = {*hull_forms_in(leader.effects, effects), *seas_in(leader.effects, effects)}
    others = (fit for (key, on), fit in search.fits.items() if on and {*key} <= form < {*leader.effects})
    return max((fit.evidence for fit in others), default=alone.evidence)


def counted(search: Search, evidence: Array, sets: Sequence[tuple[Key, bool]], lowest: float) -> Array:
    """What the log-evidence (H,) of hypotheses, of such effects, with forces or not, counts for.

    What the leader's fit did not reach counts as explained: where long runs bend, the evidence is that of a straight
    line through a point. `lowest` as in `tempered`.
    """
    settings, leader, keys = search.problem.settings, _leader(search), [key for key, _ in sets]
    sensors = errors_of_sensors(search.problem.effects)
    found = tempered(
        evidence,
        np.array([len(key) for key in keys], dtype=np.intp),
        lowest,
        temperature=settings.temperature,
        model_form=settings.model_form,
        beside=settings.form_beside,
        ahead=leader.ahead,
        by_sensors=sensors_alone(evidence, keys, sensors),
    )
    apart, against = rivals(leader.effects, keys, evidence, search.problem.effects)
    found = beyond_the_form(found, evidence, apart, _left_by_the_form(search, leader), settings.temperature, against)
    heat = settings.unseen_form, settings.temperature, settings.model_form
    found = errors_beside_forces(
        found, evidence, keys, [on for _, on in sets], sensors, *heat, on_board=on_board(search.problem.effects),
        currents=currents(search.problem.effects) if all_round(search.problem.trials) else (),
    )  # fmt: skip
    return in_another_form(found, evidence, _other_forms(keys, search.problem.effects), settings.unseen_form)


def without_other_forms(names: Iterable[str], effects: Mapping[str, Effect]) -> list[str]:
    """These effects, each once, of steady forces fixed to the earth the first: their forms alone tell others from it.

    Example:
        >>> from seatruth.effects import available
        >>> without_other_forms(["wave_drift", "current", "wind", "trial_wind"], available())
        ['wave_drift', 'current', 'trial_wind']
    """
    found: dict[str, str] = {}
    for name in names:
        one = effects[name]
        form = f"{FIXED_TO_EARTH} {one.each_trial}" if is_within(one.cause, FIXED_TO_EARTH) else name
        found.setdefault(form, name)
    return list(found.values())


def _other_forms(keys: Sequence[Key], effects: Mapping[str, Effect]) -> list[list[int]]:
    """For each set, the places of those with another steady force fixed to the earth in the place of its own."""
    forces = [name for name, one in effects.items() if is_within(one.cause, FIXED_TO_EARTH)]
    places: dict[Key, list[int]] = {}
    for place, key in enumerate(keys):
        places.setdefault(key, []).append(place)
    found: list[list[int]] = []
    for key in keys:
        own = [name for name in key if name in forces]
        others = [
            tuple(sorted({*key, other} - {name}))
            for name in own
            for other in forces
            if other not in key and effects[other].each_trial == effects[name].each_trial
        ]
        found.append([place for other in others for place in places.get(other, ())])
    return found


def errors_of_sensors(effects: Mapping[str, Effect]) -> dict[str, frozenset[str]]:
    """The sensors on which each effect acts that is an error of one, by its cause: {"gyro_bias": {"sensor:r"}}."""
    return {name: frozenset(one.acts_on) for name, one in effects.items() if is_within(one.cause, SENSOR)}


def on_board(effects: Mapping[str, Effect]) -> list[str]:
    """The effects that turn with the vehicle whatever flows past it: those of actuators and of the loading."""
    return [name for name, one in effects.items() if any(is_within(one.cause, cause) for cause in _ON_BOARD)]


def currents(effects: Mapping[str, Effect]) -> list[str]:
    """The effects by which the water moves over the ground."""
    return [name for name, one in effects.items() if is_within(one.cause, MOVING_WATER)]


def all_round(trials: Iterable[Trial]) -> bool:
    """Whether headings lie all round, so that what keeps its direction on the earth pushes to no side of the vehicle.

    Example:
        >>> import numpy as np
        >>> t = np.arange(9.0)
        >>> legs = [Trial(f"{k}", t, {}, {"psi": np.full(9, float(k))}) for k in (0, 2, 4)]
        >>> all_round(legs), all_round(legs[:2])
        (True, False)
    """
    recorded = [np.exp(1j * np.asarray(trial.outputs["psi"])) for trial in trials if "psi" in trial.outputs]
    if not recorded:
        return False
    headings = np.concatenate(recorded)
    return bool(abs(headings[np.isfinite(headings)].mean()) < _ROUND)


def rivals(
    leader: Key, keys: Sequence[Key], evidence: Array, effects: Mapping[str, Effect]
) -> tuple[Flags, Indices | None]:
    """Which hypotheses (H,) lack all causes of the leading set, and the place of that with which each is compared.

    Terms that stand for another form of the hull, and a sea, are no causes that two sets may have in common, where the
    leader has others. Each set is compared with the best one that has the leader's causes beside the same form: of an
    AUV whose rudder stood 1.5 deg off, cross-flow drag alone was 363 nats behind that offset beside it, and had 20 %
    with its twin, and an asymmetry that was 4.5 nats behind the offset by itself had nothing. A set of fewer effects is
    compared with the best part of the leader that has no more: what stands beside the leader could stand beside it as
    well. None for the places where the leader has no form and one cause: then each is compared with the best of all.

    Example:
        >>> import numpy as np
        >>> from seatruth.effects import available
        >>> keys = [("cross_flow", "rudder_offset"), ("rudder_offset",), ("cross_flow",), ("asymmetry",)]
        >>> rivals(keys[0], keys, np.array([358.0, 278.0, -5.0, 274.0]), available())
        (array([False, False,  True,  True]), array([0, 0, 0, 1]))
        >>> keys = [("gyro_bias", "rudder_offset"), ("rudder_offset",), ("gyro_bias",), ("propeller_walk",)]
        >>> rivals(keys[0], keys, np.array([358.0, 278.0, -5.0, 274.0]), available())
        (array([False, False, False,  True]), array([0, 0, 0, 1]))
    """
    parts = [frozenset(hull_forms_in(key, effects)) | frozenset(seas_in(key, effects)) for key in (leader, *keys)]
    own = {*leader} - parts[0] or {*leader}
    apart = np.array([not own & {*key} for key in keys], dtype=np.bool_)
    if own == {*leader} and len(own) == 1:
        return apart, None
    best = int(np.argmax(evidence))
    ranked: list[int] = np.argsort(-evidence, kind="stable").tolist()

    def against(place: int) -> int:
        form, most = parts[1 + place], max(1, len({*keys[place]} - parts[1 + place]))
        for other in ranked:
            causes = {*keys[other]} - form
            if parts[1 + other] == form and causes and causes <= own and len(causes) <= most:
                return other
        return best

    return apart, np.array([against(k) if far else best for k, far in enumerate(apart)], dtype=np.intp)


def _left_by_the_form(search: Search, leader: Fit) -> float:
    """Nats that the form of the leading set can leave to its rivals, as missing forces beside its effects tell."""
    forces, null = search.fits.get(((), True)), search.fits.get(((), False))
    # Where forces alone were not worth a fit, their linearized evidence stands for them.
    alone = forces.evidence if forces is not None else search.screened.get(((), True), -math.inf)
    beside = [
        fit.evidence + fit.ahead for (key, on), fit in search.fits.items() if on and key and {*key} <= {*leader.effects}
    ]
    if null is None or not beside:
        return math.inf
    without = search.fits.get((leader.effects, False), null).evidence
    unseen = search.problem.settings.unseen_form + max(0.0, leader.ahead)
    return form_limit(leader.evidence - null.evidence, alone - null.evidence, max(beside) - without, unseen)


def _leader(search: Search) -> Fit:
    return max(search.fits.values(), key=lambda fit: fit.evidence)


def causes_in(key: Key, effects: Mapping[str, Effect]) -> int:
    """How many causes a set of effects is: what comes with another of them has no cause of its own.

    Example:
        >>> from seatruth.effects import available
        >>> causes_in(("current", "wave_drift", "wave_forces"), available())
        2
    """
    with_another = {other for name in key for other in effects[name].comes_with}
    return len(set(key) - with_another)


def log_prior(causes: int, discrepancy: bool, many: int, settings: Settings) -> float:
    """Logarithm of a hypothesis' prior probability, of so many causes among so many effects that can act."""
    if not causes:
        return math.log(settings.prior_unknown if discrepancy else settings.prior_none)
    share = settings.prior_sets[min(causes, len(settings.prior_sets)) - 1]
    beside = settings.prior_discrepancy if discrepancy else 1.0 - settings.prior_discrepancy
    return math.log(share * beside / max(1, math.comb(many, causes)))


def answers(found: Iterable[Hypothesis]) -> dict[Key, float]:
    """Probability of each set of effects that is not empty, discrepancy or not; the most probable first.

    Those that are as probable keep their order.
    """
    sums: dict[Key, float] = {}
    for one in found:
        if one.effects:
            sums[one.effects] = sums.get(one.effects, 0.0) + one.probability
    return dict(sorted(sums.items(), key=lambda entry: -entry[1]))


def leading(sets: Mapping[Key, float], effects: Mapping[str, Effect]) -> Key:
    """The set that leads: the most probable one, or with one effect more of a family that more probably acts than not.

    Where several effects of one family explain the same, each of their sets holds a part of the probability, and the
    set without any of them may stand before each. What is of one kind with a member, as a dead time is with a lag, may
    stand in its place, and is not one more. Empty where there is no set.

    Args:
        sets: probability of each set of effects, the most probable first.
        effects: by name.

    Example:
        >>> from seatruth.effects import available
        >>> sets = {("gyro_bias",): 0.4, ("gyro_bias", "wind"): 0.35, ("current", "gyro_bias"): 0.25}
        >>> leading(sets, available())
        ('gyro_bias', 'wind')
    """
    first: Key = next(iter(sets), ())
    while first:
        wider: dict[str, dict[Key, float]] = {}
        for key, p in sets.items():
            further = set(key) - set(first)
            if len(further) != 1 or len(key) != len(first) + 1:
                continue
            one = effects[further.pop()]
            if not any(_of_one_kind(one, effects[name]) for name in first):
                wider.setdefault(one.family, {})[key] = p
        group = max(wider.values(), key=lambda members: sum(members.values()), default={})
        if not sum(group.values()) > sets[first]:
            break
        first = next(iter(group))
    return first


def _of_one_kind(one: Effect, other: Effect) -> bool:
    """Whether two effects stand side by side in the tree of causes, and are of the same actuators or sensors."""
    if is_within(one.cause, SENSOR):  # whose leaves are the quantities that sensors show
        return one.cause == other.cause
    return parent(one.cause) == parent(other.cause) and one.which == other.which


def none_and_unknown(found: Iterable[Hypothesis]) -> tuple[float, float]:
    """Probabilities that nothing acts, and that only something acts that is not in the library."""
    found = list(found)
    none = sum(one.probability for one in found if not one.effects and not one.discrepancy)
    return none, sum(one.probability for one in found if not one.effects and one.discrepancy)


def inclusion(found: Iterable[Hypothesis], effects: Sequence[str]) -> dict[str, float]:
    """Probability that each effect acts, alone or with others."""
    sums = dict.fromkeys(effects, 0.0)
    for one in found:
        for name in one.effects:
            sums[name] += one.probability
    return sums


def by_cause(found: Iterable[Hypothesis], effects: Mapping[str, Effect]) -> dict[str, float]:
    """Probability that something acts, by node of the tree of causes; nodes above 0.1 %, the most probable first."""
    sums: dict[str, float] = {}
    for one in found:
        nodes = {node for name in one.effects for node in ancestors(effects[name].cause)} - {""}
        for node in nodes:
            sums[node] = sums.get(node, 0.0) + one.probability
    return _ranked(sums)


def by_place(found: Iterable[Hypothesis], places: Mapping[str, Sequence[str]]) -> dict[str, float]:
    """Probability that a named effect acts at each place; `places` by effect. The most probable first."""
    sums: dict[str, float] = {}
    for one in found:
        for place in {place for name in one.effects for place in places[name]}:
            sums[place] = sums.get(place, 0.0) + one.probability
    return _ranked(sums)


def _ranked(sums: Mapping[str, float]) -> dict[str, float]:
    """What is not negligible, the most probable first."""
    kept = {name: p for name, p in sums.items() if p > _NEGLIGIBLE}
    return dict(sorted(kept.items(), key=lambda entry: (-entry[1], entry[0])))
