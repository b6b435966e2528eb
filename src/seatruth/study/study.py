"""A study: a model bound to trials, what varies, the noise, the cost, and how the search is run."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field
from pathlib import Path
from typing import Any, Self

import pandas as pd

from seatruth.costs.content import of_trial
from seatruth.costs.problem import EstimationProblem
from seatruth.errors import BadInput
from seatruth.estimate import Estimate
from seatruth.optimizers import Budget, Optimizer
from seatruth.statistics.posterior_sample import MOST_STEPS, STEPS
from seatruth.study.simulation import simulated
from seatruth.trials.trial import Trial, Trials

MOST_STARTS = 10_000
"""Starts of one identification: each is a search of its own. Chosen here [S]."""


def check_posterior_steps(steps: Any, where: str) -> None:
    """Raises BadInput for a number of steps of a sample that is none."""
    if isinstance(steps, bool) or not isinstance(steps, int) or not 1 <= steps <= MOST_STEPS:
        raise BadInput(f"{steps!r} steps are not possible", where=where, do=f"Give 1 to {MOST_STEPS}.")


@dataclass(frozen=True)
class OutputSettings:
    """What is computed besides the fit, and where the command line writes it.

    Args:
        folder: folder of the result; None leaves the choice to the caller.
        report: write report.html.
        cross_validate: leave out each trial in turn, fit the others and predict it.
        profile: names of the free parameters whose likelihood is profiled.
        posterior: sample the posterior (needs the extra "posterior").
        posterior_steps: steps of that sample at most.

    Example:
        >>> import seatruth.sample
        >>> from seatruth import OutputSettings
        >>> study = seatruth.sample.load().replace(output=OutputSettings(cross_validate=True, profile=("Y_v",)))
        >>> study.output.profile
        ('Y_v',)
    """

    folder: Path | None = None
    report: bool = True
    cross_validate: bool = False
    profile: tuple[str, ...] = ()
    posterior: bool = False
    posterior_steps: int = STEPS

    def __post_init__(self) -> None:
        check_posterior_steps(self.posterior_steps, "posterior_steps")


def check_starts(starts: Any, where: str) -> None:
    """Raises BadInput for a number of starts that is none."""
    if isinstance(starts, bool) or not isinstance(starts, int) or not 1 <= starts <= MOST_STARTS:
        raise BadInput(f"{starts!r} starts are not possible", where=where, do=f"Give 1 to {MOST_STARTS}.")


@dataclass(frozen=True, eq=False)
class Study(EstimationProblem):
    """A model bound to the trials it is fitted to, and everything that decides how it is identified.

    `load_study` makes one from a study file; what the file says is what `identify` and `diagnose` run.

    Args:
        name: name in results and reports.
        model: the simulator's equations, or a `BlackBox`.
        trials: the trials that are fitted.
        parameters: all parameters of the model, each free (`vary`), fixed or set by `expr`; default: the model's own.
        constraints: relations that every answer keeps, such as "Y_v * N_r > 0".
        noise: standard deviation of each output in its SI unit, or "estimate"; outputs that are not named: "estimate".
        cost: `TrajectoryOptions`, `RegressionOptions` or `FormulaOptions`; the type chooses the cost.
        holdout: trials that are predicted and never fitted.
        optimizer: name, `Optimizer`, or a list of them for a hybrid.
        starts: from how many starts the search is made; the first is at the parameters' values.
        budget: limits of the search from each start.
        diagnosis_budget: simulations of all trials that the diagnosis of a black box may take; None is no limit.
        seed: seed of everything random; the same seed gives the same result.
        output: what is computed besides the fit, and the folder of the result.
        provenance: where the study came from; copied into results.
        source: the study file, or None for a study made in Python.

    Raises:
        BadInput: the parts do not fit together.

    Example:
        >>> from seatruth import Budget, Study, load_model, read_trial
        >>> import seatruth.sample
        >>> study = seatruth.sample.load("study.toml").replace(seed=3, budget=Budget(evaluations=500))
        >>> study.seed, study.cost.kind, len(study.trials)
        (3, 'trajectory', 4)
    """

    _: KW_ONLY
    holdout: Trials = field(default_factory=lambda: Trials([]))
    optimizer: str | Optimizer | Sequence[str | Optimizer] = "least_squares"
    starts: int = 1
    budget: Budget = field(default_factory=Budget)
    diagnosis_budget: int | None = None
    seed: int = 0
    output: OutputSettings = field(default_factory=OutputSettings)
    provenance: Mapping[str, Any] = field(default_factory=dict)
    source: Path | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.holdout, Trials):
            object.__setattr__(self, "holdout", Trials(list(self.holdout)))
        check_starts(self.starts, f"study {self.name!r}")
        super().__post_init__()

    @property
    def synthetic(self) -> bool:
        """Whether any trial was made by a simulator."""
        return any(trial.synthetic for trial in (*self.trials, *self.holdout))

    def with_trials(self, trials: Trials) -> Self:
        """Returns a copy that is fitted to other trials and holds none out."""
        return self.replace(trials=trials, holdout=Trials([]))

    def simulate(
        self,
        parameters: Mapping[str, float] | Estimate | None = None,
        trials: Sequence[Trial] | None = None,
        *,
        threads: int | None = None,
    ) -> dict[str, pd.DataFrame]:
        """Simulates trials in the open loop with the model of the study.

        Args:
            parameters: values by name that replace the study's; or an `Estimate`, whose free initial states are used
                as well. None takes the study's values. Parameters with an `expr` follow the others.
            trials: the trials whose inputs and times are used; None takes the fitted ones, then those held out.
            threads: threads of the simulation; None takes one per processor.

        Returns:
            One table per trial, by the trial's name: index t (n,) in s, one column for each output of the model in the
            model's unit (`frame.attrs["units"]`). Values are NaN from where the simulation diverges. Every run starts
            from the first valid samples of its trial unless the estimate holds its initial state.

        Raises:
            BadInput: a name is no parameter of the model, or a trial lacks an input.

        Example:
            >>> import seatruth.sample
            >>> study = seatruth.sample.load("study.toml")
            >>> runs = study.simulate({"current_north": 0.1})
            >>> runs["turning_circle_35"].columns.tolist()
            ['x', 'y', 'psi', 'u', 'v', 'r']
        """
        chosen = [*self.trials, *self.holdout] if trials is None else list(trials)
        if isinstance(parameters, Estimate):
            first = {str(name): float(value) for name, value in parameters.nuisances["value"].items()}
            return simulated(self, parameters.values, chosen, first, threads)
        return simulated(self, parameters or {}, chosen, {}, threads)

    def _predicted_only(self) -> tuple[Trial, ...]:
        return tuple(self.holdout)

    def _content(self) -> dict[str, Any]:
        return {**super()._content(), "holdout": [of_trial(trial) for trial in self.holdout]}

    def _repr_html_(self) -> str:
        label = " (synthetic)" if self.synthetic else ""
        rows = "".join(
            f"<tr><td>{q.name}</td><td>{q.value:.5g}</td><td>{q.unit}</td><td>{q.min:.4g} to {q.max:.4g}</td></tr>"
            for q in self.free
        )
        held = f"<p>Held out:</p>{self.holdout._repr_html_()}" if len(self.holdout) else ""
        return (
            f"<p><b>{html.escape(self.name)}</b>{label}: "
            f"model {html.escape(self.model.name)}, cost {self.cost.kind}</p>"
            f"<table><tr><th>free parameter</th><th>start</th><th>unit</th><th>bounds</th></tr>{rows}</table>"
            f"<p>Fitted to:</p>{self.trials._repr_html_()}{held}"
        )
