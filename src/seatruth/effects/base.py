"""What a model may have left out: the Effect interface.

An effect is one small class of plain equations around a model. Each hook is optional:

    true_parameters(p, q)                 the model's parameters as they really are: loading, hydrodynamics
    current(e, s, i, p, q)                the motion of the water: e.u_c ... e.dw_c
    force(e, s, i, p, q, d)               outside forces and moments: e.X ... e.N
    true_inputs(i, s, q, e)               the inputs that really act: the actuator's path
    servo(lag, slowness, q, full)         the servo of an input: lag in s, slowness in s per unit of the input
    thrust_change(q)                      relative change of what one drive adds to the rates of all states
    measured_outputs(y, s, i, q, e)       the outputs that the sensors show: the sensor's path
    rates(s, i, p, q, e)                  d/dt of the effect's own `states`
    rates_from_outputs(y, s, i, q, e)     the same, where they depend on the outputs
    initial_state(y, i, p, q)             own states at the start of a trial; zero where there is no hook. y has the
                                          states of the model, too, that no output shows

s, i, y, p are the named tuples of the model, s with the effect's own states too, under the standard names of channels;
q are the effect's own parameters, e the environment, d the vehicle's size, thrust and drag (`models.geometry.Vehicle`).
A hook gives a changed copy (`i._replace(delta=i.delta + q.offset)`).

Its parameters are of two kinds. A **magnitude** has a null value; where all magnitudes stand there, the effect vanishes
exactly, so that one model can carry many effects. A **shape** parameter says how well the form of the effect is known
(an area, a lever arm, a frequency): it declares a prior, stands at the mean of that prior, and has no influence while
the magnitudes are at their null.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from copy import copy
from typing import Any, ClassVar

from seatruth.effects.causes import CAUSES, ROOT, children, is_cause
from seatruth.effects.port_needs import lacks_port
from seatruth.effects.targets import aliases_of, targets
from seatruth.effects.undeclared_actuators import USUAL
from seatruth.effects.vehicle import dimensions_of, role_of
from seatruth.errors import PluginError, nearest
from seatruth.models.base import Model
from seatruth.models.black_box import BlackBox
from seatruth.models.first_slope import FirstSlope
from seatruth.models.parameter import Parameter, Prior
from seatruth.trials.channel import Channel
from seatruth.trials.trial import Trial

Hook = Callable[..., Any]

CHANGES = ("true_parameters", "current", "force", "true_inputs", "servo", "thrust_change", "measured_outputs")
"""Names of the hooks that change something."""
HOOKS = (*CHANGES, "rates", "rates_from_outputs", "initial_state")
"""Names of the hooks: the last three serve the effect's own states."""

EQUATIONS = ("surge", "sway", "heave", "roll", "pitch", "yaw", "kinematics")
"""Words of `acts_on` beside "actuator:<input>" and "sensor:<output>"."""

MANY = 4
"""Actuators of one kind from more of which on a diagnosis no longer tries every effect on each of them alone. Chosen
here [S]: eight thrusters have 92 single forms, each a fit more, and a cause more among which to choose."""
UNDECLARED = "the model does not declare its"
"""Begin of the reason why an effect cannot act, where the model lacks a function that its author may add."""
NO_ENVIRONMENT = "the model's rhs takes no environment e"
"""Begin of the reason why an outside force cannot act on a model of equations."""
NO_PARAMETER = "the model has none of the parameters"
"""Begin of the reason why an effect that scales coefficients cannot act: it knows these by their names."""
FULL_SIZE = 100.0
"""m: length of a ship from which typical magnitudes are full ones; chosen here [S]."""


class Effect:
    """Base of every effect. Subclasses set the class attributes and define the hooks that they need.

    `parameters` holds magnitudes at a typical value, and shape parameters (those with a `prior`) at the prior's mean.
    `null` gives for each magnitude the value at which the effect vanishes; an instance adds the means of the shape
    parameters, so that `null` holds a value for every parameter. `needs_states`, `needs_inputs`, `needs_outputs` name
    channels that the model must have, `needs_vehicle` which of "dimensions", "thrust", "drag" it must declare; `kinds`
    the kinds of vehicle that it can act on, all where empty.

    Creating an instance checks the declaration and raises PluginError where it is wrong.
    """

    name: str = ""
    title: str = ""
    cause: str = ""
    """Its place in the tree of causes (`seatruth.effects.causes`), "environment.force_fixed_to_earth.wind"."""
    number: int | None = None
    """In the catalogue of effects, where it is there."""
    equation: str = ""
    """As text, for lists and reports."""
    source: str = ""
    kinds: tuple[str, ...] = ()
    needs_states: tuple[str, ...] = ()
    needs_inputs: tuple[str, ...] = ()
    needs_outputs: tuple[str, ...] = ()
    needs_vehicle: tuple[str, ...] = ()
    needs_parameters: tuple[str, ...] = ()
    """At least one of these must be a parameter of the model, where not empty."""
    actuator: str = ""
    """Kind of actuator on which it acts: "rudder", "plane", "thruster". In its hooks, which run for each of these in
    turn, `input_name` stands for the input of one, and `d.thruster` is that thruster."""
    input_name: str = "delta"
    which: tuple[str, ...] = ()
    """Names of the actuators on which it acts; all of the kind where empty. `variants` makes it for each."""
    common_only: bool = False
    """It acts on all actuators of its kind alike, never on one of them alone."""
    each_of_many: bool = False
    """A diagnosis tries it on each actuator alone even where the model has more than `MANY` of them."""
    any_drive: bool = False
    """It acts on any input that drives the vehicle, where the model names no thruster."""
    pairs: bool = False
    """It acts on two actuators at a time: `d.thruster` and `d.other`."""
    wholly: bool = False
    """It acts wholly, at its parameters' values, or not at all: a small share of it is the form of something else."""
    aliases: ClassVar[Mapping[str, tuple[str, ...]]] = {}
    """The channels for which a name in the hooks may stand; the first that the model has is taken."""
    parameters: tuple[Parameter, ...] = ()
    null: Mapping[str, float] = {}  # an instance has its own
    states: tuple[Channel, ...] = ()
    follows: ClassVar[Mapping[str, str]] = {}
    """Own states that start where a state of the model starts, and move with that start: {"first": "r"}. Others start
    from the first sample and its noise."""
    start: ClassVar[str] = ""
    """The state whose start takes it up wholly where no rate depends on that state; empty for most."""
    longest_step: float = math.inf
    """s: the longest integration step that its own states allow."""
    acts_on: tuple[str, ...] = ()
    """Where it acts: words of `EQUATIONS`, "actuator:<input>", "sensor:<output>"."""
    equivalent: tuple[str, ...] = ()
    """Effects, or parameters of models (patterns: "N_d*"), from which motion data can never distinguish it."""
    confused_with: tuple[str, ...] = ()
    """Effects from which only some trials can distinguish it."""
    distinguished_by: str = ""
    """What distinguishes it from those."""
    comes_with: tuple[str, ...] = ()
    """Effects of the same origin: where it acts, they are to be expected, and are no further cause."""
    typical_by_kind: ClassVar[Mapping[str, Mapping[str, float]]] = {}
    """Typical distance of a magnitude from null by kind of vehicle, where it is not that of `parameters`."""
    froude: ClassVar[Mapping[str, float]] = {}
    """Power of the length with which magnitudes of ships shorter than 100 m scale (1/2 for times and speeds)."""
    scaled_by: ClassVar[Mapping[str, float]] = {}
    """Shape parameters that are the logarithm of a factor on what the effect does, and the power of that factor with
    which the magnitudes go: {"ln_area": -0.5}, since a wind over half the area is as strong at 1.4 times the speed."""
    power: ClassVar[int] = 1
    """Power of the size whose order is unknown in the magnitudes: 2 where they are the square of a wave's height."""
    starts: tuple[Mapping[str, float], ...] = ()
    """Finite values of the magnitudes to start a fit from, where the null is no regular point; shape parameters are at
    their mean. `starting_points` gives them for a model."""
    likely: tuple[Mapping[str, float], ...] = ()
    """Values of the magnitudes that it most likely has if it acts: a fit starts there too, since other optima may lie
    between the null and them."""
    direction: tuple[str, ...] = ()
    """The two magnitudes that are components along x and y of the earth, ("north", "east"), of an effect that has a
    direction: a fit starts in several of them, and a report gives it in degrees."""
    stands_for_untried: bool = False
    """What cannot be tried on the model looks the same: a drift, where no wind can push."""
    stochastic: bool = False
    """It has a random part, which no trial repeats: the noise of a fit must hold that."""
    each_trial: bool = False
    """Its magnitudes have a value for each trial: `of_trials` makes it for those of a study."""
    trials: tuple[str, ...] = ()
    """Names of those trials; empty where it is the same in all."""
    dynamic: bool = True
    """It can be a term of the equations; False for what is noise only."""

    true_parameters: Hook | None = None
    current: Hook | None = None
    force: Hook | None = None
    true_inputs: Hook | None = None
    servo: Hook | None = None
    thrust_change: Hook | None = None
    measured_outputs: Hook | None = None
    rates: Hook | None = None
    rates_from_outputs: Hook | None = None
    initial_state: Hook | None = None

    def __init__(self) -> None:
        self.null = {**self.null, **{q.name: q.value for q in self.parameters if q.prior is not None}}
        means = {name: prior.mean for name, prior in self.shape_priors.items()}
        self.starts = tuple({**means, **start} for start in self.starts)
        self.likely = tuple({**means, **values} for values in self.likely)
        _check(self)

    @property
    def family(self) -> str:
        """The family of causes that it belongs to, "environment": the first part of `cause`."""
        return self.cause.partition(".")[0]

    def of_trials(self, trials: Sequence[str]) -> Effect:
        """The effect for the trials of a study, by their names; the same for all trials unless `each_trial`."""
        return self

    def at_speed(self, speed: float) -> Effect:
        """The effect for trials of such a usual speed ahead (m/s); the same where its computation refers to none."""
        return self

    def on(self, model: Model) -> Effect:
        """The effect as it acts on a model, where its computation depends on the kind or the size of the vehicle."""
        return self

    def variants(self, model: Model) -> tuple[Effect, ...]:
        """The forms in which it can act on a model: on all actuators of its kind alike, and on each alone."""
        acted_on = targets(self, model) if self.actuator and not self.which else ()
        found = () if self.common_only else acted_on
        if self.pairs and found:
            thrusters = [actuator.name for actuator in model.actuators if actuator.kind == self.actuator]
            return tuple(self.only(thrusters[target.thruster], thrusters[target.other]) for target in found)
        every = self._with_inputs([target.input for target in acted_on if target.inferred])
        return (every, *(self.only(target.name) for target in found)) if len(found) > 1 else (every,)

    def _with_inputs(self, inputs: Sequence[str]) -> Effect:
        """The same with the inputs in its title that were taken for its actuators: "lag of the rudder (helm)"."""
        if not inputs:
            return self
        named = copy(self)
        named.title = f"{self.title} ({' and '.join(inputs)})"
        return named

    def candidates(self, model: Model) -> tuple[Effect, ...]:
        """Those of its `variants` that a diagnosis tries by itself; a study may name any other.

        Where a model has more than `MANY` actuators of the kind, these are the form that acts on all alike, and single
        ones only of effects with `each_of_many`: what one thruster alone loses, whatever the cause, shows in its gain,
        and a diagnosis then tries all forms of that one.
        """
        forms = self.variants(model)
        named = [actuator for actuator in model.actuators if actuator.kind == self.actuator]
        many = len(named or (targets(self, model) if self.actuator else ())) > MANY
        return tuple(form for form in forms if not form.which) if many and not self.each_of_many else forms

    def only(self, *actuators: str) -> Effect:
        """The same effect on some actuators alone, by their names: "thruster_gain_port"."""
        alone = copy(self)
        alone.name = "_".join((self.name, *actuators))
        alone.title = f"{self.title}: {' and '.join(actuators)}"
        alone.which = actuators
        alone.confused_with = (*self.confused_with, self.name)
        return alone

    @property
    def magnitudes(self) -> tuple[str, ...]:
        """Names of the parameters that have a null; the effect vanishes where all of them stand there."""
        return tuple(q.name for q in self.parameters if q.prior is None)

    @property
    def shape_priors(self) -> dict[str, Prior]:
        """Priors of the parameters that describe its form, by name; the same on every model."""
        return {q.name: q.prior for q in self.parameters if q.prior is not None}

    @property
    def slopes(self) -> Mapping[str, FirstSlope]:
        """Own states that begin along the motion of an output, by its standard name: added to `initial_state`."""
        return {}

    @property
    def suits_black_box(self) -> bool:
        """Whether it acts on inputs and outputs alone, so that a black box without ports can have it."""
        inside = (self.current, self.force, self.true_parameters, self.thrust_change)
        return self.dynamic and not self.needs_states and all(hook is None for hook in inside)

    def priors(self, model: Model) -> dict[str, Prior]:
        """What is known of its parameters on a model before the data speak, by parameter name.

        A magnitude's prior stands about its null; the standard deviation is the typical distance from null, that of
        the model's kind where `typical_by_kind` has it; on a ship that is smaller than 100 m (most such are models)
        reduced by Froude's rule, as `froude` says. A shape parameter has the prior that it declares.
        """
        kind = self.typical_by_kind.get(model.kind, {})
        size = dimensions_of(model) if self.froude and model.kind == "ship" else None
        ratio = 1.0 if size is None else min(1.0, size.length / FULL_SIZE)
        priors = {}
        for q in self.parameters:
            sd = kind.get(q.name, abs(q.value - self.null[q.name])) * ratio ** self.froude.get(q.name, 0.0)
            priors[q.name] = q.prior or Prior(self.null[q.name], sd)
        return priors

    def typical(self, model: Model) -> dict[str, float]:
        """Its parameters at a typical magnitude on a model: one standard deviation from null; shapes at their mean."""
        values = {}
        for q in self.parameters:
            prior = self.priors(model)[q.name]
            side = 0.0 if q.prior is not None else -1.0 if q.value < prior.mean else 1.0
            values[q.name] = min(q.max, max(q.min, prior.mean + side * prior.sd))
        return values

    def starting_points(self, model: Model, trials: Sequence[Trial] = ()) -> list[dict[str, float]]:
        """Finite values of all parameters to start fits to trials from on a model; empty where the null alone will do.

        Declared `starts` are reduced on a small ship as its typical magnitudes are. An effect with a direction and
        without declared starts starts in eight directions, at its typical magnitude.
        """
        priors, typical = self.priors(model), self.typical(model)
        if self.direction and not self.starts:
            north, east = self.direction
            size = math.hypot(priors[north].sd, priors[east].sd) / math.sqrt(2.0)
            angles = [k * math.pi / 4.0 for k in range(8)]
            return [{**typical, north: size * math.cos(angle), east: size * math.sin(angle)} for angle in angles]
        scale = {
            q.name: min(1.0, priors[q.name].sd / abs(q.value - self.null[q.name]))
            for q in self.parameters
            if q.name in self.froude
        }
        return [{name: value * scale.get(name, 1.0) for name, value in start.items()} for start in self.starts]

    def gross_values(self, trials: Sequence[Trial]) -> list[dict[str, float]]:
        """Values so far from null that records themselves show them: a fit starts there as from `likely` ones."""
        return []

    def null_parameters(self) -> list[Parameter]:
        """Its parameters under their names in an extended model, at null and fixed; shapes keep their priors."""
        return [q.replace(name=self.named(q.name), value=float(self.null[q.name]), vary=False) for q in self.parameters]

    def places(self, model: Model) -> tuple[str, ...]:
        """`acts_on` with the model's own names of inputs and outputs."""
        aliases = aliases_of(self, model)
        places = []
        for word, _, channel in (place.partition(":") for place in self.acts_on):
            if self.actuator and channel == self.input_name:
                places += [f"{word}:{target.input}" for target in targets(self, model)]
            else:
                places.append(f"{word}:{aliases.in_model(channel)}" if channel else word)
        return tuple(places)

    def missing(self, model: Model) -> str:
        """Why it cannot act on a model; empty where it can."""
        if not self.dynamic:
            return "it is noise, no term of the equations"
        if self.kinds and model.kind and model.kind not in self.kinds:
            return f"it acts on {' and '.join(self.kinds)}, the model is of kind {model.kind!r}"
        black_box = model if isinstance(model, BlackBox) else None
        if black_box is not None and not self.suits_black_box:
            reason = lacks_port(self, black_box)
            if reason:
                return reason
        elif self.force is not None and not model.takes_environment:
            return NO_ENVIRONMENT
        elif self.current is not None and not model.takes_current:
            return f"{NO_ENVIRONMENT}, and it has no state 'u'"
        if self.actuator and not targets(self, model):
            return (
                f"the model has no {self.actuator} {USUAL[self.actuator][0]!r}"
                if USUAL[self.actuator]
                else self._no_thruster()
            )
        aliases = aliases_of(self, model, targets(self, model)[0] if self.actuator else None)
        for kind, needed in (("state", "needs_states"), ("input", "needs_inputs"), ("output", "needs_outputs")):
            # A black box shows no states but its outputs.
            channels = getattr(model, f"{kind}s") if kind != "state" or not black_box else black_box.innermost.outputs
            have = [aliases.in_effect(channel.name) for channel in channels]
            lacking = [name for name in getattr(self, needed) if name not in have]
            if lacking:
                return f"the model has no {kind} {self.aliases.get(lacking[0], lacking)[0]!r}"
        for role in self.needs_vehicle:
            if role == "thrust" and model.kind == "glider":
                return "a glider has no propeller"
            if role_of(model, role) is None:
                if role == "thrust" and model.thrusts is not None:
                    return "it is one propeller's, and the model's thrusters have effects of their own"
                return f"{UNDECLARED} {role}"
        if self.needs_parameters and not {q.name for q in model.parameters} & {*self.needs_parameters}:
            return f"{NO_PARAMETER} {', '.join(self.needs_parameters)}"
        return ""

    def _no_thruster(self) -> str:
        return "the model names no two thrusters" if self.pairs else f"the model names no {self.actuator}"

    def named(self, parameter: str) -> str:
        """Name of one of its parameters or states in an extended model: "current_north"."""
        return f"{self.name}_{parameter}"


def _check(effect: Effect) -> None:
    where = f"effect {effect.name or type(effect).__name__!r}"
    if not effect.name.isidentifier():
        raise PluginError(f"{effect.name!r} is not a usable name", where=where, do="Use an identifier.")
    names = [parameter.name for parameter in effect.parameters]
    if sorted(names) != sorted(effect.null):
        what = "each of its parameters must have a value in null, or a prior where it describes the form"
        raise PluginError(what, where=where)
    for q in effect.parameters:
        if q.prior is not None and q.name in type(effect).null:
            raise PluginError(f"{q.name!r} has both a null and a prior", where=where, do="Give it one of them.")
        if q.prior is not None and q.value != q.prior.mean:
            raise PluginError(f"{q.name!r} must stand at the mean of its prior", where=where)
    if bool(effect.states) != (effect.rates is not None or effect.rates_from_outputs is not None):
        raise PluginError("its states and rates must come together", where=where)
    if effect.rates is not None and effect.rates_from_outputs is not None:
        raise PluginError("its states have either rates or rates_from_outputs", where=where)
    if effect.dynamic and all(getattr(effect, hook) is None for hook in CHANGES):
        raise PluginError("it changes nothing", where=where, do=f"Define one of the hooks {', '.join(CHANGES)}.")
    for attribute in ("starts", "likely"):
        if any(sorted(values) != sorted(names) for values in getattr(effect, attribute)):
            raise PluginError(f"each of `{attribute}` must give a value for each of its magnitudes", where=where)
    if effect.direction and (len(effect.direction) != 2 or not {*effect.direction} <= {*effect.magnitudes}):
        raise PluginError("its direction must name two of its magnitudes", where=where)
    if not is_cause(effect.cause):
        what = f"{effect.cause!r} is no place in the tree of causes" if effect.cause else "it states no cause"
        do = nearest(effect.cause, [path for path in CAUSES if path]) if effect.cause else ""
        families = ", ".join(children(ROOT))
        raise PluginError(what, where=where, do=do or f"State one of {families}, or a node below one of them.")
