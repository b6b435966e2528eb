"""What the search found, decided on and put together as a Diagnosis."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd

from seatruth.arrays import Array
from seatruth.diagnosis import posterior
from seatruth.diagnosis.cross_validation import (
    lower_bound,
    noise_deviation,
    predictive_gains,
    refit_initial_states,
    validate,
)
from seatruth.diagnosis.decision import Cluster, Decision, decide
from seatruth.diagnosis.discrepancy.report import describe
from seatruth.diagnosis.experiment_design.candidates import Menu
from seatruth.diagnosis.experiment_design.select import next_trial
from seatruth.diagnosis.fit import Fit, without_discrepancy
from seatruth.diagnosis.hypotheses import Key, Search
from seatruth.diagnosis.hypothesis_fits import ensure
from seatruth.diagnosis.localization import by_channel, in_region, in_time, shares, whitened
from seatruth.diagnosis.marginal_likelihood import Likelihood
from seatruth.diagnosis.parts import ChannelNoise, Coefficient, NextTrial, Validation
from seatruth.diagnosis.problem import Point
from seatruth.diagnosis.results import Diagnosis
from seatruth.diagnosis.sentences import size_in_words, verdict_sentence
from seatruth.diagnosis.sizes import noise_shapes
from seatruth.diagnosis.verdict import EffectParameter, EffectResult, NamedCause, Verdict
from seatruth.effects import Effect
from seatruth.effects.causes import ROOT, title
from seatruth.provenance import provenance
from seatruth.study import Study
from seatruth.trials.finding import Finding
from seatruth.trials.trial import Trial

_SURVIVORS = 4
"""Single effects that lead, between which the next trial is to decide beside those of the answer. [S]"""
_HARDLY = 1e-3
"""Probability below which a single effect is no survivor. [S]"""
_LEADING = 8
"""Effects between which pairwise noncentralities are reported. [S]"""
_CONFUSED = 25.0
"""Pairwise noncentrality below which a report says that two effects are easily confused: z = 5."""
_VISIBLE = 9.0
"""Noncentrality of an effect itself from which that is asked: z = 3."""


class Assembly:
    """Decides on a finished search, and describes it."""

    def __init__(self, study: Study, search: Search, seed: int) -> None:
        self.study, self.search, self.seed = study, search, seed
        self.problem, self.settings = search.problem, search.problem.settings
        self.hypotheses = posterior.hypotheses(search, self.settings)
        self.sets = posterior.answers(self.hypotheses)
        self.inclusion = posterior.inclusion(self.hypotheses, list(self.problem.effects))
        self._gains: dict[tuple[str, Key], Array] = {}

    @cached_property
    def decision(self) -> Decision:
        """What is said."""
        return decide(
            self.hypotheses,
            self.problem.effects,
            self.settings,
            near=self.noncentrality_between,
            helps=self._helps,
            underpowered=len(self._undetectable()) > len(self.problem.effects) // 2,
            converged=self.search.null.settled,
            gap=self._leaves_a_gap(),
        )

    def _leaves_a_gap(self) -> bool:
        """Whether the refitted model without discrepancy leaves more than noise."""
        plain = self.search.fits.get(((), False))
        if plain is None:
            return True
        return self._misfit(without_discrepancy(self.problem, plain.point)) > self.settings.gap * self.problem.count

    def _helps(self, name: str, key: Key) -> bool:
        """Whether an effect of a set has a size that can be told from none, and predicts trials left out."""
        fit = self.search.best(key)
        if fit is None:
            whole = self.search.best(next(iter(self.sets)))
            fit = None if whole is None else ensure(self.search, key, whole)
        if fit is None:
            return False
        columns = self.problem.columns[name]
        at = np.searchsorted(fit.solution.free, columns, sorter=np.argsort(fit.solution.free))
        place = np.argsort(fit.solution.free)[at]
        effect = self.problem.effects[name]
        magnitudes = [k for k, q in enumerate(effect.parameters) if q.name in effect.magnitudes]
        covariance = fit.solution.covariance[np.ix_(place[magnitudes], place[magnitudes])]
        distance = (fit.point.shared - self.problem.mean)[columns][magnitudes]
        size = float(distance @ np.linalg.pinv(covariance, hermitian=True) @ distance)
        if size < self.settings.least_noncentrality:
            return False
        return lower_bound(self.gains(name, key), self.settings.significance) > 0.0

    def gains(self, name: str, key: Key) -> Array:
        """Log predictive density of trials left out, with an effect of a set less without it."""
        if (name, key) not in self._gains:
            self._gains[name, key] = predictive_gains(self.search, name, key)
        return self._gains[name, key]

    # The information that these trials hold on each effect

    @cached_property
    def _screen(self) -> tuple[Likelihood, Fit]:
        """All effects linearized at the best fit, and that fit."""
        at = self.search.best(self.search.sets()[0])
        assert at is not None
        return Likelihood(self.problem, self.problem.linearize(at.point, tuple(self.problem.effects))), at

    def _information(self, *names: str) -> Array:
        likelihood, at = self._screen
        return likelihood.information(at.sizes, names)[0]

    def _distance(self, name: str) -> Array | None:
        """Fitted parameters of an effect less their prior means; None where it was not fitted."""
        fit = self._fit_of(name)
        columns = self.problem.columns[name]
        return None if fit is None else fit.point.shared[columns] - self.problem.mean[columns]

    def _fit_of(self, name: str) -> Fit | None:
        """The fit that speaks for an effect: of the answer if it is in it, else alone."""
        shown = self.decision.shown if "decision" in self.__dict__ else ()
        return self.search.best(shown) if name in shown else self.search.best((name,))

    def noncentrality(self, name: str) -> float:
        """Squared size of an effect's signature, everything else refitted; NaN where it was not fitted."""
        distance = self._distance(name)
        return math.nan if distance is None else float(distance @ self._information(name) @ distance)

    def noncentrality_between(self, name: str, other: str) -> float:
        """What is left of an effect's signature when the other one is fitted in its place."""
        distance = self._distance(name)
        if distance is None:
            return math.inf
        both, n = self._information(name, other), len(distance)
        held = both[n:, n:] + np.diag(1.0 / self.problem.sd[self.problem.columns[other]] ** 2)
        left = both[:n, :n] - both[:n, n:] @ np.linalg.solve(held, both[n:, :n])
        return float(distance @ left @ distance)

    @cached_property
    def detectable(self) -> dict[str, dict[str, float]]:
        """Smallest magnitude of each effect's parameters that these trials show."""
        found: dict[str, dict[str, float]] = {}
        for name, effect in self.problem.effects.items():
            information = self._information(name)
            found[name] = {}
            for k, q in enumerate(effect.parameters):
                rest = [j for j in range(len(information)) if j != k]
                left = float(information[k, k])
                if rest:
                    block = np.linalg.pinv(information[np.ix_(rest, rest)], hermitian=True)
                    left -= float(information[k, rest] @ block @ information[rest, k])
                found[name][q.name] = self.settings.power / math.sqrt(left) if left > 0.0 else math.inf
        return found

    def _undetectable(self) -> list[str]:
        """Effects none of whose magnitudes would show at its typical size."""
        found = []
        for name, limits in self.detectable.items():
            priors = self.problem.effects[name].priors(self.study.model)
            magnitudes = self.problem.effects[name].magnitudes
            if all(limits[q] > priors[q].sd for q in magnitudes):
                found.append(name)
        return found

    # Points that are compared

    @cached_property
    def shown(self) -> Fit:
        """The fit that stands for the answer."""
        found = self.search.best(self.decision.shown)
        return found if found is not None else self.search.null

    @cached_property
    def _deviation(self) -> Array:
        return noise_deviation(self.problem, self._screen[1].sizes)

    @cached_property
    def points(self) -> dict[str, Point]:
        """The declared model, the refitted one, and that with the effects of the answer: all without discrepancy."""
        problem = self.problem
        plain = self.search.fits.get(((), False)) or self.search.null
        key = self.decision.shown
        named = self.search.fits.get((key, False)) or self.shown
        declared = refit_initial_states(problem, problem.start, self._deviation)
        return {
            "before": declared,
            "refit": without_discrepancy(problem, plain.point),
            "effects": without_discrepancy(problem, named.point) if key else without_discrepancy(problem, plain.point),
        }

    def _misfit(self, point: Point) -> float:
        """Sum of squared errors over the noise variance."""
        errors = self.problem.errors(point) / self._deviation[self.problem.channel_of]
        return float(errors @ errors) if np.isfinite(errors).all() else math.inf

    def _share(self, name: str) -> float:
        """Part of the gap that an effect of the answer closes: of the misfit of whole runs, or of the evidence.

        Runs that stray from their records have no misfit that means anything; there it is the part of the evidence.
        """
        key = self.decision.shown
        rest = tuple(n for n in key if n != name)
        plain, named = self._misfit(self.points["refit"]), self._misfit(self.points["effects"])
        if max(plain, named) > self.settings.stray * self.problem.count:
            return self._share_of_evidence(rest)
        without, gap = self.search.fits.get((rest, False)), plain - self.problem.count
        if without is None or gap <= 0.0:
            return math.nan
        left = self._misfit(without_discrepancy(self.problem, without.point))
        return float(np.clip((left - named) / gap, 0.0, 1.0))

    def _share_of_evidence(self, rest: Key) -> float:
        """Part of the evidence of the answer over none that is lost without one effect."""
        at = self.shown
        without, none = ensure(self.search, rest, at), self.search.fits.get(((), at.discrepancy))
        if without is None or none is None or at.evidence <= none.evidence:
            return math.nan
        return float(np.clip((at.evidence - without.evidence) / (at.evidence - none.evidence), 0.0, 1.0))

    # Parts of the diagnosis

    def validation(self, say: Callable[[str, int, int], None]) -> Validation | None:
        """Each trial predicted from the others."""
        return validate(self.search, self.decision.shown, say)

    def suggestion(self, say: Callable[[str, int, int], None]) -> NextTrial | None:
        """The trial that best separates the causes that are left, with the motion that is expected of it."""
        members = [name for cluster in self.decision.clusters for name in cluster.effects]
        alone = [key[0] for key, p in self.sets.items() if len(key) == 1 and p > _HARDLY][:_SURVIVORS]
        names = list(dict.fromkeys([*members, *alone]))
        fitted = {name: max(self.inclusion[name], _HARDLY) for name in names if self.search.best((name,)) is not None}
        found = next_trial(self.search, fitted, say)
        if found is None or not found.manoeuvre:
            return found
        trial = Menu(self.problem).named(found.manoeuvre).trial
        y = self._simulated(trial)
        channels = (*self.study.model.inputs, *self.study.model.outputs)
        return replace(
            found,
            motion={
                n: tuple(y[:, c].tolist()) for c, n in enumerate(self.problem.outputs) if np.isfinite(y[:, c]).all()
            },
            units={channel.name: channel.unit for channel in channels},
        )

    def _simulated(self, trial: Trial) -> Array:
        """Outputs (n, C) that the model with the answer's effects expects of a trial."""
        sim = self.problem.on_trial(trial, (), self.problem.named(self.points["effects"]))
        return np.asarray(sim.outputs(np.zeros((1, 0)), sim.initial_states).y[0])

    def diagnosis(
        self,
        unavailable: Mapping[str, str],
        findings: list[Finding],
        validation: Validation | None,
        suggestion: NextTrial | None,
        outcome: dict[str, Any],
    ) -> Diagnosis:
        """All parts together."""
        problem, points = self.problem, self.points
        findings = [*findings, *self._unconverged()]
        sizes = self._screen[1].sizes
        errors = whitened(problem, problem.errors(points["refit"]), sizes)
        before, refit, effects = (self._misfit(points[name]) for name in ("before", "refit", "effects"))
        split = shares(before, refit, effects, problem.count)
        places = {name: self._places(effect) for name, effect in problem.effects.items()}
        causes = tuple(self._named(cluster) for cluster in self.decision.clusters)
        discrepancy = describe(self.search, self.decision.shown)
        sentence = verdict_sentence(
            self.decision.kind, causes, self.decision.probability, self.decision.discrepancy, split, validation,
            one_trial=len(problem.trials) == 1,
        )  # fmt: skip
        acting = list(dict.fromkeys(p for cluster in self.decision.clusters for p in places[cluster.effects[0]]))
        return Diagnosis(
            study=self.study.name,
            model=self.study.model.name,
            synthetic=self.study.synthetic,
            seed=self.seed,
            verdict=Verdict(
                self.decision.kind,
                causes,
                self.decision.probability,
                self.decision.discrepancy,
                tuple(acting),
                sentence,
            ),
            effects=self._effects(places),
            hypotheses=tuple(self.hypotheses),
            causes=posterior.by_cause(self.hypotheses, problem.effects),
            places=posterior.by_place(self.hypotheses, places),
            noise=self._noise(),
            shares=split,
            coefficients=self._coefficients(),
            gap=by_channel(problem, self._deviation, points),
            time=in_time(problem, errors),
            region=in_region(problem, errors, points["refit"], self.seed),
            discrepancy=discrepancy,
            validation=validation,
            next_trial=suggestion,
            augmented=self._augmented(),
            unavailable=dict(unavailable),
            trials=[
                {
                    "name": trial.name,
                    "samples": len(trial),
                    "duration_s": trial.duration,
                    "conditions": dict(trial.conditions),
                    "steps": [{"name": step.name, "effect": step.effect} for step in trial.steps],
                }
                for trial in problem.trials
            ],
            outcome=outcome,
            traces=self._traces(),
            findings=findings,
            provenance=provenance(),
        )

    def _unconverged(self) -> list[Finding]:
        """Fits that the answer rests on and that did not converge."""
        fits = {"the model alone": self.search.null, "the answer": self.shown}
        names = [name for name, fit in fits.items() if not fit.settled]
        if not names:
            return []
        text = (
            f"The fit of {' and of '.join(dict.fromkeys(names))} did not converge: sizes and probabilities are rough."
        )
        do = "Cut the trials into shorter ones, or begin from better coefficients (`seatruth identify`)."
        return [Finding("warning", "not-converged", text, f"study {self.study.name!r}", do)]

    def _places(self, effect: Effect) -> tuple[str, ...]:
        """Where an effect acts on this model, under the model's names."""
        places = effect.places(self.study.model)
        words = {"kinematics", *(self.problem.discrepancy.equations.values() if self.problem.discrepancy else ())}
        return tuple(place for place in places if ":" in place or place in words) or tuple(places)

    def _parameters(self, name: str) -> tuple[EffectParameter, ...]:
        fit, problem = self._fit_of(name), self.problem
        if fit is None:
            return ()
        effect, error, columns = problem.effects[name], fit.stderr(problem), problem.columns[name]
        return tuple(
            EffectParameter(
                q.name, q.unit, float(fit.point.shared[k]), float(error[k]),
                float(fit.point.shared[k] - 1.96 * error[k]), float(fit.point.shared[k] + 1.96 * error[k]),
                float(effect.null[q.name]), float(problem.sd[k]),
            )
            for q, k in zip(effect.parameters, columns)
        )  # fmt: skip

    def _effects(self, places: Mapping[str, tuple[str, ...]]) -> tuple[EffectResult, ...]:
        ranked = sorted(self.problem.effects, key=lambda name: (-self.inclusion[name], name))
        leading = [name for name in ranked if self.search.best((name,)) is not None][:_LEADING]
        base = self.search.null.evidence
        rows = []
        for name in ranked:
            effect, key = self.problem.effects[name], self.decision.shown
            own = self.noncentrality(name)
            near = {}
            if name in leading and own > _VISIBLE:
                near = {other: self.noncentrality_between(name, other) for other in leading if other != name}
            parameters = self._parameters(name)
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
                    in_words=size_in_words(parameters),
                    detectable=self.detectable[name],
                    typical={q: effect.priors(self.study.model)[q].sd for q in effect.magnitudes},
                    units={q.name: q.unit for q in effect.parameters},
                    confusable={o: v for o, v in sorted(near.items(), key=lambda e: e[1]) if v < _CONFUSED},
                    equivalent=effect.equivalent,
                    share=self._share(name) if name in key else math.nan,
                    predictive_gain=float(gains.sum()) if len(gains) else math.nan,
                    predictive_gain_lower=lower_bound(gains, self.settings.significance),
                    prior_deviations=self._prior_deviations(parameters),
                )
            )
        return tuple(rows)

    def _prior_deviations(self, parameters: tuple[EffectParameter, ...]) -> float:
        return max((abs(q.value - q.null) / q.prior_sd for q in parameters if q.prior_sd > 0.0), default=0.0)

    def _named(self, cluster: Cluster) -> NamedCause:
        name = next((n for n in cluster.effects if n in self.decision.shown), cluster.effects[0])
        parameters = self._parameters(name)
        share = self._share(name)
        words = self.problem.effects[name].title
        if len(cluster.effects) > 1:
            words = title(cluster.cause) if cluster.cause != ROOT else "one of several causes"
        return NamedCause(
            cause=cluster.cause,
            title=words,
            effects=(name, *(n for n in cluster.effects if n != name)),
            probability=cluster.probability,
            in_words=size_in_words(parameters),
            share=share,
            small=math.isfinite(share) and share < self.settings.small_share,
            implausible=self._prior_deviations(parameters) > self.settings.implausible,
        )

    def _noise(self) -> tuple[ChannelNoise, ...]:
        sizes, shapes = self._screen[1].sizes, noise_shapes(self.settings)
        declared = self.search.known.declared
        rows = []
        for c, channel in enumerate(self.study.model.outputs):
            samples = int((self.problem.channel_of == c).sum())
            if samples:
                white, shape = math.exp(float(sizes.white[c])), shapes[sizes.shape[c]]
                slow = white * shape.ratio
                rows.append(
                    ChannelNoise(
                        channel.name, channel.unit, white, slow, shape.tau if slow else math.nan,
                        declared.get(c, math.nan), samples,
                    )
                )  # fmt: skip
        return tuple(rows)

    def _coefficients(self) -> tuple[Coefficient, ...]:
        error = self.shown.stderr(self.problem)
        return tuple(
            Coefficient(
                q.name, q.unit, q.value, float(self.problem.sd[k]), float(self.shown.point.shared[k]), float(error[k])
            )
            for k in self.problem.coefficients
            for q in (self.problem.unknowns[k],)
        )

    def _augmented(self) -> dict[str, Any]:
        """The named effects at their reported values, and nothing else."""
        parameters = {f"{name}_{q.name}": q.value for name in self.decision.shown for q in self._parameters(name)}
        return {"effects": list(self.decision.shown), "parameters": parameters}

    def _traces(self) -> pd.DataFrame:
        problem = self.problem
        simulated = {name: problem.simulate(point) for name, point in self.points.items()}
        frames = []
        for number, trial in enumerate(problem.trials):
            for c, channel in enumerate(problem.outputs):
                measured = np.asarray(trial.outputs.get(channel, np.full(len(trial), math.nan)))
                columns = {name: y[number][:, c] for name, y in simulated.items()}
                frames.append(
                    pd.DataFrame(
                        {"trial": trial.name, "t": trial.t, "channel": channel, "measured": measured, **columns}
                    )
                )
        return pd.concat(frames, ignore_index=True)
