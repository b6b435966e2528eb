"""The two workloads that every engine runs: same equations, inputs, samples, weights and candidates.

A: AUV diving plane, 6 states, 12 varying parameters. B: KVLCC2 L-7 ship under MMG with a rate-limited rudder order,
7 states, 20 varying parameters. Both 1200 RK4 steps of 0.1 s (one a sample) and a squared-error cost. The record is
synthetic: the model at its nominal values plus noise.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from engines import equations

Array = NDArray[np.float64]
STEPS, STEP, SPREAD = 1200, 0.1, 0.1


@dataclass(frozen=True, eq=False)
class Workload:
    """One simulation with its cost.

    `inputs` (N, I) at the samples; `measured` (N, D); `observed` are the states that are outputs (D,), `weights` one
    over the noise (D,). `step_inputs` (N - 1, 3, I): at the start, middle and end of each step.
    """

    name: str
    title: str
    rhs: Callable[..., tuple[Any, ...]]
    constants: Callable[[Any], SimpleNamespace]
    values: Mapping[str, float]
    free: tuple[str, ...]
    states: tuple[str, ...]
    input_names: tuple[str, ...]
    outputs: tuple[str, ...]
    noise: Array
    x0: Array
    inputs: Array
    measured: Array
    hold: Literal["foh", "zoh"]
    h: float = STEP

    @property
    def t(self) -> Array:
        """Sample times, s."""
        return np.arange(len(self.inputs), dtype=np.float64) * self.h

    @property
    def observed(self) -> list[int]:
        """Which states are outputs."""
        return [self.states.index(name) for name in self.outputs]

    @property
    def weights(self) -> Array:
        """One over the noise's standard deviation; shape (D,)."""
        return 1.0 / self.noise

    @property
    def step_inputs(self) -> Array:
        """Inputs at the start, middle and end of each step; shape (N - 1, 3, I)."""
        before, after = self.inputs[:-1], self.inputs[1:]
        if self.hold == "zoh":
            return np.stack([before, before, before], axis=1)
        return np.stack([before, 0.5 * (before + after), after], axis=1)

    def parameters(self, theta: Sequence[Any] | Any) -> SimpleNamespace:
        """All parameters by name, the free ones from `theta` (K numbers, arrays or symbols)."""
        return SimpleNamespace(**{**self.values, **{name: theta[n] for n, name in enumerate(self.free)}})

    @property
    def nominal(self) -> Array:
        """The free parameters' nominal values; shape (K,)."""
        return np.array([self.values[name] for name in self.free])

    def population(self, size: int, seed: int) -> Array:
        """Candidates within 10 % of nominal; shape (P, K). The first rows of a larger one are the smaller one."""
        spread = np.random.default_rng(seed).uniform(-SPREAD, SPREAD, (size, len(self.free)))
        return np.asarray(self.nominal * (1.0 + spread))


def workload(name: str, seed: int, *, steps: int = STEPS, programme: int = 0) -> Workload:
    """Workload "A" or "B". `programme` varies the input, for several trials of one vehicle."""
    build = {"A": _diving, "B": _ship}[name]
    return build(np.random.default_rng([seed, programme]), steps, programme)


def _diving(rng: np.random.Generator, steps: int, programme: int) -> Workload:
    t = np.arange(steps + 1) * STEP
    plane = np.radians(5.0) * np.sin(2 * np.pi * t / (31.0 + 3 * programme)) + np.radians(3.0) * np.sin(
        2 * np.pi * t / (7.3 + programme)
    )
    return _recorded(
        rng,
        name="A",
        title="AUV diving plane, 6 states, 12 parameters",
        rhs=equations.diving_plane,
        constants=equations.diving_plane_constants,
        values=_DIVING,
        free=("X_uu", "Z_0", "Z_w", "Z_waw", "Z_q", "Z_ds", "M_w", "M_aw", "M_waw", "M_q", "M_ds", "z_B"),
        states=("u", "w", "q", "theta", "x", "z"),
        input_names=("delta_s",),
        outputs=("u", "w", "q", "theta", "z"),
        noise=np.array([0.01, 0.005, 0.002, 0.005, 0.05]),
        x0=np.array([1.47, 0.0, 0.0, 0.0, 0.0, 100.0]),
        inputs=plane[:, None],
        hold="foh",
    )


def _ship(rng: np.random.Generator, steps: int, programme: int) -> Workload:
    t = np.arange(steps + 1) * STEP
    order = np.radians(20.0) * np.where(np.sin(2 * np.pi * (t + 0.05) / (31.0 + 3 * programme)) >= 0.0, 1.0, -1.0)
    return _recorded(
        rng,
        name="B",
        title="KVLCC2 MMG with rate-limited rudder, 7 states, 20 parameters",
        rhs=equations.ship,
        constants=equations.ship_constants,
        values=_SHIP,
        free=(
            *("R_0", "X_vv", "X_vr", "X_rr", "X_vvvv"),
            *("Y_v", "Y_r", "Y_vvv", "Y_vvr", "Y_vrr", "Y_rrr"),
            *("N_v", "N_r", "N_vvv", "N_vvr", "N_vrr", "N_rrr"),
            *("t_P", "a_H", "kappa"),
        ),
        states=("u", "v", "r", "x", "y", "psi", "delta"),
        input_names=("delta_order", "n"),
        outputs=("u", "v", "r", "x", "y", "psi"),
        noise=np.array([0.01, 0.01, 0.002, 0.05, 0.05, 0.01]),
        x0=np.array([1.179, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
        inputs=np.stack([order, np.full_like(order, 11.85)], axis=1),
        hold="zoh",
    )


def _recorded(rng: np.random.Generator, **fields: Any) -> Workload:
    """The workload with a synthetic record: the plant at its nominal values plus white noise."""
    from engines.python_peers import PlainPython

    empty = np.zeros((len(fields["inputs"]), len(fields["outputs"])))
    blank = Workload(**fields, measured=empty)
    clean = PlainPython(blank).outputs(blank.nominal)
    return Workload(**fields, measured=clean + rng.normal(size=clean.shape) * blank.noise)


_DIVING = {
    **{"rho": 1025.0, "L": 5.3, "m": 5443.4, "I_y": 13587.0, "z_B": -0.061, "B": 53400.0, "X_T": 120.0},
    **{"X_du": -7.6e-3, "Z_dw": -240e-3, "Z_dq": -6.8e-3, "M_dw": -6.8e-3, "M_dq": -17e-3},
    **{"X_uu": -3.85e-3, "X_wq": -200e-3, "X_qq": -15e-3, "Z_0": -1e-3, "Z_w": -300e-3, "Z_aw": -30e-3},
    **{"Z_waw": -600e-3, "Z_q": -140e-3, "Z_qaq": -50e-3, "Z_ds": -73e-3},
    **{"M_w": 100e-3, "M_aw": -10e-3, "M_waw": 50e-3, "M_q": -68e-3, "M_qaq": -20e-3, "M_ds": -41e-3},
}

_SHIP = {
    **{"rho": 1025.0, "L": 7.0, "B": 1.27, "d": 0.46, "nabla": 3.27, "x_G": 0.25, "D_P": 0.216, "H_R": 0.345},
    **{"A_R": 0.0539, "m_x": 0.022, "m_y": 0.223, "J_z": 0.011, "k_zz": 0.25},
    **{"R_0": 0.022, "X_vv": -0.040, "X_vr": 0.002, "X_rr": 0.011, "X_vvvv": 0.771},
    **{"Y_v": -0.315, "Y_r": 0.083, "Y_vvv": -1.607, "Y_vvr": 0.379, "Y_vrr": -0.391, "Y_rrr": 0.008},
    **{"N_v": -0.137, "N_r": -0.049, "N_vvv": -0.030, "N_vvr": -0.294, "N_vrr": 0.055, "N_rrr": -0.013},
    **{"t_P": 0.220, "w_P0": 0.40, "k_0": 0.2931, "k_1": -0.2753, "k_2": -0.1385, "x_P": -0.48},
    **{"C_1": 2.0, "C_2_plus": 1.6, "C_2_minus": 1.1, "t_R": 0.387, "a_H": 0.312, "x_H": -0.464, "x_R": -0.5},
    **{"l_R": -0.710, "gamma_R_minus": 0.395, "gamma_R_plus": 0.640, "epsilon": 1.09, "kappa": 0.50},
    **{"f_alpha": 2.747, "rudder_rate": 0.2757620218, "T_rudder": 0.5},
}
