"""Settings of a run: what the study says, and what an argument replaces."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from seatruth.optimizers import Budget, Optimizer, as_optimizer
from seatruth.study.study import Study, check_posterior_steps, check_starts


@dataclass(frozen=True)
class RunSettings:
    """What a run uses. `origin` says for each setting where its value comes from."""

    optimizer: Optimizer
    starts: int
    budget: Budget
    seed: int
    cross_validate: bool
    profile: tuple[str, ...]
    posterior: bool
    posterior_steps: int
    origin: dict[str, dict[str, Any]]


def run_settings(
    study: Study,
    optimizer: str | Optimizer | Sequence[str | Optimizer] | None = None,
    budget: Budget | None = None,
    seed: int | None = None,
    cross_validate: bool | None = None,
    profile: Sequence[str] | None = None,
    starts: int | None = None,
    posterior: bool | None = None,
    posterior_steps: int | None = None,
) -> RunSettings:
    """The study's settings with those arguments that are not None in their place.

    `origin` holds for each setting its value and `from`: "study file", "study" (made in Python) or "argument". Where an
    argument replaced another value, `replaces` holds what the study says, and `study_file` whether a file says it.
    """
    if starts is not None:
        check_starts(starts, "starts")
    if posterior_steps is not None:
        check_posterior_steps(posterior_steps, "posterior_steps")
    stated: dict[str, Any] = {
        "optimizer": as_optimizer(study.optimizer),
        "starts": study.starts,
        "budget": study.budget,
        "seed": study.seed,
        "cross_validate": study.output.cross_validate,
        "profile": study.output.profile,
        "posterior": study.output.posterior,
        "posterior_steps": study.output.posterior_steps,
    }
    arguments: dict[str, Any] = {
        "optimizer": None if optimizer is None else as_optimizer(optimizer),
        "starts": starts,
        "budget": budget,
        "seed": seed,
        "cross_validate": cross_validate,
        "profile": None if profile is None else tuple(profile),
        "posterior": posterior,
        "posterior_steps": posterior_steps,
    }
    used = {name: stated[name] if value is None else value for name, value in arguments.items()}
    origin = {}
    for name, value in used.items():
        entry = {"value": _plain(value), "from": "study file" if study.source is not None else "study"}
        if arguments[name] is not None:
            entry["from"] = "argument"
            if _plain(stated[name]) != entry["value"]:
                entry |= {"replaces": _plain(stated[name]), "study_file": study.source is not None}
        origin[name] = entry
    return RunSettings(**used, origin=origin)


def _plain(value: Any) -> Any:
    """A setting as plain values for the record of a result."""
    if isinstance(value, Optimizer):
        return value.describe()
    if isinstance(value, Budget):
        return dataclasses.asdict(value)
    return list(value) if isinstance(value, tuple) else value
