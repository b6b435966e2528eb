"""Number 11 of the catalogue: measurement noise of unusual kinds, which is no term of the equations.

These effects have no hooks and cannot be fitted; they are here so that lists, reports and benchmarks have names for
them. Residuals show them: by their smallest difference, their tails, and their correlation in time.
"""

from __future__ import annotations

from collections.abc import Mapping

from seatruth.effects.base import Effect
from seatruth.models.parameter import Parameter, Prior


class Noise(Effect):
    """Base of effects that are noise only."""

    cause = "sensor.noise"
    number = 11
    acts_on = ("sensor:any",)
    stochastic = True
    dynamic = False


class Quantisation(Noise):
    """A sensor with a coarse resolution. The record takes few values, all multiples of one step."""

    name = "quantisation"
    title = "coarse resolution"
    equation = "y_m = step round(y / step)"
    source = "[S] catalogue: the last digit of the record"
    distinguished_by = "differences between samples are multiples of one step, which is larger than the noise"
    parameters = (Parameter("step", 1.0, "1", 0.0, 100.0, source="[S] chosen here", description="over the noise"),)
    null: Mapping[str, float] = {"step": 0.0}


class Outliers(Noise):
    """Single samples with large errors. The residual has heavy tails and no correlation in time."""

    name = "outliers"
    title = "outliers"
    equation = "y_m = y + large, in a few samples"
    source = "[S] catalogue: 0.1 to 1 % of the samples"
    distinguished_by = "excess kurtosis of the residual, while its median deviation stays; `seatruth check` names them"
    parameters = (Parameter("rate", 0.005, "1", 0.0, 0.2, source="[S] catalogue", description="share of the samples"),)
    null: Mapping[str, float] = {"rate": 0.0}


class ColouredNoise(Noise):
    """Noise that is correlated in time, as from filters in instruments and from gusts."""

    name = "coloured_noise"
    title = "coloured noise"
    equation = "y_m = y + n, dn/dt = -n / time + white"
    source = "[L] first-order Gauss-Markov process; [S] magnitudes chosen here"
    confused_with = ("wave_forces", "varying_current")
    distinguished_by = "correlated residuals that replicates do not repeat, on one channel"
    parameters = (
        Parameter("sd", 1.0, "1", 0.0, 100.0, source="[S] chosen here", description="over the white noise"),
        Parameter(
            "time",
            3.0,
            "s",
            0.0,
            1000.0,
            prior=Prior(3.0, 3.0),
            source="[S] chosen here",
            description="correlation time",
        ),
    )
    null: Mapping[str, float] = {"sd": 0.0}
