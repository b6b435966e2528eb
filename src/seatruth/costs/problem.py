"""What a cost needs to know: a model, the trials it is fitted to, its parameters, the noise, and the cost's options."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass, field
from functools import cached_property
from typing import Any, Literal, Self, TypeVar

import numpy as np

from seatruth.costs.content import hash_of, of_model, of_trial
from seatruth.costs.options import CostOptions, TrajectoryOptions, is_positive
from seatruth.costs.parameter_space import ParameterSpace
from seatruth.errors import BadInput, nearest
from seatruth.models.base import Model
from seatruth.models.parameter import Parameter
from seatruth.trials.trial import Trial, Trials

Deviation = float | Literal["estimate"]
OptionsT = TypeVar("OptionsT", bound=CostOptions)


@dataclass(frozen=True, eq=False)
class EstimationProblem:
    """A model bound to the trials it is fitted to, and how a candidate is compared with them.

    `parameters` are all of the model's, in its order, each free (`vary`), fixed or set by an expression; where none
    are stated, the model's own. `constraints` are relations such as "Y_v * N_r > 0". `noise` holds the standard
    deviation of each output in its SI unit, or "estimate", which outputs that are not named get as well. `cost` holds
    the options of the cost; its type says which cost it is. Raises BadInput for anything that does not fit together.
    """

    name: str
    model: Model
    trials: Trials
    _: KW_ONLY
    parameters: tuple[Parameter, ...] = ()
    constraints: tuple[str, ...] = ()
    noise: Mapping[str, Deviation] = field(default_factory=dict)
    cost: CostOptions = field(default_factory=TrajectoryOptions)

    def __post_init__(self) -> None:
        if not isinstance(self.trials, Trials):
            object.__setattr__(self, "trials", Trials(list(self.trials)))
        object.__setattr__(self, "parameters", tuple(self.parameters) or self.model.parameters)
        object.__setattr__(self, "constraints", tuple(self.constraints))
        where = f"study {self.name!r}"
        if not isinstance(self.cost, CostOptions):
            raise BadInput(
                f"cost is {self.cost!r}", where=where, do="Give TrajectoryOptions, RegressionOptions or FormulaOptions."
            )
        self.cost.check(self.model, where)
        self._check_parameters(where)
        self._check_noise(where)
        self._check_trials(where)

    @cached_property
    def space(self) -> ParameterSpace:
        """The free parameters with their expressions, priors and constraints."""
        return ParameterSpace(self.parameters, self.constraints)

    @property
    def free(self) -> tuple[Parameter, ...]:
        """The parameters to identify."""
        return tuple(parameter for parameter in self.parameters if parameter.vary)

    @cached_property
    def content_hash(self) -> str:
        """Hash of everything that decides the cost of a candidate; names of files do not count."""
        return hash_of(self._content())

    def replace(self, **changes: Any) -> Self:
        """Returns a copy with some fields changed.

        Raises:
            BadInput: a field does not exist, or the changed fields do not fit together.
        """
        known = [entry.name for entry in dataclasses.fields(self)]
        for name in changes:
            if name not in known:
                raise BadInput(f"a study has no {name!r}", do=nearest(name, known))
        return dataclasses.replace(self, **changes)

    def with_trials(self, trials: Trials) -> Self:
        """Returns a copy that is fitted to other trials and holds none out."""
        return self.replace(trials=trials)

    def options(self, kind: type[OptionsT]) -> OptionsT:
        """The cost's options, which must be of this kind. Raises BadInput otherwise."""
        if not isinstance(self.cost, kind):
            raise BadInput(
                f"its cost is {self.cost.kind}, not {kind.kind}",
                where=f"study {self.name!r}",
                do="`cost_of` chooses the cost that belongs to the options.",
            )
        return self.cost

    def _predicted_only(self) -> tuple[Trial, ...]:
        """Trials that are checked with the others but not fitted."""
        return ()

    def _content(self) -> dict[str, Any]:
        """What decides the cost of a candidate."""
        content: dict[str, Any] = {
            "model": of_model(self.model),
            "space": self.space.describe(),
            "noise": dict(self.noise),
            "cost": self.cost.describe(),
            "trials": [of_trial(trial) for trial in self.trials],
        }
        if self.model.trials:
            content["numbers"] = [self.model.number_of(trial.name) for trial in self.trials]
        return content

    def _check_parameters(self, where: str) -> None:
        wanted = [parameter.name for parameter in self.model.parameters]
        stated = [parameter.name for parameter in self.parameters]
        for name in stated:
            if name not in wanted:
                raise BadInput(
                    f"model {self.model.name!r} has no parameter {name!r}", where=where, do=nearest(name, wanted)
                )
        missing = [name for name in wanted if name not in stated]
        if missing:
            raise BadInput(f"parameter {missing[0]!r} of model {self.model.name!r} is missing", where=where)
        if stated != wanted:
            by_name = {parameter.name: parameter for parameter in self.parameters}
            if len(by_name) != len(stated):
                raise BadInput("a parameter is given twice", where=where)
            object.__setattr__(self, "parameters", tuple(by_name[name] for name in wanted))
        assert self.space is not None  # building it checks expressions and constraints

    def _check_noise(self, where: str) -> None:
        outputs = [channel.name for channel in self.model.outputs]
        for name, value in self.noise.items():
            if name not in outputs:
                raise BadInput(f"noise of an unknown output {name!r}", where=where, do=nearest(name, outputs))
            if value != "estimate" and not is_positive(value):
                raise BadInput(
                    f"the noise of {name!r} is {value!r}", where=where, do='Give a number > 0 or "estimate".'
                )

    def _check_trials(self, where: str) -> None:
        if not len(self.trials):
            raise BadInput("it has no trial to fit", where=where, do="Add one, or give one the role 'fit'.")
        outputs = [channel.name for channel in self.model.outputs]
        unknown = [trial.name for trial in self.trials if trial.name not in self.model.trials]
        if self.model.trials and unknown:
            raise BadInput(
                f"the model has an effect with values for each trial, and none for {unknown[0]!r}",
                where=where,
                do="Make it for the trials of the study: effect.of_trials([trial.name for trial in trials]).",
            )
        for trial in (*self.trials, *self._predicted_only()):
            place = f"trial {trial.name!r}"
            for channel in self.model.inputs:
                if channel.name not in trial.inputs:
                    hint = nearest(channel.name, [*trial.inputs, *trial.outputs])
                    raise BadInput(f"it has no input {channel.name!r}", where=place, do=hint)
                if not np.isfinite(trial.inputs[channel.name]).all():
                    raise BadInput(
                        f"input {channel.name!r} has values that are not numbers", where=place, do="Fill its gaps."
                    )
            if not any(np.isfinite(trial.outputs[name]).any() for name in outputs if name in trial.outputs):
                raise BadInput(
                    "it has no valid sample of any output", where=place, do=f"The model's are {', '.join(outputs)}."
                )
            if len(trial) < 2 and self.cost.kind != "formula":
                raise BadInput("it has only one sample", where=place, do="Remove it.")
