"""The next trial: which one of a menu would best separate the causes that these trials cannot.

A trial's worth is the chance that it doubles the smallest noncentrality between the survivors
(`discrimination.py`), in the mean over the survivors by their probability. The best ones are asked again with the
rivals of the leading survivor refitted. Where no trial of the menu has a chance worth its time, none is suggested.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from seatruth.diagnosis.clusters import Cluster
from seatruth.diagnosis.experiment_design.candidates import MAX_PHASES, Manoeuvre, Menu
from seatruth.diagnosis.experiment_design.discrimination import LEAST, Rivals, Table
from seatruth.diagnosis.hypotheses import Key, Search
from seatruth.diagnosis.parts import MenuEntry, NextTrial
from seatruth.diagnosis.posterior import without_other_forms
from seatruth.diagnosis.problem import Point, Problem
from seatruth.effects import Effect

_MOST_GAIN = 8.0
"""Factor at which a predicted gain is clipped: what it rests on is not known that well. [S]"""
_DOUBLED = 2.0
"""Factor from which a trial is worth its time: goal of the benchmark."""
_SPREAD = 0.5
"""Standard deviation of the logarithm of a predicted factor: sizes are fitted, and models bend. [S]"""
_LONGER = 0.03
"""Chance of doubling that one more manoeuvre must bring. [S]"""
_ELSEWHERE = 0.01
"""The same of another course or speed to begin with. [S]"""
_ASKED = 4
"""Trials, the best first, that are asked with rivals refitted. [S]"""
_KEPT = 3
"""Sequences that are continued; of a simulator whose runs are dear one, from its usual course and speed. [S]"""
_WORTH = 0.5
"""Chance of doubling below which no trial is suggested: more likely than not it would not. Of 95 opened cases of
`experiments/withheld` 9 had a suggestion of a lower chance; 2 of these doubled."""


_SURVIVORS = 4
"""Single effects that lead, between which the next trial is to decide beside those of the answer. [S]"""
HARDLY = 1e-3
"""Probability below which a single effect is no survivor. [S]"""


@dataclass(frozen=True)
class _Option:
    start: str
    phases: tuple[str, ...]
    entry: MenuEntry
    chance: float
    gains: Mapping[str, float]
    """Factor by true cause."""

    @property
    def worth(self) -> float:
        """Chance of doubling, less what the trial costs."""
        return self.chance - _LONGER * len(self.phases) - (_ELSEWHERE if self.start else 0.0)


def survivors(clusters: Sequence[Cluster], sets: Mapping[Key, float], effects: Mapping[str, Effect]) -> list[str]:
    """The effects that a further trial would have to tell apart.

    Of several named causes each acts: only what can stand in the place of one is to be told from it. Of an ROV with a
    dead band and a weak thruster, both named, a trial was suggested to tell the one from the other. `sets` are the
    answers with their probabilities.
    """
    members = [name for one in clusters if len(clusters) == 1 or len(one.effects) > 1 for name in one.effects]
    act = {name for one in clusters for name in one.effects} - {*members}
    alone = [key[0] for key, p in sets.items() if len(key) == 1 and p > HARDLY and key[0] not in act][:_SURVIVORS]
    return without_other_forms([*members, *alone], effects)


def next_trial(search: Search, chances: Mapping[str, float], say: Callable[[str, int, int], None]) -> NextTrial:
    """The trial that best separates the survivors; its `manoeuvre` is empty where none of the menu helps.

    It is empty as well where fewer than two survivors are left. `chances` are the survivors' probabilities.
    """
    rivals = Rivals(search, chances)
    if not rivals.before:
        return _none("One cause is left: nothing is to be separated.", tuple(rivals.chances), math.nan, ())
    menu = Menu(search.problem)
    options: list[_Option] = []
    starts, most = menu.starts(), _KEPT
    if search.problem.few_runs is not None:
        starts, most = starts[:1], 1
    expected = len(menu.phases) * (len(starts) + (MAX_PHASES - 1) * most)

    def consider(names: Sequence[str], start: str) -> None:
        option = menu.trial(names, start)
        say(option.name, len(options), expected)
        try:
            after = rivals.after(option.trial)
        except (ArithmeticError, ValueError, np.linalg.LinAlgError):
            return
        if after is not None:
            options.append(_option(option, after, rivals, start, tuple(names)))

    kept: list[tuple[str, tuple[str, ...]]] = [(start, ()) for start in starts]
    for many in range(1, MAX_PHASES + 1):
        for start, begun in kept:
            for name in menu.phases:
                if name not in begun:
                    consider((*begun, name), start)
        longest = sorted((o for o in options if len(o.phases) == many), key=lambda o: (o.worth, o.entry.manoeuvre))
        best_of = {option.phases: option for option in longest}
        leading = sorted(best_of.values(), key=lambda o: (o.worth, o.entry.manoeuvre))[-most:]
        kept = [(option.start, option.phases) for option in leading]
    options.sort(key=lambda o: (-o.worth, o.entry.manoeuvre))
    now = _nearest(rivals.before, rivals.leader)[0]
    names = tuple(rivals.chances)
    entries = tuple(option.entry for option in options)
    found = _best(options[:_ASKED], rivals, menu, now)
    if found is None:
        return _none("No trial of the menu is likely to double what tells them apart.", names, now, entries)
    best, now = found
    trial = menu.named(best.manoeuvre).trial
    inputs = {name: tuple(np.asarray(trial.inputs[name]).tolist()) for name in menu.inputs}
    t = tuple(np.asarray(trial.t).tolist())
    return NextTrial(best.manoeuvre, best.text, names, now, best.noncentrality, best.gain, entries, t, inputs, {}, {})


def _best(options: Sequence[_Option], rivals: Rivals, menu: Menu, linear: float) -> tuple[MenuEntry, float] | None:
    """The first trial that is worth its time with the leading survivor's gain refitted, and the noncentrality now.

    None if there is none. `linear` is the noncentrality now without a refit: of two that are compared, both are
    refitted or none is.
    """
    worth = [option for option in options if option.chance >= _WORTH]
    if not worth or rivals.problem.few_runs is not None:
        return (worth[0].entry, linear) if worth else None  # of a black box each refit would cost runs
    leader = rivals.leader
    now = rivals.refitted(leader, None)
    for option in worth:
        then = rivals.refitted(leader, menu.named(option.entry.manoeuvre).trial)
        if now is None or then is None:
            continue
        gains = {**option.gains, leader: min(option.gains[leader], max(then, LEAST) / max(now, LEAST))}
        if _chance_of(gains, rivals) >= _WORTH:
            gain = _mean_gain(gains, rivals)
            if then >= option.entry.noncentrality:
                return replace(option.entry, gain=gain), linear
            return replace(option.entry, noncentrality=then, gain=gain), now
    return None


def _none(why: str, survivors: tuple[str, ...], now: float, menu: tuple[MenuEntry, ...]) -> NextTrial:
    """No suggestion, with the reason in words."""
    return NextTrial("", why, survivors, now, now, 1.0, menu, (), {}, {}, {})


def with_motion(suggested: NextTrial, problem: Problem, point: Point) -> NextTrial:
    """The suggestion with the outputs that the model at a point expects of it; as it is where none is suggested."""
    if not suggested.manoeuvre:
        return suggested
    trial = Menu(problem).named(suggested.manoeuvre).trial
    sim = problem.on_trial(trial, (), problem.named(point))
    y = sim.outputs(np.zeros((1, 0)), sim.initial_states).y[0]
    model = problem.study.model
    return replace(
        suggested,
        motion={n: tuple(y[:, c].tolist()) for c, n in enumerate(problem.outputs) if np.isfinite(y[:, c]).all()},
        units={channel.name: channel.unit for channel in (*model.inputs, *model.outputs)},
    )


def _option(option: Manoeuvre, after: Table, rivals: Rivals, start: str, phases: tuple[str, ...]) -> _Option:
    gains = rivals.gains(after)
    least, nearest = _nearest(after, rivals.leader)
    entry = MenuEntry(option.name, option.text, least, _mean_gain(gains, rivals), (rivals.leader, nearest))
    return _Option(start, phases, entry, _chance_of(gains, rivals), gains)


def _mean_gain(gains: Mapping[str, float], rivals: Rivals) -> float:
    """Geometric mean of the factors, by probability."""
    return math.exp(rivals.mean({name: math.log(min(value, _MOST_GAIN)) for name, value in gains.items()}))


def _chance_of(gains: Mapping[str, float], rivals: Rivals) -> float:
    return rivals.mean({name: _chance(value) for name, value in gains.items()})


def _chance(gain: float) -> float:
    """Chance that a trial with this predicted factor doubles the noncentrality."""
    return 0.5 * math.erfc((math.log(_DOUBLED) - math.log(max(gain, 1e-9))) / (math.sqrt(2.0) * _SPREAD))


def _nearest(table: Table, leader: str) -> tuple[float, str]:
    """Noncentrality of the leading survivor to the nearest other one, and which that is."""
    return min((value, rival) for (true, rival), value in table.items() if true == leader)
