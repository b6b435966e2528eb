"""From the outcome of a search to an Estimate: uncertainty, fit, traces, findings."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from seatruth.arrays import Array
from seatruth.costs.current_rates import current_rates
from seatruth.costs.input_range import input_range
from seatruth.costs.options import TrajectoryOptions
from seatruth.costs.outside_forces import outside_forces
from seatruth.costs.sensor_places import far_sensors, receiver_in_two_places
from seatruth.costs.stepped_orders import stepped_orders, steps_in_gaps, without_stale_notes
from seatruth.costs.study_cost import StudyCost
from seatruth.costs.sway_signs import turned_sway
from seatruth.errors import SeatruthError
from seatruth.estimate import PARAMETER_COLUMNS, Estimate, decoded, encoded
from seatruth.models.isolated import failures_of
from seatruth.models.parameter import Parameter
from seatruth.optimizers import Outcome
from seatruth.provenance import provenance
from seatruth.simulate.faults import fault_of
from seatruth.study.study import Study
from seatruth.trials.check import check_tables, check_trials
from seatruth.trials.finding import Finding, gravest_first
from seatruth.trials.trial import Step
from seatruth.uncertainty.covariance import Covariance, active_bounds, at_bound, covariance, on_bound
from seatruth.uncertainty.fit_table import FIT_COLUMNS, compare_with_records
from seatruth.uncertainty.identifiability import (
    correlated_pairs,
    identifiability,
    strongly_correlated,
    verdict,
    without,
)
from seatruth.uncertainty.moved_coefficients import Coefficient, moved_coefficients
from seatruth.uncertainty.optima import optima, optima_findings
from seatruth.uncertainty.reliability import (
    beyond_noise,
    far_initial_states,
    short_of_minimum,
    step_to_minimum,
    stray_finding,
    stray_runs,
)
from seatruth.uncertainty.rounding import rounded_finding, rounded_share
from seatruth.uncertainty.sensitivity import sensitivity
from seatruth.uncertainty.structural_identifiability import held_by_priors, unidentifiable_directions

_COARSE = 0.3
"""Discretisation error over noise from which it is worth a warning."""
_EQUATION_ERROR = Finding(
    "note",
    "equation-error",
    "Noise in the measured states biases a regression on them, mostly towards zero; standard errors do not cover that.",
    "cost",
    "Smooth the states first, or refine the answer with a trajectory cost.",
)


def _polishes(described: Any) -> bool:
    """Whether a solver, or a stage of a hybrid, goes on to a minimum after its search."""
    if isinstance(described, Mapping):
        return "polish" in described or any(_polishes(one) for one in described.values())
    return isinstance(described, (list, tuple)) and any(_polishes(one) for one in described)


class Analysis:
    """Everything about a fit that needs its cost. `run` computes it; `estimate` returns what has been computed."""

    def __init__(
        self,
        study: Study,
        cost: StudyCost,
        outcome: Outcome,
        settings: Mapping[str, Mapping[str, Any]] | None = None,
        points: Array | None = None,
        outcomes: Sequence[Outcome] = (),
    ) -> None:
        """`outcome` is the best of the `outcomes` of a multi-start from these `points` (N, K), where there was one."""
        self.study, self.cost, self.outcome, self.settings = study, cost, outcome, dict(settings or {})
        self._points, self._outcomes = points, outcomes
        self.astray = False
        """Whether a run strays or an initial state is far from its first samples."""
        self.inflation = 1.0
        """Standard errors over those that white noise of the stated size would give."""
        self.starts: pd.DataFrame | None = None
        self._fitted: list[Array] = []
        self.x = outcome.x
        self.size = len(cost.parameters)
        self.stderr: Array = np.full(self.size, math.nan)
        self._doubted = np.zeros(self.size, dtype=np.bool_)
        self.at_bound = at_bound(self.x, cost.bounds)
        self.uncertainty: Covariance | None = None
        self.identifiability: dict[str, Any] = {"singular_values": [], "condition": math.nan, "weak": []}
        self._flat = np.zeros(self.size, dtype=np.bool_)
        self.sensitivity = pd.DataFrame()
        self.fit = pd.DataFrame(columns=list(FIT_COLUMNS))
        self.traces = pd.DataFrame()
        self.discretisation: dict[str, dict[str, float]] = {}
        self.findings: list[Finding] = []

    def run(self) -> None:
        """Computes all parts, the most important first; a diverged answer leaves its parts empty."""
        self.findings = list(check_study(self.study))
        self._doubted |= any(finding.code == "step-in-gap" for finding in self.findings)
        self.findings += _replaced(self.settings)
        do = "If it names a solver, correct it or take another one; if it names the checkpoint, make room for it."
        self.findings += [Finding("note", "search", note, "search", do) for note in self.outcome.notes]
        failed = failures_of(self.study.model)
        self.findings += [failed_runs(failed)] if failed else []
        if not math.isfinite(self.outcome.value):
            return
        if self.study.cost.kind == "regression":
            self.findings.append(_EQUATION_ERROR)
        parts = {
            "Standard errors": self._uncertainty,
            "The fit of each channel": self._compare,
            "The search for runs that stray": self._strays,
            "The comparison of the starts": self._optima,
            "Sensitivities": self._sensitivities,
            "The error of the integration steps": self._steps,
        }
        for title, part in parts.items():
            try:
                part()
            except SeatruthError as problem:  # a model that raises now cannot take the answer away
                self.findings.append(part_missing(title, problem))

    def estimate(self, interrupted: str = "") -> Estimate:
        """The estimate from the parts that have been computed."""
        outcome = self.outcome
        ended: dict[str, Any] = {"code": outcome.code, "reason": outcome.reason}
        if interrupted:
            ended = {"code": "interrupted", "reason": interrupted}
        ended |= {
            "value": outcome.value,
            "evaluations": outcome.evaluations,
            "diverged": outcome.diverged,
            "clipped": outcome.clipped,
            "wall_s": outcome.wall_s,
        }
        names = [parameter.name for parameter in self.cost.parameters]
        table = self._table()
        shown = [name for name in names if name not in self.cost.nuisances]
        study = self.study
        return Estimate(
            study=study.name,
            model=study.model.name,
            optimizer=_plain(outcome.optimizer),
            cost=_plain(self.cost.describe()),
            seed=outcome.seed,
            synthetic=study.synthetic,
            channels={channel.name: channel.unit for channel in study.model.outputs},
            parameters=table.loc[shown],
            nuisances=table.loc[list(self.cost.nuisances)],
            covariance=self._square(None if self.uncertainty is None else self.uncertainty.covariance, names),
            correlation=self._square(None if self.uncertainty is None else self.uncertainty.correlation, names),
            identifiability=_plain(self.identifiability),
            sensitivity=self.sensitivity,
            fit=self.fit,
            history=outcome.history.reset_index(drop=True),
            outcome=_plain(ended),
            discretisation=self.discretisation,
            traces=self.traces,
            starts=self.starts,
            steps=[
                (trial.name, Step(step.name, _plain(step.options), step.effect))
                for trial in (*study.trials, *study.holdout)
                for step in trial.steps
            ],
            findings=[*self.findings, *self._moved(table.loc[shown])],
            provenance=_plain(
                {
                    **provenance(),
                    "study_hash": study.content_hash,
                    "settings": self.settings,
                    **study.provenance,
                }
            ),
        )

    def _uncertainty(self) -> None:
        residuals, jacobian = self.cost.residuals(self.x), self.cost.jacobian(self.x)
        if not (np.isfinite(residuals).all() and np.isfinite(jacobian).all()):
            self.findings.append(
                Finding(
                    "warning",
                    "no-derivatives",
                    "The derivatives at the answer are not finite, so there are no standard errors.",
                    "search",
                    "Keep the bounds away from values at which the model diverges or has an infinite slope.",
                )
            )
            return
        slope = jacobian.T @ residuals
        held = active_bounds(self.x, self.cost.bounds, slope)
        self.uncertainty = covariance(residuals, jacobian, self.cost.residual_blocks, held)
        self.stderr = self.uncertainty.stderr
        low, high = self.cost.bounds
        step, fall = step_to_minimum(residuals, jacobian, ~held, (low - self.x, high - self.x))
        misfit, polished = float(np.mean(residuals**2)), _polishes(self.outcome.optimizer)
        if (short := short_of_minimum(fall, self.outcome.code, misfit=misfit, polished=polished)) is not None:
            self.findings.append(short)
            self._doubted |= np.abs(step) > np.where(np.isfinite(self.stderr), self.stderr, math.inf)
        rows = np.concatenate([group.rows for group in self.cost.residual_blocks if group.kind == "data"])
        columns = [k for k, p in enumerate(self.cost.parameters) if p.name not in self.cost.nuisances and not held[k]]
        with np.errstate(invalid="ignore", divide="ignore"):
            larger = self.uncertainty.stderr / self.uncertainty.crlb
        larger = larger[np.isfinite(larger)]
        self.inflation = float(np.median(larger)) if larger.size else 1.0
        # A change that free initial states can compensate says nothing about the parameters.
        data = without(jacobian[rows], [self.cost.names.index(name) for name in self.cost.nuisances])
        exact = unidentifiable_directions(self.cost, self.x)
        open_ = [entry["step"] for entry in exact if not held_by_priors(entry["combination"], self.cost.parameters)]
        self._flat = np.any([np.zeros(self.size), *open_], axis=0)
        steps = np.array([entry.pop("step")[columns] for entry in exact]).reshape(len(exact), len(columns))
        self.identifiability = identifiability(
            data[:, columns], [self.cost.parameters[k] for k in columns], self.inflation, steps
        )
        self.identifiability["weak"] = [*exact, *self.identifiability["weak"]]
        known = {frozenset(entry["combination"]) for entry in self.identifiability["weak"]}
        self.identifiability["weak"] += [
            entry
            for entry in correlated_pairs(self.uncertainty, self.cost.parameters)
            if frozenset(entry["combination"]) not in known
            and not set(entry["combination"]) <= set(self.cost.nuisances)
        ]

    def _compare(self) -> None:
        self.fit, self.traces, self._fitted = compare_with_records(self.cost, self.x, list(self.study.holdout))
        rounded = rounded_finding(rounded_share(self.cost, self._fitted))
        self.findings += [rounded] if rounded is not None else []

    def _strays(self) -> None:
        """Finds simulated runs, and initial states, that are far from the record."""
        options = self.study.cost
        if not isinstance(options, TrajectoryOptions):
            return
        whole = options.segments is None or options.multiple_shooting  # else no run as a whole was fitted
        strays = stray_runs(self.cost, self._fitted) if whole else []
        far = far_initial_states(self.cost, self.x)
        self.findings += [stray_finding(strays, self.cost)] if strays else []
        self.findings += far
        self.astray = bool(strays or far)
        self._doubted |= self.astray
        if not self.astray:
            missed = beyond_noise(self.cost, self.x, starts_free=options.initial == "free")
            self.findings += [missed] if missed else []

    def _optima(self) -> None:
        """Compares the optima of a multi-start."""
        if self._points is None or len(self._outcomes) < 2:
            return
        found = optima(self.cost, self._points, self._outcomes, self.stderr, self.inflation)
        self.starts = found.table
        self.findings += optima_findings(found, self.cost.names)
        self._doubted |= found.differ | found.doubts_all

    def _sensitivities(self) -> None:
        self.sensitivity = sensitivity(self.cost, self.x)

    def _steps(self) -> None:
        for name, error in self.cost.discretisation(self.x).items():
            noise = self.cost.sigma.get(name, math.nan)
            ratio = error / noise if noise > 0 else math.nan
            self.discretisation[name] = {"error": error, "noise": noise, "ratio": ratio}
        coarse = {name: entry["ratio"] for name, entry in self.discretisation.items() if entry["ratio"] > _COARSE}
        if coarse:
            worst = max(coarse, key=lambda name: coarse[name])
            self.findings.append(
                Finding(
                    "warning",
                    "coarse-steps",
                    f"Halving the integration steps changes {worst} by {coarse[worst]:.2g} times its noise.",
                    "simulation",
                    "Set max_step in [cost] to less than the sampling step.",
                    channel=worst,
                )
            )

    def _moved(self, table: pd.DataFrame) -> list[Finding]:
        """What surely lies far from its stated prior: one of the two is wrong."""
        columns = table[["unit", "prior_mean", "prior_sd", "value", "stderr", "at_bound"]]
        fitted = [Coefficient(str(name), *row) for name, row in zip(columns.index, columns.itertuples(index=False))]
        return moved_coefficients({p.name for p in self.study.parameters if p.prior is not None}, fitted)

    def _table(self) -> pd.DataFrame:
        uncertainty = self.uncertainty
        half = np.full(self.size, math.nan) if uncertainty is None else uncertainty.half_width()
        bound = np.full(self.size, math.nan) if uncertainty is None else uncertainty.crlb
        unseen = np.zeros(self.size, dtype=bool) if uncertainty is None else uncertainty.unidentifiable | self._flat
        # A member of a flat direction that came to lie on a bound does not determine the others.
        open_ended = unseen & ~self.at_bound
        half, bound = np.where(open_ended, math.inf, half), np.where(open_ended, math.inf, bound)
        related = np.zeros(self.size, dtype=bool) if uncertainty is None else strongly_correlated(uncertainty)
        rows = []
        for k, parameter in enumerate(self.cost.parameters):
            value, stderr = on_bound(float(self.x[k]), parameter), math.inf if open_ended[k] else float(self.stderr[k])
            signs = (self.at_bound[k], unseen[k], related[k], self._doubted[k])
            judgement = verdict(parameter, value, stderr, *(bool(sign) for sign in signs))
            rows.append(
                (
                    *(value, parameter.unit, stderr, value - float(half[k]), value + float(half[k])),
                    *(float(bound[k]), parameter.value, parameter.min, parameter.max, *_prior(parameter)),
                    *(bool(self.at_bound[k]), judgement if uncertainty is not None else "", parameter.source),
                    parameter.description,
                )
            )
        names = pd.Index([parameter.name for parameter in self.cost.parameters], name="name")
        frame = pd.DataFrame(rows, columns=list(PARAMETER_COLUMNS), index=names)
        numbers = [c for c in PARAMETER_COLUMNS if c not in ("unit", "at_bound", "verdict", "source", "description")]
        return frame.astype({**dict.fromkeys(numbers, "float64"), "at_bound": "bool"})

    @staticmethod
    def _square(values: Array | None, names: Sequence[str]) -> pd.DataFrame:
        index = pd.Index(list(names), name="name")
        return pd.DataFrame(math.nan if values is None else values, index=index, columns=list(names), dtype=float)


def check_study(study: Study) -> list[Finding]:
    """All findings about a study's trials, gravest first."""
    trials = [*study.trials, *study.holdout]
    if study.cost.kind == "formula":
        return check_tables(trials, study.model)
    found = without_stale_notes(check_trials(trials, study.model), study, trials)
    fault = fault_of(study.model)
    if fault is not None:
        return gravest_first([*found, model_fault(fault), *steps_in_gaps(study, trials)])
    found += [*stepped_orders(study, trials), *steps_in_gaps(study, trials), *current_rates(study)]
    found += [*outside_forces(study), *input_range(study), *far_sensors(study), *receiver_in_two_places(study)]
    found += turned_sway(study, found)
    return gravest_first(found)


def model_fault(problem: SeatruthError) -> Finding:
    """A finding that the equations of the model cannot be simulated as they stand."""
    return Finding("error", "model-equations", f"{problem.what}.", problem.where, problem.do)


def failed_runs(text: str) -> Finding:
    """A finding that runs of a simulator failed, and why."""
    do = "A few are no harm: each counts as diverged. If they are many, narrow the bounds or raise the time limit."
    return Finding("note", "runs-failed", text, "simulation", do)


def _replaced(settings: Mapping[str, Mapping[str, Any]]) -> list[Finding]:
    """Says what a call or the command line replaced in a study."""
    names = [name for name, entry in settings.items() if "replaces" in entry and entry.get("study_file")]
    if not names:
        return []
    return [
        Finding(
            "note",
            "settings-replaced",
            f"This run does not use what the study file says of: {', '.join(names)}.",
            "study",
            "The provenance of the result holds both values.",
        )
    ]


def part_missing(title: str, problem: SeatruthError) -> Finding:
    """A finding that a part of the estimate could not be computed, and why."""
    return Finding("warning", "part-missing", f"{title} could not be computed: {problem.message}", "model")


def _prior(parameter: Parameter) -> tuple[float, float]:
    return (math.nan, math.nan) if parameter.prior is None else (parameter.prior.mean, parameter.prior.sd)


def _plain(value: Any) -> Any:
    """A value as it comes back from a saved estimate."""
    return decoded(encoded(value))
