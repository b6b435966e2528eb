"""What the search found, decided on and put together as a Diagnosis."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from seatruth.arrays import Array
from seatruth.diagnosis import posterior
from seatruth.diagnosis.clusters import Cluster
from seatruth.diagnosis.cross_validation import lower_bound, predictive_gains, surely_positive, validate
from seatruth.diagnosis.decision import Decision, decide
from seatruth.diagnosis.discrepancy.report import describe
from seatruth.diagnosis.drift_in_turns import without_drift
from seatruth.diagnosis.earth_directions import common_direction
from seatruth.diagnosis.experiment_design.select import HARDLY, next_trial, survivors, with_motion
from seatruth.diagnosis.fit import Fit, not_converged, without_discrepancy
from seatruth.diagnosis.gap import Gap, misfit
from seatruth.diagnosis.headline import headline
from seatruth.diagnosis.hypotheses import Key, Search
from seatruth.diagnosis.hypothesis_fits import ensure
from seatruth.diagnosis.information import Information
from seatruth.diagnosis.late_or_drifting import drifting
from seatruth.diagnosis.localization import by_channel, in_region, in_time, shares, whitened
from seatruth.diagnosis.other_forms import standing_beside, with_other_forms
from seatruth.diagnosis.outdone import without_hindering, without_outdone
from seatruth.diagnosis.parts import NextTrial, Validation
from seatruth.diagnosis.practical_size import is_certain_error, without_negligible, without_small, without_tiny
from seatruth.diagnosis.prediction_errors import noise_deviation
from seatruth.diagnosis.reported_noise import noise_of_channels
from seatruth.diagnosis.reported_sizes import refitted_coefficients, reported_fit
from seatruth.diagnosis.results import Diagnosis
from seatruth.diagnosis.sections import recorded
from seatruth.diagnosis.sensor_errors import errors_of_sensor
from seatruth.diagnosis.shared_directions import is_shared
from seatruth.diagnosis.size_errors import beyond_belief, is_sure, sizes_of
from seatruth.diagnosis.sizes import is_no_noise
from seatruth.diagnosis.sizes_in_words import effect_in_words, furthest, prior_deviations
from seatruth.diagnosis.verdict import EffectParameter, EffectResult, Hypothesis, NamedCause, Verdict, least_probable
from seatruth.diagnosis.withdrawals import (
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
from seatruth.effects import Effect
from seatruth.effects.causes import ROOT, title
from seatruth.effects.each_trial import EachTrial, are_one, follows_each_trial
from seatruth.provenance import provenance
from seatruth.study import Study
from seatruth.trials.check.excitation import narrow_headings
from seatruth.trials.finding import Finding
from seatruth.uncertainty.moved_coefficients import Coefficient

_LEADING = 8
"""Effects between which pairwise noncentralities are reported. [S]"""
_CONFUSED = 25.0
"""Pairwise noncentrality below which a report says that two effects are easily confused: z = 5."""
_VISIBLE = 9.0
"""Noncentrality of an effect itself from which that is asked: z = 3."""


def _silent(_message: str, _done: int, _total: int) -> None:
    """Says nothing."""


class Assembly:
    """Decides on a finished search, and describes it."""

    def __init__(self, study: Study, search: Search, seed: int) -> None:
        self.study, self.search, self.seed = study, search, seed
        self.problem, self.settings = search.problem, search.problem.settings
        self._weighed = posterior.hypotheses(search, self.settings)
        self.information = Information(search)
        self._gains, self._gaps = dict[tuple[str, Key], Array](), dict[Key, Gap]()
        self._validations: dict[Key, Validation | None] = {}
        self._say: Callable[[str, int, int], None] = _silent

    @cached_property
    def _beside(self) -> Key:
        """Effects of the leading set beside which the answer has its sizes, named or not."""
        return standing_beside(self._leading, self.problem.effects)

    @cached_property
    def _leading(self) -> Key:
        return posterior.leading(posterior.answers(self._weighed), self.problem.effects)

    @cached_property
    def hypotheses(self) -> list[Hypothesis]:
        """With their probabilities as the decision leaves them."""
        effects, said = self.problem.effects, self.decision
        waves = [name for name in said.small if follows_each_trial(effects[name])]
        shapes = said.refused if self._noise_is_motion else ()
        return with_other_forms(self._weighed, effects, [*said.outdone, *said.drift, *shapes, *waves])

    @cached_property
    def inclusion(self) -> dict[str, float]:
        """Probability that each effect acts, alone or with others."""
        return posterior.inclusion(self.hypotheses, list(self.problem.effects))

    @cached_property
    def decision(self) -> Decision:
        """What is said."""
        said = decide(
            self._weighed,
            self.problem.effects,
            self.settings,
            near=self.information.noncentrality_between,
            helps=self._helps,
            underpowered=len(self.information.undetectable()) > len(self.problem.effects) // 2,
            converged=self.search.null.settled,
            gap=self._leaves_a_gap,
            one_course=narrow_headings(self.problem.trials) is not None,
        )
        said = without_opposed(said, self._weighed)
        gap, size = self._gap_of(said.shown), partial(self._size, key=said.shown)
        said = self._fitted(without_tiny(said, self._weighed, gap, size, self.settings, gap=self._leaves_a_gap), said)
        if not self._leaves_a_gap:  # nothing is small beside a gap that is noise
            said = self._fitted(without_unseen(said, self._weighed, self.problem.effects), said)
            said = self._fitted(without_vague(said, self._weighed), said)
            return self._fitted(self._but_drift(said), said)
        gap = self._gap_of(said.shown)
        said = self._fitted(without_small(said, self._weighed, self.problem.effects, gap, self.settings), said)
        while said.clusters:
            left = self._predicting(said)
            if left.clusters != said.clusters:
                left = without_unsure(left, self._weighed, self._helps)
            doubtful = beyond_belief(self.problem, self.search.beside(left.shown, self._beside), left.shown)
            left = self._fitted(without_leaning(left, self._weighed, doubtful, self.settings), left)
            if left.clusters == said.clusters:
                return left
            said = left
        return said

    def _fitted(self, said: Decision, before: Decision) -> Decision:
        """The decision, with what is left of an earlier one fitted."""
        if said.shown and self.search.best(said.shown) is None:
            ensure(self.search, said.shown, self._gap_of(before.shown).shown)
        return said

    def _predicting(self, said: Decision) -> Decision:
        """The same as `_judged`, where a cause may stand by another of its effects than the leading one."""
        if self._gap_of(said.shown).strays:
            said = without_hindering(said, self._weighed, self._validated, self.search.best)
        alike = [cluster.effects for cluster in said.clusters]
        keys = [said.shown, *(tuple(sorted(key)) for key in itertools.product(*alike))]
        tried = []
        for key in dict.fromkeys(key for key in keys if self.search.best(key) is not None or key == said.shown):
            tried.append(self._judged(replace(said, shown=key)))
            if len(tried[-1].clusters) == len(said.clusters):
                return tried[-1]
        return self._fitted(tried[0], said)

    def _judged(self, said: Decision) -> Decision:
        """The decision less what trials left out are predicted better without."""
        gap, found, effects = self._gap_of(said.shown), self._weighed, self.problem.effects
        fit = self.search.beside(said.shown, self._beside) if gap.strays else None
        shared = [name for name in said.shown if fit is not None and is_shared(self.search, name, fit, self.gains)]
        shows = partial(errors_of_sensor, self.search)
        left = without_outdone(said, found, effects, self._validated, gap.moved_by, shared, shows, strays=gap.strays)
        left = without_untried(left, found, effects, self._validated, forces=self.problem.discrepancy is not None)
        if gap.strays and left.shown == said.shown:
            left = without_negligible(left, found, effects, self._validated, gap, self.settings, shows)
        fit = self.search.beside(left.shown, self._beside)
        sure = [name for name in left.shown if fit is None or is_sure(self.problem, fit, name)]
        left = without_disputed(left, found, effects, sure, self._validated)
        left = self._but_drift(without_little(left, found, gap.share, self._validated))
        if not self._noise_is_motion or not left.shown:
            return left
        each = {} if fit is None else {name: self.gains(name, fit.effects) for name in left.shown}
        agreed = [name for name, gains in each.items() if len(gains) and (gains > 0.0).all()]
        return without_taken_for_noise(left, found, agreed, self._validated)

    def _but_drift(self, said: Decision) -> Decision:
        """The decision less what a vehicle that drifts otherwise in turns than its model shows as well."""
        like = drifting(self.search, self.search.beside(said.shown, self._beside), said.shown)
        return without_drift(said, self._weighed, like, self._validated)

    @cached_property
    def _noise_is_motion(self) -> bool:
        """Whether the best fit takes motion for noise."""
        return is_no_noise(self.search.leader.sizes, self.search.known, self.settings)

    @cached_property
    def _leaves_a_gap(self) -> bool:
        """Whether the refitted model without discrepancy leaves more than noise."""
        plain = self.search.fits.get(((), False))
        if plain is None:
            return True
        left = misfit(self.problem, self._deviation, without_discrepancy(self.problem, plain.point))
        return left > self.settings.gap * self.problem.count

    def _helps(self, name: str, key: Key) -> bool:
        """Whether an effect of a set has a size that can be told from none, and predicts trials left out."""
        fit = self.search.best(key)
        if fit is None:
            whole = self.search.best(self._leading)
            fit = None if whole is None else ensure(self.search, key, whole)
        if fit is None or fit.significance(self.problem, name) < self.settings.least_noncentrality:
            return False
        return surely_positive(self.gains(name, key), self.settings.significance, meets_noise=not self._leaves_a_gap)

    def gains(self, name: str, key: Key) -> Array:
        """Log predictive density of trials left out, with an effect of a set less without it."""
        if (name, key) not in self._gains:
            self._gains[name, key] = predictive_gains(self.search, name, key)
        return self._gains[name, key]

    @cached_property
    def _deviation(self) -> Array:
        return noise_deviation(self.problem, self.information.at.sizes)

    @property
    def gap(self) -> Gap:
        """What is left between the models and the trials."""
        return self._gap_of(self.decision.shown)

    def _gap_of(self, key: Key) -> Gap:
        if key not in self._gaps:
            self._gaps[key] = Gap(self.search, self._deviation, key, self._beside)
        return self._gaps[key]

    def validation(self, say: Callable[[str, int, int], None]) -> Validation | None:
        """Each trial predicted from the others."""
        self._say = say  # the decision may ask for it first
        try:
            return self._reported(self.decision.shown)
        finally:
            self._say = _silent

    def _reported(self, key: Key) -> Validation | None:
        """What trials left out say of a set, where a size that an effect has in each trial alone is not left open."""
        if any(isinstance(self.problem.effects[name], EachTrial) for name in key):
            return validate(self.search, key, self._say, beside=self._beside, own=True)
        return self._validated(key)

    def _validated(self, key: Key) -> Validation | None:
        if key not in self._validations:
            self._validations[key] = validate(self.search, key, self._say, beside=self._beside)
        return self._validations[key]

    def suggestion(self, say: Callable[[str, int, int], None]) -> NextTrial:
        """The trial that best separates the causes that are left, with the motion that is expected of it."""
        names = survivors(self.decision.clusters, posterior.answers(self.hypotheses), self.problem.effects)
        fitted = {name: max(self.inclusion[name], HARDLY) for name in names if self.search.best((name,)) is not None}
        return with_motion(next_trial(self.search, fitted, say), self.problem, self.gap.points["effects"])

    def diagnosis(
        self,
        unavailable: Mapping[str, str],
        findings: list[Finding],
        validation: Validation | None,
        suggestion: NextTrial | None,
        outcome: dict[str, Any],
    ) -> Diagnosis:
        """All parts together. Where trials were left out to decide, that is reported, asked for or not."""
        if validation is None and self.decision.shown in self._validations:
            validation = self._reported(self.decision.shown)
        problem, points, misfits = self.problem, self.gap.points, self.gap.misfits
        fits = {"the model alone": self.search.null, "the answer": self.gap.shown}
        errors = whitened(problem, problem.errors(points["refit"]), self.information.at.sizes)
        split = shares(misfits["before"], misfits["refit"], misfits["effects"], problem.count)
        said, places = self.decision, {name: self._places(effect) for name, effect in problem.effects.items()}
        causes = tuple(self._named(cluster) for cluster in said.clusters)
        probability = least_probable(causes, said.probability)

        sentence = headline(
            self.search, self.study.model, said, causes, probability, split, validation, self._parameters
        )
        acting = list(dict.fromkeys(p for cluster in said.clusters for p in places[cluster.effects[0]]))
        return Diagnosis(
            study=self.study.name,
            model=self.study.model.name,
            synthetic=self.study.synthetic,
            seed=self.seed,
            verdict=Verdict(said.kind, causes, probability, said.discrepancy, tuple(acting), sentence, said.possible),
            effects=self._effects(places),
            hypotheses=tuple(self.hypotheses),
            causes=posterior.by_cause(self.hypotheses, problem.effects),
            places=posterior.by_place(self.hypotheses, places),
            noise=noise_of_channels(self.search, self.information.at.sizes),
            shares=split,
            coefficients=self.coefficients,
            gap=by_channel(problem, self._deviation, points),
            time=in_time(problem, errors),
            region=in_region(problem, errors, points["refit"], self.seed),
            discrepancy=describe(self.search, said.shown),
            validation=validation,
            next_trial=suggestion,
            augmented=self._augmented(),
            unavailable=dict(unavailable),
            trials=recorded(self.problem.trials, self.settings),
            outcome=outcome,
            traces=self.gap.traces(),
            findings=[*findings, *not_converged(fits, f"study {self.study.name!r}")],
            provenance=provenance(),
        )

    def _places(self, effect: Effect) -> tuple[str, ...]:
        """Where an effect acts on this model, under the model's names."""
        places = effect.places(self.study.model)
        words = {"kinematics", *(self.problem.discrepancy.equations.values() if self.problem.discrepancy else ())}
        return tuple(place for place in places if ":" in place or place in words) or tuple(places)

    def _reported_fit(self, name: str) -> Fit | None:
        return reported_fit(self.search, self._weighed, name, self.decision.shown, self._beside)

    def _parameters(self, name: str) -> tuple[EffectParameter, ...]:
        fit = self._reported_fit(name)
        return () if fit is None else sizes_of(self.problem, fit, name, lacking=self.decision.discrepancy)

    def _effects(self, places: Mapping[str, tuple[str, ...]]) -> tuple[EffectResult, ...]:
        ranked = sorted(self.problem.effects, key=lambda name: (-self.inclusion[name], name))
        leading = [name for name in ranked if self.search.best((name,)) is not None][:_LEADING]
        base, key, rows = self.search.null.evidence, self.decision.shown, list[EffectResult]()
        ours = {*self.problem.effects, *self.study.model.nominal()}
        for name in ranked:
            effect = self.problem.effects[name]
            parameters, fit = self._parameters(name), self._reported_fit(name)
            own = self.information.noncentrality(name, fit)
            seen = leading if name in leading and own > _VISIBLE else ()
            others = [o for o in seen if o != name and not are_one(self.problem.effects, name, o)]
            near = {o: self.information.noncentrality_between(name, o, fit) for o in others}
            gains = self.gains(name, key) if name in key else np.zeros(0)
            rows.append(
                EffectResult(
                    name=name,
                    title=effect.title,
                    cause=effect.cause,
                    acts_on=places[name],
                    equation=effect.equation,
                    probability=self.inclusion[name],
                    log_evidence=self.search.evidence((name,)) - base,
                    noncentrality=own,
                    parameters=parameters,
                    in_words=effect_in_words(effect, self.study.model, parameters),
                    detectable=self.information.detectable[name],
                    typical={q: effect.priors(self.study.model)[q].sd for q in effect.magnitudes},
                    units={q.name: q.unit for q in effect.parameters},
                    confusable={o: v for o, v in sorted(near.items(), key=lambda e: e[1]) if v < _CONFUSED},
                    equivalent=tuple(name for name in effect.equivalent if name in ours),
                    share=self.gap.share(name) if name in key else math.nan,
                    predictive_gain=float(gains.sum()) if len(gains) else math.nan,
                    predictive_gain_lower=lower_bound(gains, self.settings.significance),
                    prior_deviations=prior_deviations(parameters),
                )
            )
        return tuple(rows)

    def _named(self, cluster: Cluster) -> NamedCause:
        name = cluster.member_in(self.decision.shown)
        effect, parameters, share = self.problem.effects[name], self._parameters(name), self.gap.share(name)
        several = title(cluster.cause) if cluster.cause != ROOT else "one of several causes"
        members, model = (name, *(n for n in cluster.effects if n != name)), self.study.model
        implausible = prior_deviations(parameters) > self.settings.implausible
        return NamedCause(
            cause=cluster.cause,
            title=several if len(cluster.effects) > 1 else effect.title,
            effects=members,
            probability=cluster.probability,
            in_words=effect_in_words(effect, model, parameters),
            share=share,
            small=share < self.settings.small_share and not is_certain_error(cluster, self.gap.typical_sizes(name)),
            implausible=implausible,
            beyond=furthest(effect, parameters) if implausible else "",
            direction=common_direction([self._parameters(n) for n in cluster.effects]),
            sizes=tuple(effect_in_words(self.problem.effects[n], model, self._parameters(n)) for n in members),
            of_evidence=self.gap.is_of_evidence(name),
            over_typical=self._size(cluster, self.decision.shown),
        )

    def _size(self, cluster: Cluster, key: Key) -> float:
        """How large a cause of a set is, over a typical one: the largest of its effects, each in the others' place."""
        shown = cluster.member_in(key)
        places = {name: tuple(sorted(name if one == shown else one for one in key)) for name in cluster.effects}
        fitted = {name: place for name, place in places.items() if self.search.best(place) is not None}
        return max((self._gap_of(place).typical_sizes(name) for name, place in fitted.items()), default=math.inf)

    @cached_property
    def coefficients(self) -> tuple[Coefficient, ...]:
        """The model's free coefficients, refitted beside the answer."""
        return refitted_coefficients(self.problem, self.gap.shown)

    def _augmented(self) -> dict[str, Any]:
        """The named effects at their reported values, and nothing else."""
        parameters = {f"{name}_{q.name}": q.value for name in self.decision.shown for q in self._parameters(name)}
        return {"effects": list(self.decision.shown), "parameters": parameters}
