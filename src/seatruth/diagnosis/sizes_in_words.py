"""The fitted size of an effect in the words of those who sail: a rate in place of a slowness, where that says more."""

from __future__ import annotations

import math
from collections.abc import Sequence

from seatruth.diagnosis.sentences import size_in_words
from seatruth.diagnosis.verdict import EffectParameter
from seatruth.effects import Effect
from seatruth.effects.rate_limits import RateLimit
from seatruth.effects.targets import targets
from seatruth.models.base import Model
from seatruth.text import with_error


def effect_in_words(effect: Effect, model: Model, parameters: Sequence[EffectParameter]) -> str:
    """The size of an effect: "1.605 +- 0.006 deg/s in place of 2.8 deg/s", "angle 0.12 +- 0.02 deg".

    A rate limit of a rudder or a plane is that at which it turns, with the servo that the study states: its slowness
    adds to the stated one.
    """
    if not isinstance(effect, RateLimit) or len(parameters) != 1 or parameters[0].unit != "s/rad":
        return size_in_words(parameters)
    own, values = parameters[0], model.nominal()
    limits = {values.get(f"{target.input}_rate_limit", math.inf) for target in targets(effect, model)}
    if len(limits) != 1:
        return size_in_words(parameters)
    stated = limits.pop()
    slowness = own.value + 1.0 / stated
    if not slowness > 0.0:
        return size_in_words(parameters)
    rate = math.degrees(1.0 / slowness)
    words = f"{with_error(rate, rate * own.stderr / slowness)} deg/s"
    return words if math.isinf(stated) else f"{words} in place of {math.degrees(stated):.3g} deg/s"


def furthest(effect: Effect, parameters: Sequence[EffectParameter]) -> str:
    """What of an effect is furthest from what is believed of it: its size, or a parameter of its form in words."""
    far = max(parameters, key=lambda q: abs(q.value - q.null) / q.prior_sd if q.prior_sd > 0.0 else 0.0, default=None)
    if far is None or far.name in effect.magnitudes:
        return "size"
    return f"{far.name.replace('_', ' ')} of {far.value:.2g}"
