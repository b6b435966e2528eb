"""What the search found and what was decided, put together as a Diagnosis."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any

import numpy as np

from seatruth.diagnosis import posterior
from seatruth.diagnosis.clusters import Cluster
from seatruth.diagnosis.cross_validation import lower_bound
from seatruth.diagnosis.decision import Decision
from seatruth.diagnosis.discrepancy.report import describe
from seatruth.diagnosis.earth_directions import common_direction
from seatruth.diagnosis.experiment_design.select import HARDLY, next_trial, survivors, with_motion
from seatruth.diagnosis.fit import Fit, not_converged
from seatruth.diagnosis.gap import Gap
from seatruth.diagnosis.headline import headline
from seatruth.diagnosis.hypotheses import Search
from seatruth.diagnosis.judgement import Judgement
from seatruth.diagnosis.localization import by_channel, in_region, in_time, shares, whitened
from seatruth.diagnosis.other_forms import with_other_forms
from seatruth.diagnosis.parts import NextTrial, Validation
from seatruth.diagnosis.practical_size import is_certain_error
from seatruth.diagnosis.reported_noise import noise_of_channels
from seatruth.diagnosis.reported_sizes import refitted_coefficients, reported_fit
from seatruth.diagnosis.results import Diagnosis
from seatruth.diagnosis.sections import recorded
from seatruth.diagnosis.size_errors import sizes_of
from seatruth.diagnosis.sizes_in_words import effect_in_words, furthest, prior_deviations
from seatruth.diagnosis.verdict import EffectParameter, EffectResult, Hypothesis, NamedCause, Verdict, least_probable
from seatruth.effects import Effect
from seatruth.effects.causes import ROOT, title
from seatruth.effects.each_trial import are_one, follows_each_trial, repeats
from seatruth.provenance import provenance
from seatruth.study import Study
from seatruth.trials.finding import Finding
from seatruth.uncertainty.moved_coefficients import Coefficient

_LEADING = 8
"""Effects between which pairwise noncentralities are reported. [S]"""
_CONFUSED = 25.0
"""Pairwise noncentrality below which a report says that two effects are easily confused: z = 5."""
_VISIBLE = 9.0
"""Noncentrality of an effect itself from which that is asked: z = 3."""


class Assembly:
    """Describes a finished search, and what was decided on it."""

    def __init__(self, study: Study, search: Search, seed: int) -> None:
        self.study, self.search, self.seed = study, search, seed
        self.problem, self.settings = search.problem, search.problem.settings
        self.judgement = Judgement(search)
        self.information = self.judgement.information

    @property
    def decision(self) -> Decision:
        """What is said."""
        return self.judgement.decision

    @property
    def gap(self) -> Gap:
        """What is left between the models and the trials."""
        return self.judgement.gap_of(self.decision.shown)

    @cached_property
    def hypotheses(self) -> list[Hypothesis]:
        """With their probabilities as the decision leaves them."""
        effects, said = self.problem.effects, self.decision
        waves = [name for name in said.small if follows_each_trial(effects[name])]
        shapes = said.refused if self.judgement.noise_is_motion else ()
        return with_other_forms(
            self.judgement.weighed, effects, [*said.outdone, *said.drift, *said.turning, *shapes, *waves]
        )

    @cached_property
    def inclusion(self) -> dict[str, float]:
        """Probability that each effect acts, alone or with others."""
        return posterior.inclusion(self.hypotheses, list(self.problem.effects))

    def validation(self, say: Callable[[str, int, int], None]) -> Validation | None:
        """Each trial predicted from the others."""
        return self.judgement.validation(say)

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
        if validation is None and self.decision.shown in self.judgement.validations:
            validation = self.judgement.reported(self.decision.shown)
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
            gap=by_channel(problem, self.judgement.deviation, points),
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
        return reported_fit(self.search, self.judgement.weighed, name, self.decision.shown, self.judgement.beside)

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
            gains = self.judgement.gains(name, key) if name in key else np.zeros(0)
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
        same = (
            n for n in cluster.effects if all(n == o or repeats(self.problem.effects[o], n) for o in cluster.effects)
        )
        several = next((self.problem.effects[n].title for n in same), several)
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
            over_typical=self.judgement.size(cluster, self.decision.shown),
        )

    @cached_property
    def coefficients(self) -> tuple[Coefficient, ...]:
        """The model's free coefficients, refitted beside the answer."""
        return refitted_coefficients(self.problem, self.gap.shown)

    def _augmented(self) -> dict[str, Any]:
        """The named effects at their reported values, and nothing else."""
        parameters = {f"{name}_{q.name}": q.value for name in self.decision.shown for q in self._parameters(name)}
        return {"effects": list(self.decision.shown), "parameters": parameters}
