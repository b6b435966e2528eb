"""The recorded channels on whose sensors an effect acts."""

from __future__ import annotations

from seatruth.diagnosis.problem import Problem


def sensor_channels(problem: Problem, name: str) -> list[int]:
    """Numbers of the outputs on whose sensors an effect acts; none for what acts on no sensor."""
    places = problem.effects[name].places(problem.study.model)
    return [number for number, output in enumerate(problem.outputs) if f"sensor:{output}" in places]
