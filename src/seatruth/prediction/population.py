"""A manoeuvre sailed by many ships at once, each with parameters of its own and its own helmsman.

`manoeuvres.run_manoeuvre` sails one ship in plain Python. Here the parameters that differ become inputs of the model,
so that the compiled equations give the rates of all ships in one call. Steps, orders and servos are the same.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from seatruth.arrays import Array, Indices
from seatruth.errors import BadInput, nearest
from seatruth.manoeuvres import Manoeuvre
from seatruth.manoeuvres.steering import Allocation, limited_inputs, steering_of
from seatruth.models.base import Equations, Model, record
from seatruth.models.black_box import BlackBox
from seatruth.models.servo import stages
from seatruth.models.wrapper import ModelWrapper
from seatruth.simulate import evaluate_rhs
from seatruth.trials.channel import Channel
from seatruth.trials.trial import Trial

_STAGES: Callable[..., tuple[Array, Array, Array]] = np.vectorize(stages, otypes=[float, float, float])


class ByRow(ModelWrapper):
    """A model some of whose parameters are inputs, so that each row of a call has its own."""

    def __init__(self, base: Model, names: Sequence[str]) -> None:
        self._names = tuple(names)
        super().__init__(base, inputs=[Channel(f"own_{name}", "1") for name in names])

    def make_rhs(self) -> Equations:
        rhs, split, names = self.base.rhs, self.split_inputs(), self._names

        def by_row(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
            i, own = split(i)
            return rhs(s, i, p._replace(**dict(zip(names, own))), e)

        return by_row


@dataclass(frozen=True)
class Sailing:
    """How a manoeuvre is sailed: step and sampling interval dt (s), rudder rate (rad/s), time limit (s)."""

    dt: float
    rudder_rate: float
    limit: float

    def __post_init__(self) -> None:
        for name in ("dt", "rudder_rate", "limit"):
            value = getattr(self, name)
            if not (value > 0 and not math.isnan(value)):
                raise BadInput(f"{name} must be positive, not {value}", where="predict", do="Give a positive number.")


class Fleet:
    """P ships of one model: `values` (P, n_parameters) in the order of the model's parameters.

    Raises:
        BadInput: the model is a black box, which cannot be steered while it runs.
    """

    def __init__(self, model: Model, values: Array) -> None:
        if isinstance(model, BlackBox):
            raise BadInput(
                f"model {model.name!r} is a black box, which runs as a whole: nobody can steer it by its heading",
                where="predict",
                do="Predict recorded trials alone (no manoeuvres), or write the model's equations.",
            )
        self.model, self.values = model, np.atleast_2d(np.asarray(values, dtype=np.float64))
        own = np.flatnonzero(np.ptp(self.values, axis=0) > 0)
        self._own = own
        names = [model.parameters[k].name for k in own]
        self._by_row: Model = ByRow(model, names) if names else model
        self._fixed = {p.name: float(v) for p, v in zip(model.parameters, self.values[0])}
        kind = record("Parameters", model.parameters)
        self._records = [kind(*row) for row in self.values.tolist()]

    def __len__(self) -> int:
        return len(self.values)

    def rates(self, states: Array, inputs: Array, ships: Indices, t: float) -> Array:
        """Rates (A, S) of some ships (A,): states (A, S), inputs as they act (A, I)."""
        rows = np.concatenate([inputs, self.values[np.ix_(ships, self._own)]], axis=1)
        time = np.full(len(states), t)
        return evaluate_rhs(self._by_row, np.zeros(0), (), self._fixed, states, rows, time, threads=1)

    def sail(
        self,
        plan: Manoeuvre,
        how: Sailing,
        *,
        first: Mapping[str, float],
        inputs: Mapping[str, Array],
    ) -> list[Trial | str]:
        """The record of each ship, or in words why there is none.

        Args:
            plan: the manoeuvre; each ship has a helmsman of its own, who sees its states by name.
            how: step, rudder rate, time limit.
            first: first values of outputs, {"u": 1.2}; the others are zero.
            inputs: (P,) of each input that the manoeuvre does not order; the others are zero.
        """
        model = self.model
        channels = [channel.name for channel in model.inputs]
        names = [channel.name for channel in model.states]
        for name in inputs:
            if name not in channels:
                raise BadInput(f"model {model.name!r} has no input {name!r}", do=nearest(name, channels))
        size = len(self)
        now = np.zeros((size, len(channels)))
        for name, values in inputs.items():
            now[:, channels.index(name)] = values
        state = self._first(first, now)
        helms, steering = [plan.helm() for _ in range(size)], steering_of(model)
        allocations = [Allocation(model, steering, dict(zip(channels, row)), plan.label) for row in now.tolist()]
        alive = np.arange(size)
        steps = np.zeros(size, dtype=np.intp)
        lost: dict[int, str] = {}
        states, taken = [state.copy()], [now.copy()]
        servos = {servo.input for servo in model.servos}
        rudders = {*limited_inputs(steering)} - servos
        limited = [k for k, name in enumerate(channels) if name in rudders]
        delays = [(channels.index(name), round(seconds / how.dt)) for name, seconds in model.delays.items()]
        fastest = how.rudder_rate * how.dt
        for step in range(math.ceil(how.limit / how.dt)):
            t = step * how.dt
            then = now.copy()
            going = []
            for ship in alive:
                seen = dict(zip(names, state[ship].tolist()))
                orders = self._orders(helms[ship], t, seen, plan)
                if orders is None:
                    continue
                going.append(ship)
                for name, value in allocations[ship](orders).items():
                    then[ship, channels.index(name)] = value
            alive = np.array(going, dtype=np.intp)
            if not alive.size:
                break
            then[:, limited] = now[:, limited] + np.clip(then[:, limited] - now[:, limited], -fastest, fastest)
            acting, after = now.copy(), then.copy()
            for column, late in delays:
                if late > 0:
                    acting[:, column] = taken[max(0, step - late)][:, column]
                    after[:, column] = taken[max(0, step + 1 - late)][:, column]
            with np.errstate(all="ignore"):
                moved = self._step(t, state[alive], acting[alive], after[alive], alive, how.dt)
            good = np.isfinite(moved).all(axis=1)
            for ship in alive[~good]:
                lost[int(ship)] = f"the motion diverges at t = {t:g} s"
            alive, moved = alive[good], moved[good]
            state = state.copy()
            state[alive] = moved
            steps[alive] = step + 1
            now = then
            states.append(state)
            taken.append(now)
        return [lost.get(k) or self._trial(k, int(steps[k]) + 1, states, taken, plan, how.dt) for k in range(size)]

    def _orders(self, helm: Any, t: float, seen: Mapping[str, float], plan: Manoeuvre) -> Mapping[str, float] | None:
        try:
            orders: Mapping[str, float] | None = helm(t, seen)
        except KeyError as missing:
            raise BadInput(
                f"{plan.label} watches {missing}, which is no state of model {self.model.name!r}",
                where="predict",
                do="Leave this manoeuvre out.",
            ) from None
        return orders

    def _first(self, first: Mapping[str, float], inputs: Array) -> Array:
        """First states (P, S); hidden ones as the model begins them."""
        outputs = {channel.name: 0.0 for channel in self.model.outputs} | dict(first)
        # A speed that no output is: of a model whose log holds the ground velocity alone.
        hidden = {name: value for name, value in first.items() if name not in {c.name for c in self.model.outputs}}
        names, states = ([c.name for c in channels] for channels in (self.model.inputs, self.model.states))
        rows = []
        for row, p in zip(inputs.tolist(), self._records):
            state = self.model.first_state(outputs, dict(zip(names, row)), p._asdict())
            rows.append([hidden.get(name, value) for name, value in zip(states, state)])
        return np.array(rows, dtype=np.float64)

    def _step(self, t: float, state: Array, start: Array, end: Array, ships: Indices, h: float) -> Array:
        """States after one classical Runge-Kutta step, inputs linear; servos exact, as the engine solves them."""
        names = [channel.name for channel in self.model.states]
        at = {"start": start.copy(), "middle": 0.5 * (start + end), "end": end.copy()}
        place_of, servo_states = {}, {}
        for servo in self.model.servos:
            column = [channel.name for channel in self.model.inputs].index(servo.input)
            place = names.index(servo.state)
            lag, slowness = np.array([servo.settings(self._records[k]) for k in ships], dtype=np.float64).T
            found = _STAGES(state[:, place], start[:, column], end[:, column], h, lag, slowness)
            for key, values in zip(at, found):
                at[key][:, column] = values
            place_of[place] = found[2]
            servo_states[place] = found

        def rates(x: Array, key: str, time: float) -> Array:
            x = x.copy()
            for place, found in servo_states.items():
                x[:, place] = found[list(at).index(key)]
            return self.rates(x, at[key], ships, time)

        k1 = rates(state, "start", t)
        k2 = rates(state + 0.5 * h * k1, "middle", t + 0.5 * h)
        k3 = rates(state + 0.5 * h * k2, "middle", t + 0.5 * h)
        k4 = rates(state + h * k3, "end", t + h)
        after = state + h / 6.0 * (k1 + 2 * k2 + 2 * k3 + k4)
        for place, values in place_of.items():
            after[:, place] = values
        return after

    def _trial(
        self, ship: int, count: int, states: list[Array], taken: list[Array], plan: Manoeuvre, dt: float
    ) -> Trial:
        rows, acted = (np.array([part[ship] for part in parts[:count]]) for parts in (states, taken))
        return Trial(
            name=plan.label,
            t=dt * np.arange(count, dtype=np.float64),
            inputs={channel.name: acted[:, k] for k, channel in enumerate(self.model.inputs)},
            outputs={channel.name: rows[:, k] for k, channel in enumerate(self.model.states)},
            conditions={"manoeuvre": plan.label, "model": self.model.name},
            source=f"simulated by model {self.model.name}",
            synthetic=True,
        )
