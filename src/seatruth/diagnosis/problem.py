"""The trials, the model, every effect and every missing force as one problem, simulated and differentiated together.

Three kinds of unknowns (`Point`): shared ones (the model's free coefficients, the parameters of effects, the
coefficients of discrepancy terms), the initial states of each trial, and the values of each trial's own missing forces
at its knots. `Linearization` holds the errors at a point and their derivatives.

Shapes: T trials, C outputs, S shared unknowns, I free initial states of a trial, E equations of motion, N errors.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from seatruth.arrays import Array, Flags, Indices
from seatruth.costs.options import TrajectoryOptions
from seatruth.costs.parameter_space import ParameterSpace
from seatruth.diagnosis.discrepancy.black_box import DiscrepancyBlackBox
from seatruth.diagnosis.discrepancy.model import (
    DiscrepancyModel,
    can_carry,
    humps_of,
    scales_of,
    with_forces,
    with_moved_forces,
)
from seatruth.diagnosis.few_runs import FewRuns
from seatruth.diagnosis.prior_widths import prior_deviations
from seatruth.diagnosis.sections import in_sections, knots_of_section
from seatruth.diagnosis.servo_starts import begun_under_way, near_orders
from seatruth.diagnosis.settings import Settings
from seatruth.diagnosis.usual_sizes import from_zero, grouped, inertias_of, spread_of, usual_rate, with_prior
from seatruth.effects import Effect, with_effects
from seatruth.effects.each_trial import EachTrial
from seatruth.models.base import Model
from seatruth.models.black_box import BlackBox
from seatruth.models.parameter import Parameter, Prior
from seatruth.simulate import BlackBoxSimulator, Meter, Simulator, simulator
from seatruth.study import Study
from seatruth.trials.prepare.decimate import decimate
from seatruth.trials.trial import Trial, Trials

_LARGEST = 1e9
"""Derivative over error from which a run is about to diverge: its square would swamp double precision."""
_OVERFLOWS = 1e100
"""Size of an error or a state, in SI units, from which a run counts as diverged: below it, squares over the variance of
any noise can be summed in double precision, whose largest number is 1.8e308."""


@dataclass(frozen=True)
class Point:
    """Values of all unknowns: `shared` (S,), `initial` (T, I), `forces` (T, E, knots)."""

    shared: Array
    initial: Array
    forces: Array


@dataclass(frozen=True)
class Series:
    """One channel of one trial: its places among all errors (n,), and its times (n,) in s."""

    trial: int
    channel: int
    rows: Indices
    t: Array


@dataclass(frozen=True)
class Linearization:
    """Errors (N,), measured minus simulated, at a point, and their derivatives.

    `shared` (N, S): by the shared unknowns, zero for effects that are not in `effects`. `local` (N, I + E knots): by
    the unknowns of each error's own trial, initial states first, then knots equation by equation. Without `discrepancy`
    the derivatives by terms are zero, and `local` (N, I) ends with the initial states.
    """

    point: Point
    effects: tuple[str, ...]
    discrepancy: bool
    errors: Array
    shared: Array
    local: Array


class Problem:
    """See the module. Raises BadInput where an effect cannot act on the model."""

    def __init__(
        self,
        study: Study,
        effects: Sequence[Effect],
        settings: Settings,
        *,
        threads: int | None = None,
        evaluations: int | None = None,
    ) -> None:
        """`evaluations`: simulations of all trials that a black box may cost; None is no limit."""
        self.study, self.settings = study, settings
        self.effects = {effect.name: effect for effect in effects}
        self.outputs = [channel.name for channel in study.model.outputs]
        whole = [from_zero(trial) for trial in decimate(list(study.trials), self.outputs)]
        trials = in_sections(whole, settings)
        model: Model = with_effects(study.model, effects)
        self.discrepancy: DiscrepancyModel | DiscrepancyBlackBox | None = None
        if can_carry(study.model):
            duration = max(trial.duration for trial in trials)
            scales = scales_of(model, trials)
            shape, humps = (settings.knots, duration, scales), humps_of(model, trials, scales)
            if isinstance(model, BlackBox):
                inertia = inertias_of(model, trials, study.space.nominal(), scales)
                model = self.discrepancy = DiscrepancyBlackBox(model, *shape, inertia, humps=humps)
            else:
                model = self.discrepancy = DiscrepancyModel(model, *shape, humps=humps)
            trials = [with_forces(trial, self.discrepancy) for trial in trials]
        self.model, self.trials = model, Trials(trials)
        self.equations = list(self.discrepancy.equations) if self.discrepancy else []
        self.space = ParameterSpace(self._parameters())
        self._lay_out()
        self.mean = np.array([q.prior.mean if q.prior else q.value for q in self.unknowns])
        stated = np.array([q.prior.sd if q.prior else 1.0 for q in self.unknowns])
        self.believed_sd, self.sd = prior_deviations(stated, self.effects, self.columns, settings)
        own = self.effects.items()
        self.prior_correlation = {name: effect.correlation for name, effect in own if isinstance(effect, EachTrial)}
        low_high = [(q.min, q.max) for q in self.unknowns]
        self.low, self.high = np.array([a for a, _ in low_high]), np.array([b for _, b in low_high])
        options = study.cost if isinstance(study.cost, TrajectoryOptions) else TrajectoryOptions()
        self.hold, self.max_step, self.threads = options.hold, options.max_step, threads
        self.meter = Meter(None if evaluations is None else evaluations * len(self.trials))
        self._simulator = simulator(
            self.model, self.trials, free=self.space.varying, values=self.space.nominal(),
            hold=self.hold, max_step=self.max_step, threads=threads, meter=self.meter,
        )  # fmt: skip
        self.few_runs = FewRuns(self, self._simulator) if isinstance(self._simulator, BlackBoxSimulator) else None
        blocks = 4 * settings.knots
        usual = [usual_rate(study.model, trials, s, blocks, self._scale_of(s)) for s in self.equations]
        self.usual = np.array(usual, dtype=np.float64)
        self._kept = threading.local()
        self.initial_sd: Array = np.zeros(0)
        self._set_up_initial_states(whole)
        self._set_up_errors()
        self.start = Point(
            np.array([q.value for q in self.unknowns]),
            self.initial_mean.copy(),
            np.zeros((len(self.trials), len(self.equations), settings.knots)),
        )
        if settings.near_orders and self.few_runs is None and self.model.servos:
            motions = self.states(self.start)
            self.initial_sd = near_orders(self.model, self.trials, motions, self.initial_names, self.initial_sd)

    def in_sections(self, sections: int) -> Problem:
        """The same with its longest trial cut into so many sections. Not for a black box, whose runs are counted."""
        knots = knots_of_section(self.settings.knots, sections)
        settings = replace(self.settings, sections=sections, knots=knots)
        return self.with_settings(settings)

    def with_settings(self, settings: Settings) -> Problem:
        """The same with other settings. Not for a black box, whose runs are counted."""
        return Problem(self.study, list(self.effects.values()), settings, threads=self.threads)

    def with_effects(self, further: Iterable[Effect]) -> Problem:
        """The same with more effects in its library. Not for a black box, whose runs are counted."""
        return Problem(self.study, [*self.effects.values(), *further], self.settings, threads=self.threads)

    def active(self, effects: Sequence[str], *, discrepancy: bool) -> Indices:
        """Columns of the shared unknowns that a hypothesis frees: coefficients, terms, these effects' parameters."""
        own = [self.columns[name] for name in effects]
        terms = self.terms if discrepancy else self.terms[:0]
        return np.concatenate([self.coefficients, terms, *own]).astype(np.intp)

    def errors(self, point: Point) -> Array:
        """Measured minus simulated (N,) at a point; inf where a run diverges."""
        with np.errstate(all="ignore"):
            errors = (self._simulator.measured - self._outputs(point))[self.valid]
        errors[~(np.abs(errors) < _OVERFLOWS)] = math.inf
        return np.asarray(errors)

    def simulate(self, point: Point) -> list[Array]:
        """Outputs (n, C) of each trial at a point."""
        y = self._outputs(point)
        return [y[rows] for rows in self._simulator.rows]

    def states(self, point: Point) -> list[Array]:
        """States (n, n_states) of each trial at a point; NaN where a run diverges."""
        found = self.bound(point, self.space.varying).states(self.theta(point), self.start_states(point))
        found = np.where(np.abs(found) < _OVERFLOWS, found, math.nan)
        return [found[rows] for rows in self._simulator.rows]

    def linearize(self, point: Point, effects: Sequence[str], *, discrepancy: bool = True) -> Linearization:
        """Errors at a point and their derivatives by everything that a hypothesis with these effects frees.

        Derivatives by terms and knots, which `discrepancy` asks for, are three quarters of the work. A fit asks for its
        last point twice: each thread keeps its last linearization.
        """
        last: Linearization | None = getattr(self._kept, "last", None)
        if last is None or last.point is not point or (last.effects, last.discrepancy) != (tuple(effects), discrepancy):
            last = self._kept.last = None  # not two at a time
            last = self._kept.last = self._linearized(point, tuple(effects), discrepancy)
        return last

    @property
    def lent(self) -> bool:
        """Whether the last linearization rests on derivatives at another point, as those of a black box may."""
        return self.few_runs is not None and self.few_runs.lent

    def renew(self) -> None:
        """Has the next linearization of a black box made of derivatives at its own point."""
        if self.few_runs is not None:
            self.few_runs.renew()
            self._kept.last = None

    def _linearized(self, point: Point, effects: tuple[str, ...], discrepancy: bool) -> Linearization:
        kept = self.active(effects, discrepancy=discrepancy)
        free = [self.unknowns[k].name for k in kept]
        knots = list(self._knot_names) if discrepancy else []
        tied = [name for name in self.space.varying if name not in self.space.free_names]
        names = (*free, *knots, *tied)
        if self.few_runs is not None:
            y, dy = self.few_runs.linearize(point, names)
        else:
            bound = self.bound(point, names)
            theta = dict(zip(self.space.varying, self.theta(point)))
            free_values, x0 = np.array([theta[n] for n in names]), self.start_states(point)
            y, dy, *_ = bound.jacobian(free_values, x0, self.initial_names, last_states=False)
            dy = dy[self.valid]
        with np.errstate(all="ignore"):
            errors = (self._simulator.measured - y)[self.valid]
        errors[~(np.abs(errors) < _OVERFLOWS)] = math.inf
        # The largest arrays: in place, and by columns, so that effects that take no part take no memory.
        slopes = np.negative(dy, out=dy)
        limit = _LARGEST * (1.0 + float(np.abs(errors).max(initial=0.0)))
        if not -limit < slopes.min(initial=0.0) <= slopes.max(initial=0.0) < limit:
            slopes[~(np.abs(slopes) < limit)] = 0.0
        shared = np.zeros((len(errors), len(self.unknowns)), order="F")
        shared[:, kept] = slopes[:, : len(free)]
        if tied:
            chain = self.space.varying_jacobian(self._free_values(point))
            rows = [self.space.varying.index(name) for name in tied]
            at = len(free) + len(knots)
            shared[:, kept] += (slopes[:, at : at + len(tied)] @ chain[rows])[:, self._free_kept[kept]]
        by_initial, by_knots = slopes[:, len(names) :], slopes[:, len(free) : len(free) + len(knots)]
        local = np.concatenate([by_initial, by_knots], axis=1)
        return Linearization(point, effects, discrepancy, errors, shared, local)

    def moved(self, point: Point, shared: Array, local: Array, part: float = 1.0) -> Point:
        """The point after a part of a step: `shared` (S,), `local` (T, I + E knots); parameters stay in bounds.

        Where `local` (T, I) ends with the initial states, forces stay.
        """
        count = len(self.initial_names)
        forces = local[:, count:].reshape(point.forces.shape) if local.shape[1] > count else 0.0
        return Point(
            np.clip(point.shared + part * shared, self.low, self.high),
            point.initial + part * local[:, :count],
            point.forces + part * forces,
        )

    def nearly_whole(self, name: str, values: Array, part: float) -> bool:
        """Whether an effect's values (n,) are this part of the way to its whole; True of what may act in part."""
        effect = self.effects[name]
        if not effect.wholly:
            return True
        ways = [
            (value - effect.null[q.name]) / (q.value - effect.null[q.name])
            for q, value in zip(effect.parameters, values)
        ]
        return bool(min(ways) > part)

    def local_offset(self, point: Point) -> Array:
        """Prior means of each trial's own unknowns minus their values (T, I + E knots)."""
        return np.concatenate([self.initial_mean - point.initial, -point.forces.reshape(len(self.trials), -1)], axis=1)

    def on_trial(self, trial: Trial, free: Sequence[str], values: Mapping[str, float]) -> Simulator:
        """The model on another trial, with no forces missing; nothing is compiled anew."""
        if self.discrepancy is not None:
            trial = with_forces(trial, self.discrepancy)
        return self._simulator.rebind(free=free, values={**self.space.nominal(), **values}, trials=[trial])

    def named(self, point: Point) -> dict[str, float]:
        """The shared unknowns of a point by their names in the model."""
        return dict(zip((parameter.name for parameter in self.unknowns), point.shared.tolist()))

    @property
    def measured(self) -> Array:
        """Recorded outputs (samples, C)."""
        return self._simulator.measured

    def _outputs(self, point: Point) -> Array:
        if self.few_runs is not None:
            return self.few_runs.outputs(point)
        bound = self.bound(point, self.space.varying)
        return np.asarray(bound.outputs(self.theta(point)[None], self.start_states(point)).y[0])

    # Set-up

    def _scale_of(self, state: str) -> float:
        return self.discrepancy.scales[state] if self.discrepancy else 1.0

    def _parameters(self) -> list[Parameter]:
        own = set(self.study.model.nominal())
        declared = {parameter.name: parameter for parameter in self.study.parameters}
        priors: dict[str, Prior] = {}
        for effect in self.effects.values():
            priors |= {effect.named(name): prior for name, prior in effect.priors(self.study.model).items()}
        found = []
        for parameter in self.model.parameters:
            name = parameter.name
            if name in own:
                found.append(with_prior(declared.get(name, parameter), self.settings.coefficient_sd))
            else:
                found.append(parameter.replace(vary=True, prior=priors.get(name), scale="linear", start=None))
        return found

    def _lay_out(self) -> None:
        """Which shared unknowns there are, and which columns are whose."""
        knots = [name for names in (self.discrepancy.knot_names.values() if self.discrepancy else ()) for name in names]
        self._knot_names = tuple(knots)
        self.unknowns = tuple(parameter for parameter in self.space.free if parameter.name not in set(knots))
        at = {parameter.name: k for k, parameter in enumerate(self.unknowns)}
        free = list(self.space.free_names)
        self._free_kept = np.array([free.index(parameter.name) for parameter in self.unknowns], dtype=np.intp)
        self.columns: Mapping[str, Indices] = {
            name: np.array([at[effect.named(q.name)] for q in effect.parameters], dtype=np.intp)
            for name, effect in self.effects.items()
        }
        terms = self.discrepancy.terms if self.discrepancy else ()
        self.terms = np.array([at[term.name] for term in terms], dtype=np.intp)
        self.term_equation = np.array([self.equations.index(term.state) for term in terms], dtype=np.intp)
        self.term_groups = grouped([term.text for term in terms], self.term_equation)
        taken = {int(k) for columns in self.columns.values() for k in columns} | {int(k) for k in self.terms}
        self.coefficients = np.array([k for k in range(len(self.unknowns)) if k not in taken], dtype=np.intp)

    def _set_up_initial_states(self, whole: Sequence[Trial]) -> None:
        """Free initial states: all that are not hidden. What no output shows of them stays at its prior mean."""
        names = [channel.name for channel in self.model.states]
        follows = set(self.model.follows)
        self.initial_names = tuple(n for n in names if n not in self.model.hidden and n not in follows)
        self._initial_columns = [names.index(name) for name in self.initial_names]
        first: Array = self._simulator.initial_states
        base = begun_under_way(self.model, whole, self.trials, self.space.nominal(), first)
        self.initial_mean = base[:, self._initial_columns].copy()
        spread = [spread_of(self.model, self.trials, name) for name in self.initial_names]
        # An actuator stands somewhere among its orders; what is measured may begin anywhere.
        servos = {servo.state for servo in self.model.servos}
        width = [1.0 if name in servos else self.settings.initial_width for name in self.initial_names]
        self.initial_sd = np.array(width) * np.array(spread)
        self.base_states = base

    def _set_up_errors(self) -> None:
        self.valid: Flags = np.isfinite(self._simulator.measured)
        number = np.cumsum(self.valid.ravel()).reshape(self.valid.shape) - 1
        self.count = int(self.valid.sum())
        self.trial_of = np.zeros(self.count, dtype=np.intp)
        self.channel_of = np.zeros(self.count, dtype=np.intp)
        self.time_of = np.zeros(self.count)
        self.sample_of = np.zeros(self.count, dtype=np.intp)
        self.series: list[Series] = []
        for trial, rows in enumerate(self._simulator.rows):
            t = np.asarray(self.trials[trial].t)
            for channel in range(len(self.outputs)):
                valid = self.valid[rows, channel]
                places = number[rows, channel][valid]
                if places.size:
                    self.series.append(Series(trial, channel, places, t[valid]))
                    self.trial_of[places], self.channel_of[places] = trial, channel
                    self.time_of[places], self.sample_of[places] = t[valid], np.flatnonzero(valid)

    # Simulation

    def bound(self, point: Point, free: Sequence[str]) -> Simulator:
        """The simulator whose candidates set these parameters, all else as at a point."""
        values, trials = {**self.space.nominal(), **dict(zip(self.space.varying, self.theta(point)))}, None
        if self.discrepancy is not None and point.forces.any():
            trials = [with_moved_forces(t, self.discrepancy, f) for t, f in zip(self.trials, point.forces)]
        return self._simulator.rebind(free=tuple(free), values=values, trials=trials)

    def _free_values(self, point: Point) -> Array:
        """All free parameters of the space (K,): the unknowns, and the knots at zero."""
        found = np.zeros(len(self.space.free))
        found[self._free_kept] = point.shared
        return found

    def theta(self, point: Point) -> Array:
        """The parameters of `space.varying` at a point."""
        return np.asarray(self.space.varying_values(self._free_values(point)[None])[0])

    def start_states(self, point: Point) -> Array:
        """Initial states (T, S) at a point."""
        x0 = self.base_states.copy()
        x0[:, self._initial_columns] = point.initial
        names = [channel.name for channel in self.model.states]
        for follower, (leader, sign) in self.model.follows.items():
            column = names.index(leader)
            x0[:, names.index(follower)] += sign * (x0[:, column] - self.base_states[:, column])
        return x0
