"""Solvers of other libraries as the measurements of speed run them, on a function of a whole population."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from seatruth.arrays import Array
from seatruth_optimizers.particle_swarm import unlogged_pyswarms

Values = Callable[[Array], Array]
"""Candidates (P, K) to their values (P,)."""


def swarm_of_pyswarms(particles: int, low: Array, high: Array) -> Any:
    """A swarm of pyswarms within the bounds (K,); its settings are Clerc and Kennedy's (2002), rounded."""
    with unlogged_pyswarms():
        from pyswarms.single import GlobalBestPSO

        settings = {"c1": 1.4962, "c2": 1.4962, "w": 0.7298}
        return GlobalBestPSO(particles, low.size, settings, bounds=(low, high), bh_strategy="nearest")


def problem_of_pymoo(values: Values, low: Array, high: Array) -> Any:
    """The function as pymoo's solvers take it, within the bounds (K,)."""
    from pymoo.core.problem import Problem

    class Function(Problem):  # type: ignore[misc]  # pymoo has no types
        def __init__(self) -> None:
            super().__init__(n_var=low.size, n_obj=1, xl=low, xu=high)

        def _evaluate(self, x: Array, out: dict[str, Any], *_: Any, **__: Any) -> None:
            out["F"] = values(x)[:, None]

    return Function()
