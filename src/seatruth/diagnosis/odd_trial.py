"""A trial that is unlike the others: a wrong column, or what acts in it alone, which would be taken for a cause in all.

Where what the other trials have in common explains each of them to its noise, and all of them only with missing forces,
what is missing is in the one that was left out. Of a tanker in a current, whose revolutions were recorded 10 % low in
one of four trials, a dead band of the rudder had 95 %.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from seatruth.diagnosis.fit import Fit, fit
from seatruth.diagnosis.gap import misfit, refit_initial_states
from seatruth.diagnosis.hypotheses import HOPE, Key, Search
from seatruth.diagnosis.prediction_errors import noise_deviation
from seatruth.diagnosis.problem import Point, Problem
from seatruth.diagnosis.sections import left_out_together
from seatruth.diagnosis.sizes import noise_prior
from seatruth.diagnosis.steps import likelihood_at
from seatruth.effects import Effect
from seatruth.models.base import whole_name
from seatruth.text import listed
from seatruth.trials.finding import Finding
from seatruth.trials.trial import Trials

_FEWEST = 4
"""Trials from which one can be unlike the others. [S] Of three, two that agree may do so by chance."""
_ENOUGH = 10.0
"""nats that missing forces may bring to the other trials. [S] A tenth of what they bring at least to all."""
_NOISE = 1.5
"""Noise of a channel in the other trials, over that of all beside forces, from which it stands for more than noise. [S]
"""
_TRIED, _AS_NEAR = 3, 1.5
"""Sets that are fitted to the others, and their mean squared error, as linearized, over the least up to which they are.
[S]"""
_MOSTLY, _FURTHER = 0.98, 1.1
"""Quantile of what a trial does that counts as its most, and that of the others over which it goes further. [S]"""
_LITTLE = math.log(0.003)
"""Log size of forces, over the usual ones, from which those beside a fit without any are sought. [S]"""


def odd_trials(found: Search, say: Callable[[str, int, int], None] = lambda *_: None) -> list[Finding]:
    """A finding on the trial without which what is common to the others explains them, if there is one.

    An error where it does what the others do as well, and a warning where it goes further than they do: there a model
    of another form is as likely. `say` gets what is done next, how much is done, and how much is expected. An interrupt
    ends the search as it is.
    """
    try:
        return _odd_trials(found, say)
    except KeyboardInterrupt:
        found.interrupted = True
        return []


def _odd_trials(found: Search, say: Callable[[str, int, int], None]) -> list[Finding]:
    problem, leader = found.problem, found.leader
    groups = left_out_together(problem.trials)
    if len(groups) < _FEWEST or problem.few_runs is not None or not leader.discrepancy:
        return []
    say("which trial the others do not need", 0, 1 + _TRIED)
    promising = sorted(_promising(found, groups), key=lambda one: one[0])
    if not promising:
        return []
    least, _, group = promising[0]
    keys = [key for far, key, other in promising if other is group and far < _AS_NEAR * least]
    others = [k for k in range(len(problem.trials)) if k not in group]
    for done, key in enumerate(sorted(keys, key=len)[:_TRIED]):
        say(f"the others without {problem.trials[group[0]].name}", 1 + done, 1 + _TRIED)
        try:
            explained = _explained(found, key, others)
        except np.linalg.LinAlgError:
            continue
        if explained:
            return [_finding(problem, found.fits[key, False], group, [problem.effects[name] for name in key])]
    return []


def _promising(found: Search, groups: Sequence[Sequence[int]]) -> Iterator[tuple[float, Key, Sequence[int]]]:
    """Mean squared error over the noise of all trials but one, as one step from the fit to all leads there.

    With that trial's places, and the effects that are common to all: those of the leading set that has no sizes of each
    trial, all or some, where all trials need forces beside them.
    """
    problem = found.problem
    common = [name for name in found.leader.effects if not problem.effects[name].each_trial]
    sets = itertools.chain.from_iterable(itertools.combinations(common, n) for n in range(len(common) + 1))
    for key in sets:
        plain, loose = (found.fits.get((key, on)) for on in (False, True))
        if plain is None or loose is None or loose.evidence < plain.evidence + HOPE:
            continue
        sizes = loose.sizes.without_discrepancy()
        likelihood = likelihood_at(problem, plain.linearized(problem), sizes, key)
        deviation = noise_deviation(problem, loose.sizes)
        for group in groups:
            rest = [k for k in range(len(problem.trials)) if k not in group]
            step = likelihood.shared_step(sizes, key, rest).shared
            shared = np.clip(plain.point.shared + step, problem.low, problem.high)
            there = refit_initial_states(problem, Point(shared, plain.point.initial, plain.point.forces), deviation)
            counted = np.isin(problem.trial_of, rest)
            yield misfit(problem, deviation, there, counted) / float(counted.sum()), key, group


def _explained(found: Search, key: Key, others: Sequence[int]) -> bool:
    """Whether a set explains some of the trials to their noise, and needs no forces there."""
    whole = found.problem
    names = {whole_name(whole.trials[k].name) for k in others}
    study = whole.study.replace(trials=Trials([trial for trial in whole.study.trials if trial.name in names]))
    problem = Problem(study, [whole.effects[name] for name in key], whole.settings, threads=whole.threads)
    if [trial.name for trial in problem.trials] != [whole.trials[k].name for k in others]:
        return False  # cut into other sections, without the longest one
    before = found.fits[key, False]
    # The others alone may have humps of the resistance at speeds of their own; none has a coefficient here.
    known_there = whole.named(before.point)
    begin = zip(problem.unknowns, problem.start.shared.tolist())
    shared = np.array([known_there.get(unknown.name, value) for unknown, value in begin])
    start = Point(shared, before.point.initial[list(others)], np.zeros_like(problem.start.forces))
    known, loose = noise_prior(problem), found.fits[key, True]
    plain = fit(problem, key, start, loose.sizes.without_discrepancy(), known, discrepancy=False)
    deviation = noise_deviation(problem, plain.sizes) / noise_deviation(whole, loose.sizes)
    if not plain.settled or (deviation > _NOISE).any():
        return False
    held = fit(problem, key, plain.point, plain.sizes.with_discrepancy(_LITTLE), known, discrepancy=True)
    return held.evidence < plain.evidence + _ENOUGH


def _finding(problem: Problem, before: Fit, group: Sequence[int], effects: Sequence[Effect]) -> Finding:
    name, errors = whole_name(problem.trials[group[0]].name), problem.errors(before.point)
    missed = {
        channel: float(np.sqrt(np.mean(errors[problem.channel_of == c] ** 2))) / math.exp(before.sizes.white[c])
        for c, channel in enumerate(problem.outputs)
        if (problem.channel_of == c).any()
    }
    beside = f" with {listed([effect.title for effect in effects])}" if effects else ""
    text = (
        f"It is unlike the others. Without it the refitted model{beside} follows them to their noise; with it, it "
        f"misses {max(missed, key=lambda channel: missed[channel])} most."
    )
    further = _goes_further(problem, group)
    if further:
        text += f" It goes further than the others in {listed(further)}, where the form of the model may be another."
        do = "Add a trial like it, which tells the two apart, or diagnose the others without it."
    else:
        do = "Look at this trial first: its inputs, units, loading and sensors. Then diagnose the others without it."
    return Finding("warning" if further else "error", "odd-trial", text, f"trial {name!r}", do, name)


def _goes_further(problem: Problem, group: Sequence[int]) -> list[str]:
    """Inputs and speeds of which a trial holds larger ones than all others."""
    names = [channel.name for channel in problem.study.model.inputs]
    names += [name for name in problem.equations if name in problem.outputs]

    def size(name: str, places: Sequence[int]) -> float:
        trials = [problem.trials[k] for k in places]
        known = [np.abs(np.asarray(t.inputs.get(name, t.outputs.get(name, ())), dtype=np.float64)) for t in trials]
        values = np.concatenate([*known, np.zeros(1)])
        return float(np.quantile(values[np.isfinite(values)], _MOSTLY))

    others = [k for k in range(len(problem.trials)) if k not in group]
    apart = left_out_together([problem.trials[k] for k in others])
    return [
        name
        for name in names
        if size(name, group) > _FURTHER * max(size(name, [others[k] for k in one]) for one in apart)
    ]
