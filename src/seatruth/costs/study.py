"""A study: a model bound to trials, what is free in it, and how a candidate is measured."""

from __future__ import annotations

import dataclasses
import hashlib
import html
import inspect
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

import numpy as np

from seatruth.costs.parameter_space import ParameterSpace
from seatruth.costs.study_cost import Group, StudyCost
from seatruth.errors import BadInput, nearest
from seatruth.models.base import Model
from seatruth.models.black_box import BlackBox
from seatruth.models.formula import Formula
from seatruth.models.parameter import Parameter
from seatruth.simulate import fingerprint
from seatruth.trials.trial import Trial, Trials

__all__ = ["Group", "ParameterSpace", "Study", "StudyCost", "cost_of"]

Kind = Literal["trajectory", "regression", "formula"]
Deviation = float | Literal["estimate"]
_CHOICES: dict[str, tuple[str, ...]] = {
    "cost": ("trajectory", "regression", "formula"),
    "hold": ("linear", "zero"),
    "initial": ("fixed", "free"),
    "criterion": ("weighted", "likelihood"),
    "form": ("euler", "central", "trapezoid"),
}
_OPTIONS: dict[str, tuple[str, ...]] = {
    "trajectory": ("hold", "max_step", "initial", "initial_sd", "segments", "multiple_shooting", "criterion"),
    "regression": ("form", "equations"),
    "formula": (),
}


@dataclass(frozen=True, eq=False)
class Study:
    """A model, the trials it is fitted to, and the question.

    `parameters` are all of the model's, in its order, each free (`vary`), fixed or tied; those of the model where
    none are given. `noise` gives standard deviations by output in SI units, or "estimate", which is also what an
    output that is not named gets. `holdout` trials are predicted only. The other fields are the options of the cost,
    as a study file has them. Raises BadInput for anything that does not fit together.
    """

    name: str
    model: Model
    trials: Trials
    holdout: Trials = field(default_factory=lambda: Trials([]))
    parameters: tuple[Parameter, ...] = ()
    constraints: tuple[str, ...] = ()
    cost: Kind = "trajectory"
    noise: Mapping[str, Deviation] = field(default_factory=dict)
    provenance: Mapping[str, Any] = field(default_factory=dict)
    hold: Literal["linear", "zero"] = "linear"
    max_step: float | None = None
    initial: Literal["fixed", "free"] = "fixed"
    initial_sd: Mapping[str, float] = field(default_factory=dict)
    segments: float | None = None
    multiple_shooting: bool = False
    criterion: Literal["weighted", "likelihood"] = "weighted"
    form: Literal["euler", "central", "trapezoid"] = "trapezoid"
    equations: Sequence[str] | None = None

    def __post_init__(self) -> None:
        for name in ("trials", "holdout"):
            given = getattr(self, name)
            if not isinstance(given, Trials):
                object.__setattr__(self, name, Trials(list(given)))
        object.__setattr__(self, "parameters", tuple(self.parameters) or self.model.parameters)
        object.__setattr__(self, "constraints", tuple(self.constraints))
        if self.equations is not None:
            object.__setattr__(self, "equations", tuple(self.equations))
        where = f"study {self.name!r}"
        for key, choices in _CHOICES.items():
            if getattr(self, key) not in choices:
                value = getattr(self, key)
                raise BadInput(f"{key} is {value!r}", where=where, do=nearest(str(value), choices))
        self._check_parameters(where)
        self._check_numbers(where)
        self._check_trials(where)

    @cached_property
    def space(self) -> ParameterSpace:
        """The free parameters with their ties, priors and constraints."""
        return ParameterSpace(self.parameters, self.constraints)

    @property
    def free(self) -> tuple[Parameter, ...]:
        """The parameters to identify."""
        return tuple(parameter for parameter in self.parameters if parameter.vary)

    @property
    def synthetic(self) -> bool:
        """Whether any trial was made by a simulator."""
        return any(trial.synthetic for trial in (*self.trials, *self.holdout))

    @property
    def cost_options(self) -> dict[str, Any]:
        """The kind of cost and its options."""
        return {"kind": self.cost, **{key: _plain(getattr(self, key)) for key in _OPTIONS[self.cost]}}

    @cached_property
    def content_hash(self) -> str:
        """Hash of everything that decides the result: model, parameters, data, noise, cost; not of names of files."""
        content = {
            "model": _of_model(self.model),
            "space": self.space.describe(),
            "noise": {name: _plain(value) for name, value in self.noise.items()},
            "cost": self.cost_options,
            "trials": [_of_trial(trial) for trial in self.trials],
            "holdout": [_of_trial(trial) for trial in self.holdout],
        }
        return hashlib.sha256(json.dumps(_plain(content), sort_keys=True).encode()).hexdigest()

    def but(self, **changes: Any) -> Study:
        """A copy with some fields changed."""
        known = [entry.name for entry in dataclasses.fields(self)]
        for name in changes:
            if name not in known:
                raise BadInput(f"a study has no {name!r}", do=nearest(name, known))
        return dataclasses.replace(self, **changes)

    def _repr_html_(self) -> str:
        label = " (synthetic)" if self.synthetic else ""
        rows = "".join(
            f"<tr><td>{q.name}</td><td>{q.value:.5g}</td><td>{q.unit}</td><td>{q.min:.4g} to {q.max:.4g}</td></tr>"
            for q in self.free
        )
        held = f"<p>Held out:</p>{self.holdout._repr_html_()}" if len(self.holdout) else ""
        return (
            f"<p><b>{html.escape(self.name)}</b>{label}: model {html.escape(self.model.name)}, cost {self.cost}</p>"
            f"<table><tr><th>free parameter</th><th>start</th><th>unit</th><th>bounds</th></tr>{rows}</table>"
            f"<p>Fitted to:</p>{self.trials._repr_html_()}{held}"
        )

    def _check_parameters(self, where: str) -> None:
        wanted = [parameter.name for parameter in self.model.parameters]
        given = [parameter.name for parameter in self.parameters]
        for name in given:
            if name not in wanted:
                raise BadInput(
                    f"model {self.model.name!r} has no parameter {name!r}", where=where, do=nearest(name, wanted)
                )
        missing = [name for name in wanted if name not in given]
        if missing:
            raise BadInput(f"parameter {missing[0]!r} of model {self.model.name!r} is missing", where=where)
        if given != wanted:
            by_name = {parameter.name: parameter for parameter in self.parameters}
            if len(by_name) != len(given):
                raise BadInput("a parameter is given twice", where=where)
            object.__setattr__(self, "parameters", tuple(by_name[name] for name in wanted))
        assert self.space is not None  # checks ties and constraints

    def _check_numbers(self, where: str) -> None:
        outputs = [channel.name for channel in self.model.outputs]
        for name, value in self.noise.items():
            if name not in outputs:
                raise BadInput(f"noise of an unknown output {name!r}", where=where, do=nearest(name, outputs))
            if value != "estimate" and not _positive(value):
                raise BadInput(
                    f"the noise of {name!r} is {value!r}", where=where, do='Give a number > 0 or "estimate".'
                )
        states = [channel.name for channel in self.model.states]
        for name, value in self.initial_sd.items():
            if name not in states:
                raise BadInput(f"initial_sd of an unknown state {name!r}", where=where, do=nearest(name, states))
            if not _positive(value):
                raise BadInput(f"initial_sd of {name!r} is {value!r}", where=where, do="Give a number > 0.")
        if self.initial_sd and self.initial != "free":
            raise BadInput(
                "initial_sd is given but the initial states are fixed", where=where, do='Set initial = "free".'
            )
        for key in ("max_step", "segments"):
            value = getattr(self, key)
            if value is not None and not _positive(value):
                raise BadInput(f"{key} is {value!r}", where=where, do="Give seconds > 0.")
        if self.multiple_shooting and self.segments is None:
            raise BadInput(
                "multiple_shooting joins segments, and there are none", where=where, do="Set segments = ...."
            )
        for name in self.equations or ():
            if name not in states:
                raise BadInput(f"there is no equation of {name!r}", where=where, do=nearest(name, states))

    def _check_trials(self, where: str) -> None:
        if not len(self.trials):
            raise BadInput("it has no trial to fit", where=where, do="Add one, or give one the role 'fit'.")
        outputs = [channel.name for channel in self.model.outputs]
        for trial in (*self.trials, *self.holdout):
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
            if len(trial) < 2 and self.cost != "formula":
                raise BadInput("it has only one sample", where=place, do="Remove it.")


def cost_of(study: Study, *, trials: Trials | None = None, threads: int | None = None) -> StudyCost:
    """The cost that the study asks for, on its trials or on others (for cross-validation).

    `threads` is one a processor where None. The cost's description holds the hash of all that decides its values.
    """
    from seatruth.costs.registry import KINDS  # the costs themselves need the study

    used = study if trials is None else study.but(trials=trials, holdout=Trials([]))
    return KINDS[study.cost].make(used, threads)


def _positive(value: Any) -> bool:
    real = isinstance(value, (int, float, np.floating, np.integer)) and not isinstance(value, bool)
    return real and math.isfinite(value) and value > 0


def _of_trial(trial: Trial) -> dict[str, Any]:
    return {
        "name": trial.name,
        "t": np.asarray(trial.t),
        "inputs": {name: np.asarray(values) for name, values in trial.inputs.items()},
        "outputs": {name: np.asarray(values) for name, values in trial.outputs.items()},
    }


def _of_model(model: Model) -> dict[str, Any]:
    """What tells one model from another: its declaration, and its equations or the source of its function."""
    found: dict[str, Any] = {"name": model.name, "class": type(model).__qualname__}
    for part in ("states", "inputs", "outputs"):
        found[part] = [dataclasses.asdict(channel) for channel in getattr(model, part)]
    if not isinstance(model, BlackBox):
        found["equations"] = fingerprint(model)
    for part in ("initial_state", "function"):
        function = getattr(model, part, None)
        if function is not None:
            found[part] = _source(function)
    if isinstance(model, Formula):
        found["formula"] = model.text or _source(model.callback)
        found["weight"] = model.weight
    return found


def _source(function: Any) -> str:
    """The text of a function, or its name where the text is not to be had."""
    try:
        return inspect.getsource(function)
    except (OSError, TypeError):
        return str(getattr(function, "__qualname__", type(function).__qualname__))


def _plain(value: Any) -> Any:
    """A value as JSON whose text depends on it alone."""
    if isinstance(value, np.ndarray):
        data = np.ascontiguousarray(value)
        return [str(data.dtype), list(data.shape), hashlib.sha256(data.tobytes()).hexdigest()]
    if isinstance(value, Mapping):
        return {str(key): _plain(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(entry) for entry in value]
    if isinstance(value, np.generic):
        return value.item()
    return value
