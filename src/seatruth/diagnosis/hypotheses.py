"""Which effects: every one alone, all pairs of the leaders, triples where two do not suffice.

Screening is linear and costs nothing: it orders the hypotheses. Those that lead are fitted without any approximation of
the model's response, since signatures of a large gap are not linear, and each fit is screened anew for what it lacks.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from seatruth.arrays import Array
from seatruth.diagnosis.fit import Fit, Screen, effect_screen, fit
from seatruth.diagnosis.initial_guess import STRAYED, from_pieces
from seatruth.diagnosis.noise import NoiseFloor, noise_floor, white_floor
from seatruth.diagnosis.problem import WIDER, GapProblem
from seatruth.effects import Effect

Say = Callable[[str], None]

SINGLES = 10
"""Effects fitted alone, the leaders of the screen, beside all with finite starting points that lead it."""
LEADERS = 4
"""Fitted hypotheses from which more effects are tried."""
ADDITIONS = 4
"""Effects tried beside each of them."""
_LARGE = 20.0
"""Log-evidence on the screen from which all effects are fitted."""
_MUCH = 10.0
"""Cost by which a set must be ahead of its part for the part to be fitted again."""
MORE = 3.0
"""Rise of the log-evidence on the screen from which one effect more is worth a fit."""
_MOST = 8
"""Effects at once."""
_WORTH = 6.0
"""Rise of the log-evidence from which a further one is worth it."""
ROUNDS = 3
"""Alternations between the fullest fit and the noise that it leaves."""
_FULL_STEPS = 8
_ROUGH = 2.0
_FIRST_STEPS = 25
_STATED = 1.5
"""Part of the noise that a study states up to which more is believed."""


@dataclass
class Search:
    """Every fitted hypothesis, by its effects in alphabetical order; () is the model without any."""

    problem: GapProblem
    floor: NoiseFloor
    fits: dict[tuple[str, ...], Fit] = field(default_factory=dict)
    screens: dict[tuple[str, ...], Screen] = field(default_factory=dict)
    starts: dict[str, tuple[Array, Array]] = field(default_factory=dict)
    """Pseudo-candidates "name@k": values of the effect's parameters (n,), and the whitened change of the errors."""
    beside: int = 0
    """Causes that act in any case, beside these effects."""
    cut: bool = False
    """The user stopped it: hypotheses that were not reached are screened only."""

    @property
    def base(self) -> Fit:
        return self.fits[()]

    def evidence(self, effects: Sequence[str]) -> float:
        """Log-evidence over the model without any effect: of the fit where there is one, else screened."""
        key = tuple(sorted(effects))
        if key in self.fits:
            return self.fits[key].evidence - self.base.evidence
        return self.screens[()].evidence(*key)

    def leaders(self, most: int) -> list[Fit]:
        ranked = sorted((f for f in self.fits.values() if f.effects), key=lambda f: -f.evidence)
        return ranked[:most]


def floor_of(problem: GapProblem, say: Say, most: Mapping[str, float] | None = None) -> tuple[NoiseFloor, Fit, Fit]:
    """The noise floor, the fullest fit (coefficients, initial states, every effect at once, under their priors) and the
    plain one, without effects.

    It begins with white noise of the size that the study states, or that neighbouring samples show. A floor begun with
    the errors of the unfitted model would take the gap's slow drift for the noise's memory, and keep it. `most` gives
    by channel what else is known of how large noise can be.
    """
    least = _half_digit(problem)
    sizes = _sizes(problem, least)
    floor = white_floor(problem.series, sizes)
    stated = {n: float(sd) for n, sd in problem.study.noise.items() if isinstance(sd, (int, float))}
    most = {name: _STATED * sd for name, sd in {**(most or {}), **stated}.items()}
    names = list(problem.effects)
    x = problem.start
    plain = fit(problem, (), floor, x, steps=_FIRST_STEPS, settled_at=_ROUGH)
    if not plain.misfit < STRAYED * problem.rows:
        nearer = from_pieces(problem, sizes)
        if nearer is not None:
            again = fit(problem, (), floor, nearer, steps=_FIRST_STEPS, settled_at=_ROUGH)
            plain = min(plain, again, key=lambda one: one.cost)
    full = plain
    for k in range(ROUNDS):
        say(f"Noise floor {k + 1} of {ROUNDS}")
        if np.isfinite(full.cost):
            x = full.x
        again = fit(problem, names, floor, x, steps=_FULL_STEPS if k else _FIRST_STEPS, settled_at=_ROUGH)
        if not np.isfinite(again.cost):
            break
        full, before = again, floor
        floor = _quieter(problem, (full, plain), least, most)
        if not all(np.isfinite(one.innovation) for one in floor.channels):
            return before, full, plain
        plain = fit(problem, (), floor, plain.x, steps=_FULL_STEPS, settled_at=_ROUGH)
        changes = [abs(a.innovation / b.innovation - 1.0) for a, b in zip(floor.channels, before.channels)]
        if k and max(changes) < 0.02:
            break
    return floor, full, plain


def _quieter(
    problem: GapProblem, fits: Sequence[Fit], least: Mapping[str, float], most: Mapping[str, float]
) -> NoiseFloor:
    """The noise that these fits leave: of each channel that of the fit which foretells it best.

    The fullest fit leaves least where it has settled; a fit of so many effects does not always.
    """
    found = [
        noise_floor(problem.series, problem.errors(one.x, one.active), taken=len(one.active), least=least, most=most)
        for one in fits
        if np.isfinite(one.cost)
    ]
    best = [min(channels, key=lambda one: one.innovation) for channels in zip(*(one.channels for one in found))]
    return dataclasses.replace(found[0], channels=tuple(best))


def _sizes(problem: GapProblem, least: Mapping[str, float]) -> dict[str, float]:
    """Noise of each channel to begin with: stated by the study, or that of second differences of its samples."""
    found = {}
    for name in problem.outputs:
        stated = problem.study.noise.get(name)
        if isinstance(stated, (int, float)):
            found[name] = float(stated)
            continue
        seconds = [np.diff(np.asarray(t.outputs[name]), n=2) for t in problem.trials if name in t.outputs]
        values = np.concatenate(seconds) if seconds else np.zeros(0)
        values = np.abs(values[np.isfinite(values)])
        size = 1.4826 * float(np.median(values)) / math.sqrt(6.0) if values.size else 0.0
        spread = max((float(np.nanstd(t.outputs[name])) for t in problem.trials if name in t.outputs), default=1.0)
        found[name] = max(size, least.get(name, 0.0), 1e-4 * spread, 1e-12)
    return found


def search(problem: GapProblem, floor: NoiseFloor, near: Array, plain: Array, say: Say, *, largest: int = 3) -> Search:
    """Screens and fits. `near` (K,) is where the fullest fit ended, a second start for every hypothesis; `plain` (K,)
    is where the one without effects did. Sets of up to `largest` effects are looked at.

    An interrupt once the model without effects is fitted ends it with what there is (`cut`).
    """
    found = Search(problem, floor)
    say("The model without any effect")
    found.fits[()] = _best(problem, (), floor, [problem.start, near, plain])
    if not np.isfinite(found.base.cost):
        return found
    _secants(found)
    found.screens[()] = effect_screen(found.base, problem, floor, {k: v[1] for k, v in found.starts.items()})
    try:
        _widened(found, near, say, largest)
    except KeyboardInterrupt:
        found.cut = True
    return found


def _widened(found: Search, near: Array, say: Say, largest: int) -> None:
    """Fits effects alone, in pairs and by threes."""
    problem = found.problem
    singles = _ranked(found.screens[()], problem)
    # What a large gap does is far from linear: there the screen's order is not to be trusted.
    many = len(singles) if _gain(found.screens[()], singles[0]) > _LARGE else SINGLES
    for k, name in enumerate(singles[:many]):
        say(f"Effects one by one: {name} ({k + 1} of {min(many, len(singles))})")
        _fitted(found, (name,), near)
    _freed(found)
    for size in range(2, largest + 1):
        for _number, leader in enumerate(f for f in found.leaders(LEADERS) if len(f.effects) == size - 1):
            own = _screened(found, leader)
            wanted = [n for n in _ranked(own, problem) if _gain(own, n) > (MORE if size > 2 else -1.0)]
            for name in wanted[:ADDITIONS]:
                say(f"Effects {'in pairs' if size == 2 else 'by threes'}: {' and '.join(leader.effects)} with {name}")
                _fitted(found, (*leader.effects, name), leader.x, near)
        _without_one(found)
        if size == 2:
            for pair in _pairs(found.screens[()], problem)[:ADDITIONS]:
                _fitted(found, pair, near)


def extended(found: Search, say: Say) -> None:
    """Adds effects to the leading set while its evidence rises, and leaves out what is no longer needed.

    A model that is wrong in many ways has many causes, none of which shows well before the others are in.
    """
    lead = found.leaders(1)[0]
    while len(lead.effects) < _MOST:
        say(f"Effects by {len(lead.effects) + 1}: {', '.join(lead.effects)}, and one more")
        names = _ranked(_screened(found, lead), found.problem)[:ADDITIONS]
        best = max((_fitted(found, (*lead.effects, name), lead.x) for name in names), key=lambda one: one.evidence)
        if best.evidence < lead.evidence + _WORTH:
            break
        lead = best
        for name in lead.effects:
            rest = _fitted(found, tuple(other for other in lead.effects if other != name), lead.x)
            lead = rest if rest.evidence > lead.evidence else lead


def _freed(found: Search) -> None:
    """Fits what has not settled again from where the best fit ended."""
    best = max(found.fits.values(), key=lambda one: one.evidence)
    for key, one in list(found.fits.items()):
        if one.settled or one is best:
            continue
        again = fit(found.problem, key, found.floor, best.x)
        if again.cost < one.cost:
            found.fits[key] = again
            if not key:
                _secants(found)
            found.screens.pop(key, None)
    _screened(found, found.base)


def _without_one(found: Search) -> None:
    """Fits the parts of the leading sets again from where the sets ended: a part may have stopped on its way."""
    for leader in found.leaders(2):
        for name in leader.effects if len(leader.effects) > 1 else ():
            key = tuple(other for other in leader.effects if other != name)
            known = found.fits.get(key)
            if known is None or known.cost > leader.cost + _MUCH:
                got = fit(found.problem, key, found.floor, leader.x)
                if known is None or got.cost < known.cost:
                    found.fits[key] = got
                    found.screens.pop(key, None)


def _fitted(found: Search, effects: Sequence[str], *near: Array) -> Fit:
    """Fits one hypothesis, from the best of the given points on; from the others only where that leads nowhere."""
    key = tuple(sorted(effects))
    if key in found.fits:
        return found.fits[key]
    problem = found.problem
    rival = min(one.cost for one in found.fits.values())
    begin = [*_started(found, key, near[0]), *near, found.base.x]
    best: Fit | None = None
    for x in begin:
        got = fit(problem, key, found.floor, x, rival=rival)
        if best is None or got.cost < best.cost - 1e-3:
            best = got
        if best.settled and best.cost < found.base.cost:
            break
    assert best is not None
    found.fits[key] = best
    return best


def _started(found: Search, key: Sequence[str], near: Array) -> list[Array]:
    """The finite starting points that the screen prefers to the slope at the null, for effects that have some."""
    screen = found.screens[()]
    x = near.copy()
    changed = False
    for effect in key:
        options = [name for name in screen.columns if name == effect or name.startswith(f"{effect}@")]
        best = max(options, key=screen.gain)
        if best != effect:
            x[found.problem.columns[effect]] = found.starts[best][0]
            changed = True
    return [x] if changed else []


def _best(problem: GapProblem, effects: Sequence[str], floor: NoiseFloor, starts: Sequence[Array]) -> Fit:
    return min((fit(problem, effects, floor, x) for x in starts), key=lambda one: one.cost)


def _screened(found: Search, at: Fit) -> Screen:
    key = at.effects
    if key not in found.screens:
        found.screens[key] = effect_screen(at, found.problem, found.floor, {k: v[1] for k, v in found.starts.items()})
    return found.screens[key]


def _gain(screen: Screen, name: str) -> float:
    """The best of an effect's slope at its null and its finite starting points."""
    options = [key for key in screen.columns if key == name or key.startswith(f"{name}@")]
    return max(screen.gain(option) for option in options)


def _ranked(screen: Screen, problem: GapProblem) -> list[str]:
    names = {key.partition("@")[0] for key in screen.columns}
    return sorted(names, key=lambda name: -_gain(screen, name))


def _pairs(screen: Screen, problem: GapProblem) -> list[tuple[str, str]]:
    names = [key for key in screen.columns if "@" not in key]
    pairs = [(a, b) for k, a in enumerate(names) for b in names[k + 1 :]]
    return sorted(pairs, key=lambda pair: -screen.gain(*pair))


def _secants(found: Search) -> None:
    """What each finite starting point changes in the errors, beside what the model without effects leaves."""
    problem, base = found.problem, found.base
    for name, effect in problem.effects.items():
        for k, start in enumerate(effect.starts):
            x = base.x.copy()
            values = np.array(
                [float(start[q.name]) * scale for q, scale in zip(effect.parameters, _scales(problem, effect))]
            )
            x[problem.columns[name]] = values
            errors = problem.errors(x)
            if np.isfinite(errors).all():
                found.starts[f"{name}@{k}"] = (values, found.floor.whiten(errors) - base.linear.errors)


def _scales(problem: GapProblem, effect: Effect) -> list[float]:
    """How much less an effect's starting points are on a small ship: as its typical magnitudes are."""
    sizes = problem.sd[problem.columns[effect.name]] / WIDER
    return [
        min(1.0, float(size) / abs(q.value - effect.null[q.name])) if q.name in effect.froude else 1.0
        for q, size in zip(effect.parameters, sizes)
    ]


def _half_digit(problem: GapProblem) -> dict[str, float]:
    """Deviation of rounding to the record's last digit: no noise can be less."""
    found: dict[str, float] = {}
    for name in problem.outputs:
        values = [np.asarray(t.outputs[name]) for t in problem.trials if name in t.outputs]
        finite = np.unique(np.concatenate([v[np.isfinite(v)] for v in values])) if values else np.zeros(0)
        steps = np.diff(finite)
        if steps.size and (np.abs(steps / steps.min() - np.rint(steps / steps.min())) < 1e-3).all():
            found[name] = float(steps.min()) / 12**0.5
    return found
