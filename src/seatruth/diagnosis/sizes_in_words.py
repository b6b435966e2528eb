"""The fitted size of an effect in the words of those who sail: a rate in place of a slowness, where that says more."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from seatruth.diagnosis.earth_directions import in_words
from seatruth.diagnosis.verdict import EffectParameter
from seatruth.effects import Effect, dimensions_of
from seatruth.effects.causes import is_within
from seatruth.effects.each_trial import EachTrial
from seatruth.effects.rate_limits import RateLimit
from seatruth.effects.targets import targets
from seatruth.models.actuators import radian_in
from seatruth.models.base import Model
from seatruth.text import with_error

_WEIGHT = "loading.weight"
"""Node of the tree of causes whose effects' magnitudes are shares of the vehicle's mass."""
_KILOGRAMS = {"1": (1.0, "kg"), "1/m": (1.0, "kg/m"), "1/s": (3600.0, "kg/h")}
"""What such a share is multiplied by, beside the mass, and the unit that it then has."""
_FEWEST, _APART = 3, 3.0
"""Trials from which one can stand apart from the others, and how many times their own range it is away then. [S]"""


def size_in_words(parameters: Sequence[EffectParameter]) -> str:
    """Size of an effect, angles in degrees: "angle 0.12 +- 0.02 deg"; empty where it was not fitted.

    Components north and east are given as size and direction; of an effect with values for each trial, as their range.
    """
    across = _across_trials(parameters) or _of_waves(parameters)
    if across:
        return across
    direction = in_words(parameters)
    if direction:
        return direction
    parts = []
    for q in parameters:
        degrees = q.unit in ("rad", "rad/s")
        factor = math.degrees(1.0) if degrees else 1.0
        unit = q.unit.replace("rad", "deg") if degrees else q.unit
        text = f"{q.name.replace('_', ' ')} {with_error(q.value * factor, q.stderr * factor)}"
        parts.append(text if unit in ("", "1") else f"{text} {unit}")
    return ", ".join(parts)


def _across_trials(parameters: Sequence[EffectParameter]) -> str:
    """Components of each trial as a range: "0.35 to 0.44 m/s towards 47 to 68 deg"; empty where it has none.

    Directions over more than half of the compass have no range that says anything.
    """
    east = {q.name.removeprefix("east_"): q.value for q in parameters if q.name.startswith("east_")}
    pairs = [(q.value, east[q.name.removeprefix("north_")]) for q in parameters if q.name.startswith("north_")]
    if not pairs:
        return ""
    sizes, unit = [math.hypot(*pair) for pair in pairs], next(q.unit for q in parameters if q.name.startswith("north_"))
    middle = math.degrees(math.atan2(sum(e for _, e in pairs), sum(n for n, _ in pairs)))
    off = [(math.degrees(math.atan2(e, n)) - middle + 180.0) % 360.0 - 180.0 for n, e in pairs]
    if max(off) - min(off) > 180.0:
        return f"{min(sizes):.2g} to {max(sizes):.2g} {unit}, in each trial in another direction"
    ends = [f"{(middle + one) % 360.0:.0f}" for one in (min(off), max(off))]
    return f"{min(sizes):.2g} to {max(sizes):.2g} {unit} towards {ends[0]} to {ends[1]} deg"


def _of_waves(parameters: Sequence[EffectParameter]) -> str:
    """Amplitudes of waves as a range, their period and direction; empty for anything else.

    "0.02 to 0.06 m/s^2 in waves of 11.60 +- 0.05 s towards 180 +- 1 deg".
    """
    known = {q.name: q for q in parameters}
    if not {"ln_frequency", "towards"} <= set(known):
        return ""
    pairs = [(q, known[q.name.replace("cosine", "sine", 1)]) for q in parameters if q.name.startswith("cosine_")]
    sizes = [math.hypot(cosine.value, sine.value) for cosine, sine in pairs]
    period, way = 2.0 * math.pi / math.exp(known["ln_frequency"].value), known["towards"]
    length = with_error(period, period * known["ln_frequency"].stderr)
    angle = with_error(math.degrees(way.value) % 360.0, math.degrees(way.stderr))
    size = f"{min(sizes):.2g}" if len(sizes) == 1 else f"{min(sizes):.2g} to {max(sizes):.2g}"
    return f"{size} {pairs[0][0].unit} in waves of {length} s towards {angle} deg"


def effect_in_words(effect: Effect, model: Model, parameters: Sequence[EffectParameter]) -> str:
    """The size of an effect: "1.605 +- 0.006 deg/s in place of 2.8 deg/s", "angle 0.12 +- 0.02 deg".

    A rate limit of a rudder or a plane is that at which it turns, with the servo that the study states: its slowness
    adds to the stated one. Where the input is no angle, sizes are in its unit: "angle 0.0021 +- 0.0003 m". Weights are
    in kilograms.
    """
    if isinstance(effect, EachTrial) and len(effect.like().magnitudes) == 1 and parameters:
        return _over_trials(effect.like().magnitudes[0], effect, parameters)
    size = dimensions_of(model) if is_within(effect.cause, _WEIGHT) else None
    if size is not None:
        return ", ".join(
            _weight_in_words(q, size.mass) if q.name in effect.magnitudes else size_in_words((q,)) for q in parameters
        )
    found = {(target.full, _unit(model, target.input)) for target in targets(effect, model)} if _steers(effect) else {}
    if len(found) != 1:
        return size_in_words(parameters)
    radian, unit = next(iter(found))
    if isinstance(effect, RateLimit):
        return _rate_in_words(effect, model, parameters, radian, unit) or size_in_words(parameters)
    if radian_in(unit) is None:
        parameters = [_in_unit(q, radian, unit) if q.unit == "rad" else q for q in parameters]
    return size_in_words(parameters)


def _weight_in_words(q: EffectParameter, mass: float) -> str:
    """A share of the vehicle's mass as kilograms: "0.0277 +- 0.0003 kg", "-0.00079 +- 0.00003 kg/m"."""
    factor, unit = _KILOGRAMS[q.unit]
    return f"{with_error(factor * mass * q.value, factor * mass * q.stderr)} {unit}"


def _over_trials(name: str, effect: EachTrial, parameters: Sequence[EffectParameter]) -> str:
    """The range of what one magnitude is in each trial: "along -0.18 to 0.20 m/s".

    Where one trial stands apart from all others, it is named: "b 8 deg in 'zigzag', -0.03 to 0.01 deg in the others".
    """
    own = [q for q in parameters if q.name in effect.magnitudes]
    angle = own[0].unit in ("rad", "rad/s")
    factor, unit = (math.degrees(1.0), own[0].unit.replace("rad", "deg")) if angle else (1.0, own[0].unit)
    unit = "" if unit in ("", "1") else f" {unit}"

    def span(some: Sequence[EffectParameter]) -> str:
        low, high = (f"{factor * end:.2g}" for end in (min(q.value for q in some), max(q.value for q in some)))
        return f"{low} to {high}{unit}"

    odd = _standing_apart([q.value for q in own])
    if odd is None:
        return f"{name.replace('_', ' ')} {span(own)}"
    rest = [q for place, q in enumerate(own) if place != odd]
    alone = f"{factor * own[odd].value:.2g}{unit} in {effect.trials[odd]!r}"
    return f"{name.replace('_', ' ')} {alone}, {span(rest)} in the others"


def _standing_apart(values: Sequence[float]) -> int | None:
    """Place of the one of three values or more that is several times as far from the others as these lie apart."""
    if len(values) < _FEWEST:
        return None
    odd = max(range(len(values)), key=lambda k: abs(values[k] - (sum(values) - values[k]) / (len(values) - 1)))
    rest = [value for k, value in enumerate(values) if k != odd]
    nearest = min(abs(values[odd] - value) for value in rest)
    return odd if nearest > _APART * (max(rest) - min(rest)) else None


def _steers(effect: Effect) -> bool:
    return effect.actuator in ("rudder", "plane")


def _unit(model: Model, name: str) -> str:
    return next(channel.unit for channel in model.inputs if channel.name == name)


def _in_unit(q: EffectParameter, radian: float, unit: str) -> EffectParameter:
    ends = (q.value, q.stderr, q.lower, q.upper)
    value, stderr, lower, upper = (radian * end for end in ends)
    return replace(q, value=value, stderr=stderr, lower=lower, upper=upper, unit=unit)


def _rate_in_words(
    effect: Effect, model: Model, parameters: Sequence[EffectParameter], radian: float, unit: str
) -> str:
    """The fastest rate, with what the study states of it; empty where it has none."""
    values = model.nominal()
    limits = {values.get(f"{target.input}_rate_limit", math.inf) for target in targets(effect, model)}
    if len(parameters) != 1 or len(limits) != 1:
        return ""
    own, stated = parameters[0], limits.pop()
    slowness = own.value / radian + 1.0 / stated
    if not slowness > 0.0:
        return ""
    angle = radian_in(unit)
    factor, shown = (1.0, unit) if angle is None else (math.degrees(1.0) / angle, "deg")
    rate = factor / slowness
    words = f"{with_error(rate, rate * own.stderr / radian / slowness)} {shown}/s"
    return words if math.isinf(stated) else f"{words} in place of {factor * stated:.3g} {shown}/s"


def prior_deviations(parameters: Sequence[EffectParameter]) -> float:
    """The largest distance of an effect's parameters from their null, in deviations of what is believed of them."""
    return max((abs(q.value - q.null) / q.prior_sd for q in parameters if q.prior_sd > 0.0), default=0.0)


def furthest(effect: Effect, parameters: Sequence[EffectParameter]) -> str:
    """What of an effect is furthest from what is believed of it: its size, or a parameter of its form in words."""
    far = max(parameters, key=lambda q: abs(q.value - q.null) / q.prior_sd if q.prior_sd > 0.0 else 0.0, default=None)
    if far is None or far.name in effect.magnitudes:
        return "size"
    return f"{far.name.replace('_', ' ')} of {far.value:.2g}"
