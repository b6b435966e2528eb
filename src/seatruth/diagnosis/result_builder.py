"""What was found, turned into the parts of a Diagnosis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd

from seatruth.arrays import Array
from seatruth.diagnosis.cross_validation.gap_explained import how_far, in_whole_runs
from seatruth.diagnosis.discrepancy.score_test import Probes
from seatruth.diagnosis.discrepancy.terms import equations
from seatruth.diagnosis.experiment_design.candidates import Menu
from seatruth.diagnosis.experiment_design.select import next_trial
from seatruth.diagnosis.fit import Fit, fit
from seatruth.diagnosis.hypotheses import Say, Search
from seatruth.diagnosis.localization import by_channel, in_region, in_time, noise_table, shares
from seatruth.diagnosis.noise import NoiseFloor
from seatruth.diagnosis.posterior import UNKNOWN, Candidate, Verdict, apart, inclusion, lambda_of, powerless
from seatruth.diagnosis.problem import GapProblem
from seatruth.diagnosis.results import Diagnosis, towards
from seatruth.diagnosis.sentences import sentence
from seatruth.effects import Effect
from seatruth.provenance import provenance
from seatruth.study import Study
from seatruth.trials.finding import Finding
from seatruth.trials.trial import Trials

_RIVALS = 6
_LEADING = 4
"""Single causes that lead, between which the next trial is to tell beside those of the verdict."""
_HARDLY = 1e-3
"""Probability below which a third cause and those after it are out."""
_SEEN = 9.0
"""Lambda of its own from which it makes sense to ask what an effect is taken for."""
_CONFUSED = 25.0
"""Pairwise lambda below which a report says that two effects are easily taken for each other."""


class Parts:
    """Turns what was found into the parts of a Diagnosis."""

    def __init__(
        self,
        study: Study,
        problem: GapProblem,
        found: Search,
        plain: Search,
        probed: Sequence[Probes],
        answers: Sequence[Candidate],
        judged: Verdict,
        least: Mapping[str, Mapping[str, float]],
        findings: list[Finding],
        say: Say,
        seed: int,
    ) -> None:
        self.study, self.problem, self.found, self.plain, self.probed = study, problem, found, plain, probed
        self.answers, self.judged, self.least = answers, judged, least
        self.findings, self.say, self.seed = findings, say, seed
        self.before = fit(problem, (), plain.floor, problem.start, free=problem.initial)

    @property
    def best(self) -> Fit:
        """The fit that stands for the verdict: its effects, or the most probable ones where none is named."""
        key = tuple(sorted(self.judged.effects))
        if key in self.found.fits:
            return self.found.fits[key]
        return self.found.base

    def _shown(self) -> Fit:
        """The verdict's fit against noise alone: what the gap is measured with."""
        key = self.best.effects
        if self.found.problem.lead is not None:
            return self._in_whole_runs[1]
        if key not in self.plain.fits:
            self.plain.fits[key] = fit(self.problem, key, self.plain.floor, self.best.x)
        return self.plain.fits[key]

    @cached_property
    def _in_whole_runs(self) -> tuple[Fit, Fit]:
        """The model without effects and with those of the verdict, fitted to whole runs, where the search led them."""
        base = in_whole_runs(self.found, self.plain, self.found.base)
        return base, in_whole_runs(self.found, self.plain, self.best, base) if self.best.effects else base

    @property
    def _floor(self) -> NoiseFloor:
        """What the gap is compared with. Where runs stray, what they leave is no noise, however slow: led ones know."""
        return self.plain.floor if self.found.problem.lead is None else self.found.floor

    def _misfit(self, at: Fit) -> float:
        """Sum of squared errors in multiples of the noise."""
        if self.found.problem.lead is None:
            return at.misfit
        problem = self.problem
        sd = np.array([self._floor.sd.get(name, 1.0) for name in problem.outputs])
        return float(np.sum((problem.errors(at.x, at.active) / sd[problem.channel_of]) ** 2))

    def _simulated(self) -> Fit:
        """The fit whose values the model is to be simulated with."""
        return self.best if self.found.problem.lead is None else self._shown()

    def shrinkage(self) -> dict[str, Any]:
        rivals = [c.effects for c in self.answers if c.effects in self.found.fits and c.effects][:_RIVALS]
        if self.judged.beside and self.judged.effects:
            rivals = [tuple(sorted(self.judged.effects)), *rivals]
        return how_far(self.found, self.plain, self.probed[0] if self.probed else None, rivals, self.say)

    def suggestion(self) -> dict[str, Any] | None:
        found = next_trial(self.plain, self._survivors(), self.say, self.probed[0] if self.probed else None)
        return None if found is None else {**found, **self._expected(str(found["manoeuvre"]))}

    def _survivors(self) -> dict[str, float]:
        """Causes that the verdict leaves open, with their probabilities: its set, what it names, what alone leads."""
        chances = inclusion(self.answers, list(self.problem.effects))
        alone = [c.effects[0] for c in self.answers if len(c.effects) == 1 and c.effects[0] in chances]
        leading = [name for k, name in enumerate(alone) if k < 2 or chances[name] > _HARDLY]
        names = list(dict.fromkeys([*self.judged.together, *self.judged.effects, *leading[:_LEADING]]))
        for name in names:
            key = (name,)
            if key in self.found.fits and key not in self.plain.fits:
                self.plain.fits[key] = fit(self.problem, key, self.plain.floor, self.found.fits[key].x)
        found = {name: max(chances[name], _HARDLY) for name in names if (name,) in self.plain.fits}
        unknown = next((c.probability for c in self.answers if c.effects == (UNKNOWN,)), 0.0)
        return {**found, UNKNOWN: unknown} if unknown > _HARDLY else found

    def _expected(self, manoeuvre: str) -> dict[str, Any]:
        """The motion that the fitted model expects of a manoeuvre of the menu, and the units of what is in it."""
        problem = self.problem
        trial = Menu(problem).named(manoeuvre).trial
        values = dict(zip(problem.names, self._simulated().x))
        cost = problem.cost_of(problem.model, (), values, Trials([trial]))
        y = cost.predict(np.array([values.get(name, x) for name, x in zip(cost.names, cost.start)]), [trial])[0]
        channels = (*problem.model.inputs, *problem.model.outputs)
        return {
            "motion": {name: y[:, k].tolist() for k, name in enumerate(problem.outputs) if np.isfinite(y[:, k]).all()},
            "units": {channel.name: channel.unit for channel in channels},
        }

    def diagnosis(self, reasons: Mapping[str, str], outcome: Mapping[str, Any], extra: Mapping[str, Any]) -> Diagnosis:
        problem, plain = self.problem, self.plain
        whole = plain.base if self.found.problem.lead is None else self._in_whole_runs[0]
        fits = {"before": self.before, "refit": whole, "effect": self._shown()}
        gap = by_channel(problem, self._floor, fits)
        before, refit, best = (self._misfit(fits[name]) for name in ("before", "refit", "effect"))
        split = shares(before, refit, best, problem.rows)
        which = self._which()
        where = {
            "places": self._places(),
            "time": in_time(problem, plain.base),
            "region": in_region(problem, plain.base, self.seed),
        }
        unnamed = self._unnamed()
        said = self._verdict(which, unnamed)
        return Diagnosis(
            study=self.study.name,
            model=self.study.model.name,
            synthetic=self.study.synthetic,
            seed=self.seed,
            trials=[
                {
                    "name": t.name,
                    "samples": len(t),
                    "duration_s": t.duration,
                    "conditions": dict(t.conditions),
                    "steps": [{"name": step.name, "effect": step.effect} for step in t.steps],
                }
                for t in problem.trials
            ],
            effects=[self._about(effect) for effect in problem.effects.values()],
            left_out=dict(reasons),
            noise=noise_table(self._floor),
            gap=gap,
            shares=split,
            where=where,
            candidates=[
                {
                    "effects": list(c.effects),
                    "probability": c.probability,
                    "beside": c.beside,
                    "log_evidence": c.evidence,
                }
                for c in self.answers[:40]
            ],
            which=which,
            verdict={**said, "sentence": sentence(said, which, split, extra["how_far"], unnamed)},
            unnamed=unnamed,
            how_far=extra["how_far"],
            next_trial=extra["next_trial"],
            augmented=self._augmented(),
            outcome=dict(outcome),
            traces=self._traces(fits),
            findings=self.findings,
            provenance=provenance(),
        )

    def _about(self, effect: Effect) -> dict[str, Any]:
        priors = effect.priors(self.study.model)
        return {
            "name": effect.name,
            "number": effect.number,
            "title": effect.title,
            "family": effect.family,
            "equation": effect.equation,
            "acts_on": self._acting(effect),
            "equivalent": list(effect.equivalent),
            "distinguished_by": effect.distinguished_by,
            "source": effect.source,
            "parameters": [
                {"name": q.name, "unit": q.unit, "null": effect.null[q.name], "typical": priors[q.name].sd}
                for q in effect.parameters
            ],
        }

    def _acting(self, effect: Effect) -> list[str]:
        """Where an effect acts on this model: under the model's names, without equations that it does not have."""
        places = effect.places(self.study.model)
        own = {"kinematics", *equations(self.study.model).values()}
        return [place for place in places if ":" in place or place in own] or list(places)

    def _which(self) -> list[dict[str, Any]]:
        problem, found = self.problem, self.found
        chances = inclusion(self.answers, list(problem.effects))
        ranked = sorted(problem.effects, key=lambda name: -chances[name])
        leading = [name for name in ranked if (name,) in found.fits][:8]
        rows = []
        for name in ranked:
            effect = problem.effects[name]
            key = tuple(sorted(self.judged.effects)) if name in self.judged.effects else (name,)
            at = found.fits.get(key)
            values = self._values(effect, at) if at is not None else []
            own = lambda_of(found, problem, name)
            near = {}
            if name in leading and own > _SEEN:
                near = {other: apart(found, name, other) for other in leading if other != name}
            rows.append(
                {
                    "name": name,
                    "number": effect.number,
                    "title": effect.title,
                    "acts_on": self._acting(effect),
                    "probability": chances[name],
                    "log_evidence": found.evidence((name,)),
                    "lambda": own,
                    "parameters": values,
                    "in_words": towards(
                        {v["name"]: (v["value"], v["stderr"]) for v in values}, values[0]["unit"] if values else ""
                    ),
                    "detectable": dict(self.least.get(name, {})),
                    "confused_with": {
                        other: value for other, value in sorted(near.items(), key=lambda e: e[1]) if value < _CONFUSED
                    },
                    "apart": near,
                    "equivalent": list(effect.equivalent),
                }
            )
        return rows

    def _values(self, effect: Effect, at: Fit) -> list[dict[str, Any]]:
        problem = self.problem
        error = at.stderr(problem)
        rows = []
        for q, k in zip(effect.parameters, problem.columns[effect.name]):
            value, sd = float(at.x[k]), float(error[k])
            rows.append(
                {
                    "name": q.name,
                    "unit": q.unit,
                    "value": value,
                    "stderr": sd,
                    "lower": value - 1.96 * sd,
                    "upper": value + 1.96 * sd,
                    "null": float(effect.null[q.name]),
                }
            )
        return rows

    def _places(self) -> list[dict[str, Any]]:
        """Rival placements of one unnamed cause in the refitted model, the likeliest first."""
        if not self.probed:
            return []
        rows = [p for p in self.probed[0].found if p.kind != "terms"]
        weight = np.exp(np.array([p.gain for p in rows]) / 2.0 - max(p.gain for p in rows) / 2.0)
        left = {p.label: p.gain for p in self._probed_at(self.judged.effects).found}
        ranked = sorted(zip(rows, weight / weight.sum()), key=lambda entry: -entry[0].gain)
        return [
            {
                "place": p.label,
                "log_evidence": p.gain,
                "probability": float(w),
                "log_evidence_left": left.get(p.label, float("nan")),
            }
            for p, w in ranked
        ]

    def _probed_at(self, effects: Sequence[str]) -> Probes:
        """The probes beside these effects; those nearest to it where there are none."""
        return max(self.probed, key=lambda one: (len(set(one.at.effects) & set(effects)), -len(one.at.effects)))

    def _unnamed(self) -> dict[str, Any] | None:
        if not self.probed:
            return None
        probe = self._probed_at(self.judged.effects)
        place = probe.best("place")
        values, errors = probe.posterior(place.label, place.size)
        knots = probe.model.knots
        kept = probe.kept[place.label]
        series = []
        for number, trial in enumerate(self.problem.trials):
            here = (kept // knots) == number
            series.append(
                {
                    "trial": trial.name,
                    "t": [float(k % knots) * probe.model.spacing for k in kept[here]],
                    "value": values[here].tolist(),
                    "stderr": errors[here].tolist(),
                }
            )
        formula = probe.best("terms")
        coefficients, sds = probe.posterior(formula.label, formula.size)
        terms = [probe.terms[formula.label][k] for k in probe.kept[formula.label]]
        ranked = sorted(
            (
                {"term": t.text, "coefficient": float(c), "stderr": float(s), "factor": float(c) / probe.model.size(t)}
                for t, c, s in zip(terms, coefficients, sds)
            ),
            key=lambda row: -abs(float(str(row["coefficient"]))) / max(float(str(row["stderr"])), 1e-300),
        )
        unit = next(p.unit for p in probe.model.places if p.label == place.label)
        return {
            "place": place.label,
            "unit": unit,
            "log_evidence": place.gain,
            "in_time": series,
            "equation": formula.label.removeprefix("terms:"),
            "formula_log_evidence": formula.gain,
            "formula": [row for row in ranked if abs(float(str(row["coefficient"]))) > 2.0 * float(str(row["stderr"]))][
                :5
            ],
            "beside": list(probe.at.effects),
        }

    def _verdict(self, which: Sequence[Mapping[str, Any]], unnamed: Mapping[str, Any] | None) -> dict[str, Any]:
        judged = self.judged
        acting = {row["name"]: row["acts_on"] for row in which}
        places = list(dict.fromkeys(p for name in judged.effects for p in acting[name]))
        if not places and judged.kind == "unknown" and unnamed is not None:
            places = [str(unnamed["equation"])]
        places += [row["place"] for row in self._places() if row["place"] not in places]
        weak = powerless(self.found, self.least)
        return {
            "kind": judged.kind,
            "effects": list(judged.effects),
            "set": list(judged.together),
            "probability": judged.probability,
            "beside": judged.beside,
            "places": places,
            "powerless": weak,
            "unknown": sum(c.probability if c.effects == (UNKNOWN,) else c.beside for c in self.answers),
            "none": next((c.probability for c in self.answers if c.effects == ()), 0.0),
        }

    def _augmented(self) -> dict[str, Any]:
        values = dict(zip(self.problem.names, self._simulated().x.tolist()))
        kept = dict(self.problem.cost.space.nominal().items())
        kept.update({name: value for name, value in values.items() if name in kept})
        dropped = {
            effect.named(q.name)
            for name, effect in self.problem.effects.items()
            if name not in self.best.effects
            for q in effect.parameters
        }
        return {
            "model": self.study.model.name,
            "effects": list(self.best.effects),
            "parameters": {name: value for name, value in kept.items() if name not in dropped},
        }

    def _traces(self, fits: Mapping[str, Fit]) -> pd.DataFrame:
        problem = self.problem
        errors: dict[str, Array] = {name: problem.errors(one.x) for name, one in fits.items()}
        parts = []
        for group in problem.groups:
            trial = problem.trials[group.trial]
            measured = np.asarray(trial.outputs[group.channel])[group.sample]
            columns = {name: measured - errors[name][group.rows] for name in fits}
            parts.append(
                pd.DataFrame(
                    {"trial": group.trial, "t": group.t, "channel": group.channel, "measured": measured, **columns}
                )
            )
        return pd.concat(parts, ignore_index=True)
