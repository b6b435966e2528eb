"""Effects that have another size in each trial: a current that is not the same on two days, a gyro that is set anew.

An effect of this kind repeats an effect that is the same in all trials (`like`). Each magnitude of that effect becomes
one parameter for each trial of a study, with the same prior, so that the evidence pays for the freedom of each trial.
What is believed of them is correlated between trials: the wind of an afternoon turns and freshens, and is still the
same wind. Parameters that describe the form stay common. In a trial that the study does not name, the effect stands at
its null.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from seatruth.arrays import Array
from seatruth.effects.base import Effect, Hook
from seatruth.effects.environment import Current, CurrentAlong, as_drift
from seatruth.effects.sensors import GyroBias, HeadingBias
from seatruth.effects.weather import Wind
from seatruth.errors import PluginError
from seatruth.models.base import Model, record
from seatruth.models.parameter import Prior

_PLACES: Mapping[str, tuple[int, int]] = {
    "current": (4, 0),
    "force": (4, 0),
    "true_inputs": (2, 3),
    "measured_outputs": (3, 4),
}
"""Places of q and e among the arguments of each hook that can change from trial to trial."""


_SHARED = (
    *("number", "source", "kinds", "acts_on", "stochastic", "aliases", "power", "start"),
    *("needs_states", "needs_inputs", "needs_outputs", "needs_vehicle", "needs_parameters"),
)
"""Attributes that an effect has in common with the one that it repeats."""


class EachTrial(Effect):
    """Base of effects with values for each trial. A subclass names itself and the effect that it repeats.

    `trials` are the names of the trials; two unnamed ones stand for those of a study until `of_trials` gives them.
    Creating an instance raises PluginError where `like` has states of its own or changes the model's parameters.

    Example:
        >>> from seatruth.effects.each_trial import TrialCurrent
        >>> TrialCurrent(["out", "back"]).magnitudes
        ('north_out', 'east_out', 'north_back', 'east_back')
    """

    like: ClassVar[type[Effect]] = Effect
    each_trial = True
    alike: ClassVar[float] = 0.8
    """Correlation between two trials of what is believed of a magnitude. [S] Trials differ by half of what they have in
    common: sqrt((1 - 0.8) / 0.8) = 0.5, as the mean wind or a tidal stream does within some hours."""

    def __init__(self, trials: Sequence[str] = ("first", "second")) -> None:
        like = self.like()
        if like.states or like.true_parameters is not None or like.servo is not None:
            what = f"{like.name!r} has states, a servo, or other parameters: it cannot differ from trial to trial"
            raise PluginError(what, where=f"effect {self.name!r}", do="Name an effect without them in `like`.")
        self.trials = tuple(trials)
        labels = labels_of(self.trials)
        common = [q for q in like.parameters if q.prior is not None]
        self.parameters = (
            *(
                q.replace(name=f"{q.name}_{label}", description=f"{q.description}, trial {trial}")
                for trial, label in zip(self.trials, labels)
                for q in like.parameters
                if q.prior is None
            ),
            *common,
        )
        self.null = _repeated({name: like.null[name] for name in like.magnitudes}, labels)
        self.starts = tuple(_repeated({m: start[m] for m in like.magnitudes}, labels) for start in like.starts)
        sizes = {kind: _repeated(typical, labels) for kind, typical in like.typical_by_kind.items()}
        vars(self).update(typical_by_kind=sizes, froude=_repeated(like.froude, labels), scaled_by=like.scaled_by)
        for attribute in _SHARED:
            setattr(self, attribute, getattr(like, attribute))
        for role, (q_place, e_place) in _PLACES.items():
            hook = getattr(like, role)
            if hook is not None:
                setattr(self, role, _of_this_trial(hook, q_place, e_place, like, len(self.trials)))
        super().__init__()

    def of_trials(self, trials: Sequence[str]) -> Effect:
        found = type(self)(trials)
        found.title, found.cause, found.stands_for_untried = self.title, self.cause, self.stands_for_untried
        return found

    @property
    def correlation(self) -> Array:
        """Prior correlation (n, n) of its parameters: `alike` between the values of a magnitude in two trials."""
        count, sizes, total = len(self.trials), len(self.magnitudes), len(self.parameters)
        found = np.eye(total)
        # The magnitudes of one trial after those of another.
        between = np.kron(np.full((count, count), self.alike), np.eye(sizes // count))
        found[:sizes, :sizes] = np.where(np.eye(sizes) > 0.0, 1.0, between)
        return found

    def priors(self, model: Model) -> dict[str, Prior]:
        form = {name: prior for name, prior in self.like().priors(model).items() if name in self.shape_priors}
        return {**super().priors(model), **form}

    def missing(self, model: Model) -> str:
        if len(self.trials) == 1:
            return f"there is one trial: `{self.like.name}` says the same"
        return self.like().missing(model)


def _repeated(values: Mapping[str, float], labels: Sequence[str]) -> dict[str, float]:
    return {f"{name}_{label}": value for label in labels for name, value in values.items()}


def labels_of(trials: Sequence[str]) -> list[str]:
    """The names of the trials as parts of an identifier, each different from the others."""
    labels: list[str] = []
    for trial in trials:
        plain = re.sub(r"\W", "_", trial)
        label, copy = plain, 2
        while label in labels:
            label, copy = f"{plain}_{copy}", copy + 1
        labels.append(label)
    return labels


def is_trial(number: Any, k: int) -> Any:
    """1 in the trial of this place, 0 in others, for a hook that is compiled; `number` is that of the trial at hand."""
    return max(0.0, 1.0 - abs(number - float(k)))


def _of_this_trial(hook: Hook, q_place: int, e_place: int, like: Effect, trials: int) -> Hook:
    """The hook of `like` with the values of the trial at hand."""
    names = tuple(q.name for q in like.parameters)
    kind: Any = record("Effect", like.parameters)
    nulls = {name: float(like.null[name]) for name in like.magnitudes}
    order = tuple(nulls)
    size = len(order)

    def of_this_trial(*arguments: Any) -> Any:
        values, number = tuple(arguments[q_place]), arguments[e_place].trial
        own = dict(nulls)
        for k in range(trials):
            here = is_trial(number, k)
            for place, name in enumerate(order):
                own[name] = own[name] + here * (values[k * size + place] - nulls[name])
        form = iter(values[trials * size :])
        q = kind(*(own[name] if name in own else next(form) for name in names))
        return hook(*arguments[:q_place], q, *arguments[q_place + 1 :])

    return of_this_trial


class TrialCurrent(EachTrial):
    """A constant current of its own in each trial: trials of several days, or of several hours of a tide."""

    like = Current
    name = "trial_current"
    title = "constant current of its own in each trial"
    cause = "environment.moving_water.uniform_current"
    equation = "as a constant current, (north, east) of each trial"
    confused_with = ("current", "varying_current", "trial_wind", "speed_bias", "sway_bias", "wind")
    distinguished_by = "differs between trials of one course and speed; each of them must turn to show its own"

    def variants(self, model: Model) -> tuple[Effect, ...]:
        return (as_drift(self, model, "drift over the ground of its own in each trial (current or leeway)"),)


class TrialCurrentAlong(EachTrial):
    """The same along the track of a vehicle whose model has no heading."""

    like = CurrentAlong
    name = "trial_current_along"
    title = "constant current along the track, of its own in each trial"
    cause = "environment.moving_water.uniform_current"
    equation = "as a constant current along x of the earth, its size that of each trial"
    confused_with = ("current_along", "varying_current_along", "current_shear_along", "speed_bias", "speed_scale")
    distinguished_by = "differs between trials of one speed: with position"


class TrialWind(EachTrial):
    """A steady wind of its own in each trial; the form of its force belongs to the vehicle and is common to all."""

    like = Wind
    name = "trial_wind"
    title = "steady wind of its own in each trial"
    cause = "environment.force_fixed_to_earth.wind"
    equation = "as a steady wind, (north, east) of each trial"
    confused_with = ("wind", "wave_drift", "trial_current", "rudder_offset", "drag_increase")
    distinguished_by = "differs between trials of one course; each of them must turn to show its own"


class TrialHeadingBias(EachTrial):
    """A compass that is set, or a navigator that is aligned, anew before each trial."""

    like = HeadingBias
    name = "trial_heading_bias"
    title = "heading bias of its own in each trial"
    cause = HeadingBias.cause
    equation = "as a heading bias, b of each trial"
    confused_with = ("heading_bias", "trial_current", "compass_deviation")
    distinguished_by = "the track turns with the heading: each trial on several courses"
    alike = 0.5
    """[S] What is set anew differs by as much as the mounting, which stays."""


class TrialGyroBias(EachTrial):
    """A rate gyro whose offset is another one each time that it is switched on."""

    like = GyroBias
    name = "trial_gyro_bias"
    title = "yaw rate bias of its own in each trial"
    cause = GyroBias.cause
    equation = "as a yaw rate bias, b of each trial"
    confused_with = ("gyro_bias", "rudder_offset")
    distinguished_by = "a real turn shows in the heading too"
    alike = 0.5
    """[S] As for `TrialHeadingBias`."""


def repeats(effect: Effect, name: str) -> bool:
    """Whether an effect is the one of this name, with a value for each trial."""
    return isinstance(effect, EachTrial) and effect.like.name == name


def follows_each_trial(effect: Effect) -> bool:
    """Whether an effect has a phase of its own in each trial, as waves have: others do not predict it."""
    return effect.each_trial and effect.stochastic


def are_one(effects: Mapping[str, Effect], name: str, other: str) -> bool:
    """Whether one of two effects is the other with a value for each trial: no other cause."""
    return repeats(effects[name], other) or repeats(effects[other], name)
