"""What a finished search comes to: the decision, and what it is judged by.

The most probable answer is proposed, and asked for what it closes of the gap and what it predicts of trials left out.
Where runs stray, evidence says little, since the missing forces of each trial hold them near their records: an answer
that does not surely close a part of the gap on trials left out gives way to another one that does.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property, partial

from seatruth.arrays import Array
from seatruth.diagnosis import posterior
from seatruth.diagnosis.clusters import Cluster
from seatruth.diagnosis.cross_validation import predictive_gains, surely_positive, validate
from seatruth.diagnosis.decision import SURELY, Decision, decide
from seatruth.diagnosis.drift_in_turns import without_drift
from seatruth.diagnosis.equally_late import equally_late, without_equally_late
from seatruth.diagnosis.fit import without_discrepancy
from seatruth.diagnosis.gap import Gap, misfit
from seatruth.diagnosis.hypotheses import Key, Search
from seatruth.diagnosis.hypothesis_fits import ensure
from seatruth.diagnosis.information import Information
from seatruth.diagnosis.late_or_drifting import drifting
from seatruth.diagnosis.other_forms import hull_forms_in, standing_beside
from seatruth.diagnosis.outdone import without_hindering, without_outdone
from seatruth.diagnosis.parts import Validation
from seatruth.diagnosis.practical_size import without_negligible, without_small, without_tiny
from seatruth.diagnosis.prediction_errors import noise_deviation
from seatruth.diagnosis.sensor_errors import errors_of_sensor
from seatruth.diagnosis.shared_directions import is_shared
from seatruth.diagnosis.size_errors import beyond_belief, is_sure, is_told
from seatruth.diagnosis.sizes import is_no_noise
from seatruth.diagnosis.verdict import Hypothesis
from seatruth.diagnosis.withdrawals import (
    closed,
    without_disputed,
    without_leaning,
    without_little,
    without_opposed,
    without_taken_for_noise,
    without_unseen,
    without_unsure,
    without_untried,
    without_vague,
)
from seatruth.effects.each_trial import EachTrial
from seatruth.trials.check.excitation import narrow_headings


def _silent(_message: str, _done: int, _total: int) -> None:
    """Says nothing."""


class Judgement:
    """Decides on a finished search. `say` is told of trials that are left out."""

    def __init__(self, search: Search) -> None:
        self.search, self.problem, self.settings = search, search.problem, search.problem.settings
        self.weighed = posterior.hypotheses(search, self.settings)
        """The hypotheses with their probabilities, before anything is decided."""
        self.information = Information(search)
        self.say: Callable[[str, int, int], None] = _silent
        self._gains, self._gaps = dict[tuple[str, Key], Array](), dict[Key, Gap]()
        self.validations: dict[Key, Validation | None] = {}

    @cached_property
    def decision(self) -> Decision:
        """What is said."""
        said = self._proposed(self.weighed)
        if not self._leaves_a_gap:  # nothing is small beside a gap that is noise
            said = self._fitted(without_unseen(said, self.weighed, self.problem.effects), said)
            said = self._fitted(without_vague(said, self.weighed), said)
            said = self._fitted(self._told(said), said)
            return self._fitted(self._but_drift(said), said)
        said = self._closing(said)
        while said.clusters:
            left = self._predicting(said)
            if left.clusters != said.clusters:
                left = without_unsure(left, self.weighed, self._helps)
            doubtful = beyond_belief(self.problem, self.search.beside(left.shown, self.beside), left.shown)
            left = self._fitted(without_leaning(left, self.weighed, doubtful, self.settings), left)
            if left.clusters == said.clusters:
                return left
            said = left
        return said

    def _proposed(self, found: Sequence[Hypothesis]) -> Decision:
        """What these hypotheses lead to, less what is too small to be the cause."""
        said = decide(
            found,
            self.problem.effects,
            self.settings,
            near=self.information.noncentrality_between,
            helps=self._helps,
            underpowered=len(self.information.undetectable()) > len(self.problem.effects) // 2,
            converged=self.search.null.settled,
            gap=self._leaves_a_gap,
            one_course=narrow_headings(self.problem.trials) is not None,
        )
        said = without_opposed(said, found)
        equal = equally_late(self.problem, self.search.best(said.shown), self.problem.effects, said.shown)
        said = self._fitted(without_equally_late(said, found, equal), said)
        gap, size = self.gap_of(said.shown), partial(self.size, key=said.shown)
        said = self._fitted(without_tiny(said, found, gap, size, self.settings, gap=self._leaves_a_gap), said)
        if not self._leaves_a_gap:
            return said
        gap = self.gap_of(said.shown)
        return self._fitted(without_small(said, found, self.problem.effects, gap, self.settings), said)

    def _closing(self, said: Decision) -> Decision:
        """The decision, or where runs stray and it closes nothing surely, another one that does on trials left out.

        That is the answer less a cause that hinders the others, or the answer of the hypotheses that remain once its
        own set is put aside, if they are not too improbable together. Of a river vessel whose rudders lagged behind
        their order by a play in one direction alone, the play had 98 %, and made trials left out worse by 6 % of the
        gap; with the offset that comes with it, 29 nats more of evidence, they were closed by 55 % (12 to 97 %).
        """
        whole = self.validated(said.shown) if said.clusters and self.gap_of(said.shown).strays else None
        if whole is None or whole.lower > 0.0:
            return said
        fewer = without_hindering(said, self.weighed, self.validated, self.search.best)
        if fewer is not said:
            return fewer
        aside = [{*key} for key in (said.shown, *self._alike(said))]
        forms = {*hull_forms_in(list(self.problem.effects), self.problem.effects)} - {*said.shown}
        left = [one for one in self.weighed if {*one.effects} - forms not in aside]
        total = sum(one.probability for one in left)
        if total < SURELY:
            return said
        other = self._proposed([replace(one, probability=one.probability / total) for one in left])
        other = without_hindering(other, self.weighed, self.validated, self.search.best)
        closing = self.validated(other.shown) if other.clusters else None
        return said if closing is None or not closing.lower > 0.0 or closed(closing) < closed(whole) else other

    def _alike(self, said: Decision) -> list[Key]:
        """The sets of a decision by any of the effects of its causes."""
        return [tuple(sorted({*key})) for key in itertools.product(*(one.effects for one in said.clusters))]

    def _fitted(self, said: Decision, before: Decision) -> Decision:
        """The decision, with what is left of an earlier one fitted."""
        if said.shown and self.search.best(said.shown) is None:
            ensure(self.search, said.shown, self.gap_of(before.shown).shown)
        return said

    def _predicting(self, said: Decision) -> Decision:
        """The same as `_judged`, where a cause may stand by another of its effects than the leading one."""
        tried = []
        keys = [said.shown, *self._alike(said)]
        for key in dict.fromkeys(key for key in keys if self.search.best(key) is not None or key == said.shown):
            tried.append(self._judged(replace(said, shown=key)))
            if len(tried[-1].clusters) == len(said.clusters):
                return tried[-1]
        return self._fitted(tried[0], said)

    def _judged(self, said: Decision) -> Decision:
        """The decision less what trials left out are predicted better without."""
        gap, found, effects = self.gap_of(said.shown), self.weighed, self.problem.effects
        fit = self.search.beside(said.shown, self.beside) if gap.strays else None
        shared = [name for name in said.shown if fit is not None and is_shared(self.search, name, fit, self.gains)]
        shows = partial(errors_of_sensor, self.search)
        left = without_outdone(said, found, effects, self.validated, gap.moved_by, shared, shows, strays=gap.strays)
        left = without_untried(left, found, effects, self.validated, forces=self.problem.discrepancy is not None)
        if gap.strays and left.shown == said.shown:
            left = without_negligible(left, found, effects, self.validated, gap, self.settings, shows)
        fit = self.search.beside(left.shown, self.beside)
        sure = [name for name in left.shown if fit is None or is_sure(self.problem, fit, name)]
        left = without_disputed(left, found, effects, sure, self.validated)

        def agreed(name: str) -> bool:
            """Whether each trial left out is predicted better with it."""
            gains = () if fit is None else self.gains(name, fit.effects)
            return len(gains) > 0 and all(gain > 0.0 for gain in gains)

        left = self._but_drift(without_little(left, found, gap.share, self.validated, agreed))
        if not self.noise_is_motion or not left.shown:
            return left
        return without_taken_for_noise(left, found, [name for name in left.shown if agreed(name)], self.validated)

    def _told(self, said: Decision) -> Decision:
        """The decision less what trials disagree about so far that its reported size may be none."""
        fit = self.search.best(said.shown)
        if not said.clusters or fit is None:
            return said
        told = [name for name in said.shown if is_told(self.problem, fit, name)]
        left = without_disputed(said, self.weighed, self.problem.effects, told, self.validated)
        return left if left.clusters == said.clusters else without_unsure(left, self.weighed, self._helps)

    def _but_drift(self, said: Decision) -> Decision:
        """The decision less what a vehicle that drifts otherwise in turns than its model shows as well."""
        like = drifting(self.search, self.search.beside(said.shown, self.beside), said.shown)
        return without_drift(said, self.weighed, like, self.validated)

    def _helps(self, name: str, key: Key) -> bool:
        """Whether an effect of a set has a size that can be told from none, and predicts trials left out."""
        fit = self.search.best(key)
        if fit is None:
            whole = self.search.best(self._leading)
            fit = None if whole is None else ensure(self.search, key, whole)
        if fit is None or fit.significance(self.problem, name) < self.settings.least_noncentrality:
            return False
        return surely_positive(self.gains(name, key), self.settings.significance, meets_noise=not self._leaves_a_gap)

    @cached_property
    def _leading(self) -> Key:
        return posterior.leading(posterior.answers(self.weighed), self.problem.effects)

    @cached_property
    def beside(self) -> Key:
        """Effects of the leading set beside which the answer has its sizes, named or not."""
        return standing_beside(self._leading, self.problem.effects)

    @cached_property
    def noise_is_motion(self) -> bool:
        """Whether the best fit takes motion for noise."""
        forces = self.problem.discrepancy is not None
        return is_no_noise(self.search.leader.sizes, self.search.known, self.settings, forces=forces)

    @cached_property
    def _leaves_a_gap(self) -> bool:
        """Whether the refitted model without discrepancy leaves more than noise.

        What is taken for noise hides the gap where no missing forces can be tried.
        """
        plain = self.search.fits.get(((), False))
        if plain is None or (self.problem.discrepancy is None and self.noise_is_motion):
            return True
        left = misfit(self.problem, self.deviation, without_discrepancy(self.problem, plain.point))
        return left > self.settings.gap * self.problem.count

    @cached_property
    def deviation(self) -> Array:
        """Standard deviation of each channel's noise (C,)."""
        return noise_deviation(self.problem, self.information.at.sizes)

    # What it is judged by

    def gains(self, name: str, key: Key) -> Array:
        """Log predictive density of trials left out, with an effect of a set less without it."""
        if (name, key) not in self._gains:
            self._gains[name, key] = predictive_gains(self.search, name, key)
        return self._gains[name, key]

    def gap_of(self, key: Key) -> Gap:
        """What is left between the models and the trials, with a set of effects."""
        if key not in self._gaps:
            self._gaps[key] = Gap(self.search, self.deviation, key, self.beside)
        return self._gaps[key]

    def size(self, cluster: Cluster, key: Key) -> float:
        """How large a cause of a set is, over a typical one: the largest of its effects, each in the others' place."""
        shown = cluster.member_in(key)
        places = {name: tuple(sorted(name if one == shown else one for one in key)) for name in cluster.effects}
        fitted = {name: place for name, place in places.items() if self.search.best(place) is not None}
        return max((self.gap_of(place).typical_sizes(name) for name, place in fitted.items()), default=math.inf)

    def validated(self, key: Key) -> Validation | None:
        """What trials left out say of a set."""
        if key not in self.validations:
            self.validations[key] = validate(self.search, key, self.say, beside=self.beside)
        return self.validations[key]

    def reported(self, key: Key) -> Validation | None:
        """The same, where a size that an effect has in each trial alone is not left open."""
        if any(isinstance(self.problem.effects[name], EachTrial) for name in key):
            return validate(self.search, key, self.say, beside=self.beside, own=True)
        return self.validated(key)

    def validation(self, say: Callable[[str, int, int], None]) -> Validation | None:
        """What trials left out say of the decision, told as it goes."""
        self.say = say  # the decision may ask for it first
        try:
            return self.reported(self.decision.shown)
        finally:
            self.say = _silent
