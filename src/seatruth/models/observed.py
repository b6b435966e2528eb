"""Models with the outputs that a log holds: the observation layer.

A log seldom holds the outputs that a model declares: it has the speed through the water, the course and speed over
ground, the position of an antenna. `observed` gives a model these as outputs, computed from its states, its rates and
the water's motion. An effect that moves the water, or that disturbs a sensor, so acts on what the sensor measures.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from seatruth.arrays import Array
from seatruth.errors import BadInput, nearest
from seatruth.models.base import Equations, Model, record
from seatruth.models.black_box import BlackBox
from seatruth.models.black_box_wrapper import BlackBoxWrapper
from seatruth.models.initial_motion import initial_motion
from seatruth.models.measures import MEASURES, Measure, Motion, Place, Water
from seatruth.models.ports import EARTH, Outside
from seatruth.models.servo_black_box import behind_servos
from seatruth.models.wrapper import ModelWrapper
from seatruth.trials.channel import Channel
from seatruth.trials.trial import Trial

ORIGIN: Place = (0.0, 0.0, 0.0)
_RATES: Mapping[str, str] = {"u_dot": "u", "v_dot": "v", "w_dot": "w", "p_dot": "p", "q_dot": "q", "r_dot": "r"}
_MEANT: Mapping[str, str] = {
    **dict.fromkeys(("stw", "speed_through_water", "log"), "A speed through the water, ahead, is 'u_w'."),
    **dict.fromkeys(("heading", "hdg", "yaw"), "A heading is 'psi'."),
    **dict.fromkeys(("rot", "yaw_rate", "rate_of_turn"), "A rate of turn is 'r'."),
}


@dataclass(frozen=True)
class Observation:
    """One channel of a log and what it measures.

    Args:
        channel: name of the channel; it becomes an output of the model.
        measures: name of what it measures, one of `MEASURES`; None takes the channel's name.
        at: place of the sensor in body axes, m: forward, starboard and down of the model's origin.

    Raises:
        BadInput: there is no such measure, or the place is no place.

    Example:
        >>> from seatruth.models import Observation
        >>> Observation("gps_speed", "sog", at=(12.0, 0.0, -20.0)).measure.title
        'speed over ground'
    """

    channel: str
    measures: str | None = None
    at: Place = ORIGIN

    def __post_init__(self) -> None:
        where = f"channel {self.channel!r}"
        if self.measured not in MEASURES:
            do = _MEANT.get(self.measured.lower()) or nearest(self.measured, MEASURES)
            raise BadInput(f"there is no measure {self.measured!r}", where=where, do=do)
        if len(self.at) != 3 or not all(math.isfinite(x) for x in self.at):
            raise BadInput("its place is not three finite numbers", where=where, do="Give metres as [x, y, z].")

    @property
    def measured(self) -> str:
        """Name of what it measures."""
        return self.measures or self.channel

    @property
    def measure(self) -> Measure:
        """What it measures."""
        return MEASURES[self.measured]


def observed(model: Model, observations: Sequence[Observation], keep: Sequence[str] = ()) -> Model:
    """The model with what a log's channels measure among its outputs.

    Args:
        model: the model; without observations it is returned as it is.
        observations: the channels. One that has the name of an output takes that output's place.
        keep: outputs that the log holds beside these. Other outputs for which an observation stands (`u` where the log
            holds `u_w`) are left out; a black box keeps all.

    Returns:
        A model with these outputs, whose initial state follows from them.

    Raises:
        BadInput: the model does not have what a channel measures, or a channel is named twice.

    Example:
        >>> from seatruth.models import Observation, load_model, observed
        >>> ship = observed(load_model("mmg"), [Observation("u_w"), Observation("v_w")])
        >>> [channel.name for channel in ship.outputs]
        ['x', 'y', 'psi', 'r', 'u_w', 'v_w']
    """
    if not observations:
        return model
    names = [observation.channel for observation in observations]
    twice = [name for name in names if names.count(name) > 1]
    if twice:
        raise BadInput(f"the channel {twice[0]!r} is named twice")
    sources = _Sources(model)
    for observation in observations:
        reason = _missing(model, sources, observation)
        if reason:
            raise BadInput(f"channel {observation.channel!r} measures the {observation.measure.title}: {reason[0]}",
                           where=f"model {model.name!r}", do=reason[1])  # fmt: skip
    if isinstance(model, BlackBox):
        return ObservedBlackBox(model, observations)
    return ObservedModel(model, observations, keep)


def stated_place(model: Model, measured: Collection[str]) -> Place | None:
    """Where a study says that a sensor of one of these measures sits; None where it says nothing.

    Example:
        >>> from seatruth.models import Observation, load_model, observed
        >>> ship = observed(load_model("mmg"), [Observation("sog", at=(12.0, 0.0, -20.0)), Observation("cog")])
        >>> stated_place(ship, ["sog"]), stated_place(ship, ["cog"])
        ((12.0, 0.0, -20.0), None)
    """
    around: Any = model
    while around is not None:
        for one in getattr(around, "observations", ()):
            if one.measured in measured and one.at != ORIGIN:
                x, y, z = one.at
                return x, y, z
        around = getattr(around, "base", None)
    return None


class _Sources:
    """Where the parts of the motion are found in a model's records: record ("states", "inputs"), place, sign."""

    def __init__(self, model: Model) -> None:
        self.found: dict[str, tuple[str, int, float]] = {}
        # A black box shows no states but its outputs.
        first = "outputs" if isinstance(model, BlackBox) else "states"
        for kind in (first, "inputs"):
            for place, channel in enumerate(getattr(model, kind)):
                name, sign = model.standard_of(channel.name)
                if name in Motion._fields:
                    self.found.setdefault(name, (kind, place, float(sign)))

    def motion(self, rates: bool) -> Callable[[Any, Any, Any], Motion]:
        """The function of (states or outputs, inputs, rates of the states) that gives the motion; else zero."""
        fields = Motion._fields
        found = [self.found.get(_RATES.get(name, name)) for name in fields]
        slope = [name in _RATES for name in fields]
        places = tuple(-1 if at is None else at[1] for at in found)
        signs = tuple(0.0 if at is None else at[2] for at in found)
        # 0: zero, 1: state, 2: input, 3: rate of a state
        kinds = tuple(
            0 if at is None or (dotted and (not rates or at[0] == "inputs"))
            else 3 if dotted else 2 if at[0] == "inputs" else 1
            for at, dotted in zip(found, slope)
        )  # fmt: skip

        def motion(s: Any, i: Any, s_dot: Any) -> Motion:
            values = []
            for kind, place, sign in zip(kinds, places, signs):
                value = 0.0 if kind == 0 else s[place] if kind == 1 else i[place] if kind == 2 else s_dot[place]
                values.append(value if sign >= 0.0 else -value)
            return Motion(*values)

        return motion


def _missing(model: Model, sources: _Sources, observation: Observation) -> tuple[str, str] | None:
    """Why a model cannot give what a channel measures, and what to do; None where it can."""
    measure = observation.measure
    if observation.channel in {channel.name for channel in model.inputs}:
        return "the channel is an input of the model", "Give the output another name, with `measures`."
    lacking = [name for name in measure.needs if name not in sources.found]
    if lacking:
        return f"the model has no {lacking[0]!r}", "Remove the channel, or set `extra = true` for the steps alone."
    if measure.in_water and isinstance(model, BlackBox):
        return _missing_water(model, sources, measure)
    if measure.in_water and not model.takes_current:
        return "no current can act on the model, as its rhs takes no environment e and has no state 'u'", (
            "Add e to its rhs (docs/models.md); or, where there was no current, name the channel "
            f"{measure.needs[0]!r} and say so."
        )
    if measure.accelerates:
        if isinstance(model, BlackBox):
            return "a black box does not show its accelerations", "Let it return them as an output of its own."
        if sources.found[measure.needs[0]][0] == "inputs":
            return f"{measure.needs[0]!r} is an input of the model, whose rate is not known", "Remove the channel."
    return None


def _missing_water(box: BlackBox, sources: _Sources, measure: Measure) -> tuple[str, str] | None:
    """Why the motion of the water about a black box is not known, and what to do; None where its port tells it."""
    axes = box.innermost.ports.current_axes
    if not axes:
        return "a black box without a port for a current does not show how the water moves", (
            f"Let it return {measure.name!r} as an output of its own, or take a current (docs/simulators.md)."
        )
    if axes == EARTH and "psi" not in sources.found:
        return "its current is in earth axes, and it does not return its heading", (
            "Let it return 'psi', or take the current in body axes: u_c, v_c."
        )
    return None


def _outputs(model: Model, observations: Sequence[Observation], kept: Callable[[str], bool]) -> list[Channel]:
    """The outputs with observations: those of the model that stay, in their order, then the new ones."""
    made = {
        one.channel: Channel(one.channel, one.measure.unit, _described(one), one.measure.angle) for one in observations
    }
    own = [made.pop(channel.name, channel) for channel in model.outputs if channel.name in made or kept(channel.name)]
    return [*own, *made.values()]


def _described(observation: Observation) -> str:
    at = observation.at
    place = "" if at == ORIGIN else f", at [{at[0]:g}, {at[1]:g}, {at[2]:g}] m"
    return f"{observation.measure.title}{place}"


class ObservedModel(ModelWrapper):
    """A model with the outputs that a log holds; made by `observed`."""

    def __init__(self, base: Model, observations: Sequence[Observation], keep: Sequence[str] = ()) -> None:
        self.observations = tuple(observations)
        self._sources = _Sources(base)
        replaced = {name for one in observations for name in one.measure.replaces} - {*keep}
        standard = {channel.name: base.standard_of(channel.name)[0] for channel in base.outputs}
        super().__init__(
            base, outputs=_outputs(base, observations, lambda name: standard[name] not in replaced or name in keep)
        )
        named = {one.channel: (one.measured, 1) for one in observations if one.channel != one.measured}
        self.standard = {**base.standard, **named}

    def make_output(self) -> Equations:
        base, rhs = self.base.output, self.base.rhs
        kind = record("Outputs", self.base.outputs)
        names = [channel.name for channel in self.base.outputs]
        accelerates = any(one.measure.accelerates for one in self.observations)
        motion = self._sources.motion(accelerates)
        functions = tuple(one.measure.function for one in self.observations)
        places = tuple(one.at for one in self.observations)
        number = {one.channel: k for k, one in enumerate(self.observations)}
        order = tuple(number.get(channel.name, -1) for channel in self.outputs)
        own = tuple(channel.name for channel in self.outputs)
        added = tuple(
            name for name, rate in _RATES.items() if self._sources.found.get(rate, ("", 0, 0.0))[0] == "states"
        )

        def output(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
            y = kind(*((getattr(s, name) for name in names) if base is None else base(s, i, p, e)))
            m = motion(s, i, rhs(s, i, p, e) if accelerates else ())
            if accelerates:
                m = m._replace(**{name: getattr(m, name) + getattr(e, name) for name in added})
            water = Water(e.u_c, e.v_c, e.w_c)
            return tuple(
                getattr(y, name) if k < 0 else functions[k](m, water, places[k]) for k, name in zip(order, own)
            )

        return output

    def make_initial_state(self) -> Equations:
        base, states = self.base.initial_state, [channel.name for channel in self.base.states]
        observations, model = self.observations, self.base
        outputs, kind = self.base.outputs, record("Outputs", self.base.outputs)
        kept = {channel.name for channel in self.outputs} - {one.channel for one in observations}

        def initial_state(y: Any, i: Any, p: Any) -> tuple[Any, ...]:
            m = initial_motion(_standard(y._asdict(), kept, model), _observations(observations), y._asdict())
            values = {}
            for channel in outputs:
                name, sign = model.standard_of(channel.name)
                values[channel.name] = (
                    getattr(y, channel.name) if channel.name in kept else sign * getattr(m, name, 0.0)
                )
            full = kind(**values)
            return tuple(base(full, i, p)) if base is not None else tuple(getattr(full, name) for name in states)

        return initial_state

    def complete(self, outputs: Mapping[str, float], inputs: Mapping[str, float]) -> dict[str, float]:
        """Outputs that were not recorded as the recorded ones imply them without a current; else zero."""
        return _complete(self.base, self.outputs, self.observations, outputs)


def shows_accelerations(model: Model) -> bool:
    """Whether an output of a model, or of the one that it wraps, is an acceleration."""
    while not isinstance(model, ObservedModel):
        if not isinstance(model, ModelWrapper):
            return False
        model = model.base
    return any(one.measure.accelerates for one in model.observations)


class ObservedBlackBox(BlackBoxWrapper):
    """A black box with the outputs that a log holds, computed from the outputs that it returns; made by `observed`."""

    def __init__(self, base: BlackBox, observations: Sequence[Observation]) -> None:
        self.observations = tuple(observations)
        self._motion = _Sources(base).motion(False)
        shared = [one.channel for one in observations if one.channel in {channel.name for channel in base.states}]
        if shared:
            raise BadInput(
                f"channel {shared[0]!r} is a state of a black box and cannot be measured elsewhere",
                where=f"model {base.name!r}",
                do="Give the channel another name, with `measures`.",
            )
        super().__init__(base, self._around, outputs=_outputs(base, observations, lambda name: True))
        self.standard = {
            **base.standard,
            **{one.channel: (one.measured, 1) for one in observations if one.channel != one.measured},
        }

    def complete(self, outputs: Mapping[str, float], inputs: Mapping[str, float]) -> dict[str, float]:
        """Outputs that were not recorded as the recorded ones imply them; else zero."""
        return _complete(self.base, self.outputs, self.observations, outputs)

    def _around(
        self,
        trial: Trial,
        parameters: dict[str, float],
        first_state: dict[str, float] | None,
        outside: Outside | None = None,
    ) -> Mapping[str, Array]:
        trial = behind_servos(self, trial, parameters)
        y = self.base.run(trial, parameters, first_state, outside)
        inputs = [trial.inputs[channel.name].tolist() for channel in self.base.inputs]
        rows = [self._motion(row, i, ()) for row, i in zip(y.tolist(), zip(*inputs) if inputs else [()] * len(y))]
        waters = self._waters(trial, y, rows, outside)
        made = {channel.name: y[:, k] for k, channel in enumerate(self.base.outputs)}
        for one in self.observations:
            function = one.measure.function
            values = [_finite(function, m, water, one.at) for m, water in zip(rows, waters)]
            made[one.channel] = np.array(values, dtype=np.float64)
        return made

    def _waters(self, trial: Trial, y: Array, rows: Sequence[Motion], outside: Outside | None) -> list[Water]:
        """The motion of the water at each sample: what acts through the port for a current."""
        if outside is None or not any(one.measure.in_water for one in self.observations):
            return [Water()] * len(rows)
        names, ports = [channel.name for channel in self.base.outputs], self.innermost.ports
        return [
            ports.water(outside(t, dict(zip(names, row))), m) for t, row, m in zip(trial.t.tolist(), y.tolist(), rows)
        ]


def _finite(function: Callable[[Motion, Water, Place], Any], m: Motion, water: Water, at: Place) -> float:
    """A measure of one sample; NaN where the run has diverged."""
    return float(function(m, water, at)) if all(math.isfinite(x) for x in m) else math.nan


def _observations(observations: Sequence[Observation]) -> list[tuple[str, str, Place]]:
    return [(one.channel, one.measured, one.at) for one in observations]


def _standard(values: Mapping[str, float], kept: set[str], model: Model) -> dict[str, float]:
    """Values of a model's own outputs under their standard names and signs."""
    result = {}
    for channel, value in values.items():
        if channel in kept:
            name, sign = model.standard_of(channel)
            result[name] = sign * value
    return result


def _complete(
    base: Model, outputs: Sequence[Channel], observations: Sequence[Observation], known: Mapping[str, float]
) -> dict[str, float]:
    made = {one.channel: one for one in observations}
    kept = {channel.name for channel in outputs} - {*made}
    m = initial_motion(_standard(known, kept, base), _observations(observations), known)
    result = {}
    for channel in outputs:
        name = channel.name
        if name in known:
            result[name] = known[name]
        elif name in made:
            result[name] = float(made[name].measure.function(m, Water(), made[name].at))
        else:
            standard, sign = base.standard_of(name)
            result[name] = sign * getattr(m, standard, 0.0)
    return result
