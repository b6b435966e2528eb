"""Searches made by hand, for what they fit next."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any, cast

import numpy as np

from seatruth.diagnosis.hypotheses import Key, Search
from seatruth.diagnosis.settings import Settings
from seatruth.effects import available
from seatruth.models import load_model

NAMES = ("rudder_rate_limit", "rudder_lag", "rudder_delay", "rudder_offset", "current", "trial_current")


def searched(evidence: dict[Key, float], names: Sequence[str] = NAMES) -> Search:
    """A search whose sets were fitted with forces, each effect with one parameter, 1 where it acts."""
    fits = {
        (key, True): SimpleNamespace(
            effects=key,
            discrepancy=True,
            evidence=value,
            point=SimpleNamespace(shared=np.array([float(name in key) for name in names]), initial=None, forces=None),
            sizes=None,
        )
        for key, value in evidence.items()
    }
    ends = np.full(len(names), 9.0)
    columns = {name: np.array([k]) for k, name in enumerate(names)}
    problem = SimpleNamespace(
        effects={name: available()[name] for name in names}, settings=Settings(), columns=columns, mean=0.0 * ends,
        low=-ends, high=ends, few_runs=None, study=SimpleNamespace(model=load_model("mmg")),
    )  # fmt: skip
    return Search(cast(Any, problem), cast(Any, None), fits=cast(Any, fits))
