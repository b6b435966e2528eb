"""Kinds of noise, and their realisations on a trial.

A realisation depends on its random stream alone, so every solver and every cost that is compared on it sees the same
numbers.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from seatruth.arrays import Array
from seatruth.errors import BadInput, nearest
from seatruth.trials.trial import Step, Trial


@dataclass(frozen=True)
class NoiseOption:
    """One option of a kind of noise, with its default and its range."""

    default: float
    low: float
    high: float
    doc: str


@dataclass(frozen=True)
class NoiseKind:
    """One kind of noise: its options, and how a channel's error (n,) of standard deviation `sd` is drawn.

    `draw(t, sd, options, rng)` gives what is added to the channel; NaN takes a sample away.
    """

    name: str
    title: str
    draw: Callable[[Array, float, Mapping[str, float], np.random.Generator], Array]
    options: Mapping[str, NoiseOption] = field(default_factory=dict)
    inputs: bool = False
    """Whether the inputs are noisy too."""


def _white(t: Array, sd: float, options: Mapping[str, float], rng: np.random.Generator) -> Array:
    return np.asarray(sd * rng.standard_normal(t.size))


def _coloured(t: Array, sd: float, options: Mapping[str, float], rng: np.random.Generator) -> Array:
    """AR(1): the correlation falls as exp(-dt/T), where T is so many samples; stationary from the first on."""
    step = float(np.median(np.diff(t))) if t.size > 1 else 1.0
    keep = np.exp(-np.diff(t, prepend=t[0] - step) / (options["samples"] * step))
    white = rng.standard_normal(t.size)
    noise = np.empty(t.size)
    noise[0] = white[0]
    for k in range(1, t.size):
        noise[k] = keep[k] * noise[k - 1] + math.sqrt(1.0 - keep[k] ** 2) * white[k]
    return np.asarray(sd * noise)


def _outliers(t: Array, sd: float, options: Mapping[str, float], rng: np.random.Generator) -> Array:
    """White noise in which a share of the samples is so many times as large."""
    white = rng.standard_normal(t.size)
    wild = rng.random(t.size) < options["share"]
    return np.asarray(sd * np.where(wild, options["size"] * white, white))


def _dropouts(t: Array, sd: float, options: Mapping[str, float], rng: np.random.Generator) -> Array:
    """White noise, and stretches of the given mean length without samples, together about the given share."""
    noise = sd * rng.standard_normal(t.size)
    length = options["length"]
    chance = min(1.0, options["share"] / (1.0 - options["share"]) / length)
    begin, stay = rng.random(t.size), rng.random(t.size)
    lost = False
    for k in range(1, t.size):
        lost = bool(stay[k] > 1.0 / length) if lost else bool(begin[k] < chance)
        if lost:
            noise[k] = math.nan
    return np.asarray(noise)


KINDS: dict[str, NoiseKind] = {
    kind.name: kind
    for kind in (
        NoiseKind("white", "independent, normal", _white),
        NoiseKind(
            "coloured",
            "AR(1): normal, and correlated in time",
            _coloured,
            {"samples": NoiseOption(10.0, 0.1, 1e6, "time constant of the correlation, in samples")},
        ),
        NoiseKind(
            "outliers",
            "white, with a share of samples that are far off",
            _outliers,
            {
                "share": NoiseOption(0.02, 0.0, 1.0, "share of the samples that are far off"),
                "size": NoiseOption(10.0, 1.0, 1e6, "how many times as large these are"),
            },
        ),
        NoiseKind(
            "dropouts",
            "white, with stretches without samples",
            _dropouts,
            {
                "share": NoiseOption(0.2, 0.0, 0.9, "share of the samples that are lost"),
                "length": NoiseOption(10.0, 1.0, 1e6, "mean length of a stretch, in samples"),
            },
        ),
        NoiseKind("input", "white on the outputs and on the inputs", _white, inputs=True),
    )
}


@dataclass(frozen=True)
class Noise:
    """One kind of noise at one level: a part of each channel's range (largest less smallest value of the clean data).

    `options` are those of the kind; its defaults are used for the others. The first sample of every trial stays
    clean where the study reads its initial state from it.
    """

    kind: str = "white"
    level: float = 0.0
    options: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        where = f"noise {self.kind!r}"
        if self.kind not in KINDS:
            raise BadInput(f"there is no noise {self.kind!r}", where="noise", do=nearest(str(self.kind), KINDS))
        if not _number(self.level) or not 0 <= self.level <= 10:
            raise BadInput(
                f"the level {self.level!r} is not possible",
                where=where,
                do="Give a part of the range: 0.01 is 1 %.",
            )
        known = KINDS[self.kind].options
        for name, value in self.options.items():
            if name not in known:
                raise BadInput(f"it has no option {name!r}", where=where, do=nearest(name, known) or "It takes none.")
            if not _number(value) or not known[name].low <= value <= known[name].high:
                raise BadInput(
                    f"{name} = {value!r} is out of range",
                    where=where,
                    do=f"Give {known[name].low:g} to {known[name].high:g}.",
                )
        full = {name: float(self.options.get(name, entry.default)) for name, entry in known.items()}
        object.__setattr__(self, "options", full)
        object.__setattr__(self, "level", float(self.level))

    @property
    def label(self) -> str:
        """The kind with the options that are not its defaults: "outliers (share 0.05)"."""
        options = KINDS[self.kind].options
        changed = [f"{name} {value:g}" for name, value in self.options.items() if value != options[name].default]
        return f"{self.kind} ({', '.join(changed)})" if changed else self.kind

    def describe(self) -> dict[str, Any]:
        return dataclasses.asdict(self)


def realise(
    noise: Noise,
    trial: Trial,
    output_sd: Mapping[str, float],
    input_sd: Mapping[str, float],
    rng: np.random.Generator,
    *,
    first: bool,
) -> Trial:
    """The trial with this noise on it. `..._sd` are standard deviations by channel; `first`: the first sample too."""
    kind = KINDS[noise.kind]
    outputs, inputs = dict(trial.outputs), dict(trial.inputs)
    for stream, (name, y) in zip(rng.spawn(len(outputs)), outputs.items()):
        error = kind.draw(trial.t, output_sd.get(name, 0.0), noise.options, stream)
        if not first:
            error[0] = 0.0
        outputs[name] = y + error
    if kind.inputs:
        for stream, (name, u) in zip(rng.spawn(len(inputs)), inputs.items()):
            inputs[name] = u + kind.draw(trial.t, input_sd.get(name, 0.0), noise.options, stream)
    step = Step("noise", noise.describe(), f"{noise.label} noise of {100 * noise.level:g} % of the range was added")
    return trial.with_step(step, outputs=outputs, inputs=inputs)


def _number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
