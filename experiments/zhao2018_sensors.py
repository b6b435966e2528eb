"""What the vehicle's logger writes, and the preparation that makes trials of it (Zhao, Xie and Qiao 2018).

The log is as such logs are: degrees and rpm, the instruments' axes (y up, turns to port positive), sensors away from
the origin, outliers, three sources of depth. The preparation is the paper's [P]: cut, outliers, smoothing, axes, signs
and units, lever arms, fewer samples, depth from a Kalman filter; numbers are [S]. Every step is one of the library's
and stands on record in the trial.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seatruth.manoeuvres import Stepper
from seatruth.models.torpedo import Torpedo
from seatruth.trials import Trial
from seatruth.trials.prepare import apply_steps

Array = NDArray[np.float64]
DEGREE = math.pi / 180.0

DVL = (-0.30, 0.0, 0.06)
IMU = (0.10, 0.0, 0.03)
GAUGE = (0.40, 0.0, -0.05)
"""[S] Doppler log, inertial unit and pressure gauge in body axes, m forward, to starboard, down."""
NOISE: Mapping[str, float] = {
    **dict.fromkeys(("p", "q", "r"), 0.2 * DEGREE),
    **dict.fromkeys(("phi", "theta"), 0.1 * DEGREE),
    "psi": 0.3 * DEGREE,
    **dict.fromkeys(("u", "v", "w"), 0.01),
    **dict.fromkeys(("a_x", "a_y"), 0.004),
    "depth": 0.03,
    "z_ins": 0.05,
    "z_x": 0.3,
}
"""[S] White noise of each sample, SI; rates as in the reference figures of the lateral channel [V]."""
FIN_NOISE = 0.005 * DEGREE
"""[S] of the fins' own sensors: the recorded fin is regressed on, not the ordered one [P]."""
LOOSE_FIN = 0.02 * DEGREE
"""[S] of worse ones, to show what they cost."""
DRIFT = 0.01
"""[S] Random walk of the inertial depth, m/sqrt(s)."""
OUTLIERS: Mapping[str, tuple[float, float]] = {
    **dict.fromkeys(("u", "v", "w"), (0.01, 0.6)),
    **dict.fromkeys(("p", "q", "r"), (0.003, 20.0 * DEGREE)),
    "depth": (0.005, 1.0),
    "z_x": (0.03, 5.0),
}
"""[S] Part of the samples that are wrong, and by about how much."""
TRACKED = 20
"""The tracker sees the vehicle once in so many samples."""
RATE = 10.0
"""Hz after preparation."""
CUTOFF = 0.5 * RATE
"""Hz: six times T1's fastest mode (roll, 4.93 rad/s; the default is five), and half the new rate, so that white noise
stays white in the samples that are kept."""
IDLE = 100
"""Samples that the logger writes before the run begins."""


def logged(truth: Trial, vehicle: str, rng: np.random.Generator, *, fin_noise: float = FIN_NOISE) -> Trial:
    """The logger's record of a true run: raw channels, raw units."""
    y = {name: np.asarray(values) for name, values in truth.outputs.items()}
    change = rates_of(truth, vehicle)
    w = np.column_stack([y["p"], y["q"], y["r"]])
    dw = np.column_stack([change["p"], change["q"], change["r"]])
    velocity = np.column_stack([y["u"], y["v"], y["w"]])
    acceleration = np.column_stack([change["u"], change["v"], change["w"]]) + np.cross(w, velocity)
    log = velocity + np.cross(w, DVL)
    felt = acceleration + np.cross(dw, IMU) + np.cross(w, np.cross(w, IMU))
    down = np.column_stack(
        [-np.sin(y["theta"]), np.cos(y["theta"]) * np.sin(y["phi"]), np.cos(y["theta"]) * np.cos(y["phi"])]
    )
    made = {**{name: y[name] for name in ("p", "q", "r", "phi", "theta", "psi")}, "a_x": felt[:, 0], "a_y": felt[:, 1]}
    made |= {"u": log[:, 0], "v": log[:, 1], "w": log[:, 2], "depth": y["z"] + down @ GAUGE}
    drift = DRIFT * math.sqrt(float(truth.t[1])) * np.cumsum(rng.standard_normal(len(truth)))
    made |= {"z_ins": y["z"] + drift + 0.4, "z_x": y["z"].copy()}
    for name, values in made.items():
        seen = values + NOISE[name] * rng.standard_normal(len(truth))
        if name in OUTLIERS:
            part, size = OUTLIERS[name]
            wrong = rng.random(len(truth)) < part
            sizes = size * (0.5 + rng.random(len(truth))) * rng.choice([-1.0, 1.0], len(truth))
            seen = np.where(wrong, seen + sizes, seen)
        made[name] = seen
    made["z_x"] = np.where(np.arange(len(truth)) % TRACKED == 0, made["z_x"], np.nan)
    fins = {
        name: truth.inputs[name] + fin_noise * rng.standard_normal(len(truth))
        for name in ("delta", "delta_s", "delta_d")
    }
    raw = {name: values / DEGREE for name, values in (fins | _named(made, ("p", "q", "r", "phi", "theta"))).items()}
    raw["psi"] = -np.degrees(np.angle(np.exp(1j * made["psi"])))  # to port, within half a turn
    raw["r"], raw["delta"] = -raw["r"], -raw["delta"]
    raw |= _named(made, ("u", "v", "a_x", "a_y", "depth", "z_ins", "z_x")) | {"w": -made["w"]}
    raw["n"] = np.rint(60.0 * truth.inputs["n"])
    inputs = {name: _waited(raw.pop(name)) for name in truth.inputs}
    outputs = {name: _waited(values) for name, values in raw.items()}
    t: Array = np.arange(len(truth) + IDLE) * np.float64(truth.t[1] - truth.t[0])
    return replace(truth, t=t, inputs=inputs, outputs=outputs, source="simulated vehicle and sensors")


def prepared(log: Trial, *, fused: bool = True) -> Trial:
    """The published chain on a log; `fused` makes one depth of the three, which takes the most time."""
    return apply_steps(log, [step for step in chain() if fused or step[0] != "fuse_depth"])


def chain() -> list[tuple[str, dict[str, Any]]]:
    """The steps by name with their options. Units come first: angles must be unwrapped before a median or a filter."""
    rates = ["p", "q", "r"]
    angles = [*rates, "phi", "theta", "psi", "delta", "delta_s", "delta_d"]
    smooth = ["u", "v", "w", *rates, "phi", "theta", "psi", "a_x", "a_y"]
    return [
        ("cut", {"start": IDLE * 0.05}),
        ("zero_time", {}),
        ("correct", {"multiply": {**dict.fromkeys(angles, DEGREE), "n": 1.0 / 60.0}}),
        ("change_sign", {"channels": ["r", "psi", "w", "delta"]}),
        ("unwrap", {"channels": ["psi"]}),
        # at the median, not as a gap: what is an output here is an input of another channel, which has no gaps
        ("hampel", {"channels": ["u", "v", "w", *rates], "window": 11, "sigmas": 4.0, "replace": "median"}),
        ("hampel", {"channels": ["depth"], "window": 11, "sigmas": 4.0}),
        ("hampel", {"channels": ["z_x"], "window": 201}),
        ("low_pass", {"cutoff": CUTOFF, "channels": [*smooth, "delta", "delta_s", "delta_d", "n"]}),
        ("lever_arm", {"position": list(DVL), "channels": ["u", "v", "w"]}),
        ("lever_arm", {"position": list(IMU), "channels": ["a_x", "a_y"]}),
        ("lever_arm", {"position": list(GAUGE), "channels": ["depth"]}),
        (
            "fuse_depth",
            {
                "sources": {"depth": NOISE["depth"], "z_x": NOISE["z_x"]},
                "inertial": "z_ins",
                "inertial_sd": NOISE["z_ins"],
                "bias_walk": DRIFT,
                "into": "z",
            },
        ),
        ("resample", {"rate": RATE, "anti_alias": False}),
    ]


def bound_noise(names: tuple[str, ...]) -> dict[str, float]:
    """Deviations that, at the prepared rate, hold as much information as the raw samples do."""
    return {name: NOISE[name] * math.sqrt(RATE * 0.05) for name in names}


def rates_of(truth: Trial, vehicle: str) -> dict[str, Array]:
    """d/dt of the states along a true run."""
    model = Torpedo(vehicle)
    stepper = Stepper(model)
    rows = []
    for k in range(len(truth)):
        state = tuple(float(truth.outputs[channel.name][k]) for channel in model.states)
        rows.append(stepper.rate(0.0, state, {name: float(values[k]) for name, values in truth.inputs.items()}))
    return {channel.name: column for channel, column in zip(model.states, np.array(rows).T)}


def _named(values: Mapping[str, Array], names: tuple[str, ...]) -> dict[str, Array]:
    return {name: values[name] for name in names}


def _waited(values: Array) -> Array:
    """The channel with the logger's idle time before the run, in which the first value stands."""
    return np.concatenate([np.full(IDLE, values[0]), values])
