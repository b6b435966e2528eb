"""The axes in which a log gives positions, headings and velocities, and how they become seatruth's.

Inside: x north, y east, z down about an origin on record; body axes x forward, y to starboard, z down; psi clockwise
from north. A log may have latitude and longitude, UTM, east-north-up (ENU) and forward-left-up (FLU) axes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from seatruth.arrays import Array
from seatruth.errors import BadInput
from seatruth.trials.geodesy import MAX_DISTANCE, convergence, geographic, parse_zone, to_plane
from seatruth.trials.places import place
from seatruth.trials.trial import Step, Trial

POSITIONS = (("latitude", "longitude"), ("northing", "easting"))
"""Pairs of channels that give x and y."""
_MIRRORED = ("theta", "v", "w", "v_w", "w_w", "q", "r", "a_y", "a_z", "f_y", "f_z")
"""Channels in body axes whose sign differs between forward-left-up and forward-starboard-down."""


@dataclass(frozen=True)
class Frames:
    """The axes of a log.

    Args:
        earth: "NED" (x north, y east, z down, psi clockwise from north) or "ENU" (x east, y north, z up, psi
            counter-clockwise from east).
        body: "FRD" (x forward, y to starboard, z down) or "FLU" (x forward, y to port, z up).
        origin: latitude and longitude in degrees of x = y = 0; None takes the first fix.
        utm: zone of UTM coordinates, "32 north".

    Raises:
        BadInput: a zone or an origin that is none.
    """

    earth: Literal["NED", "ENU"] = "NED"
    body: Literal["FRD", "FLU"] = "FRD"
    origin: tuple[float, float] | None = None
    utm: str | None = None

    def __post_init__(self) -> None:
        if self.utm is not None:
            parse_zone(self.utm)
        if self.origin is not None and not (abs(self.origin[0]) < 90.0 and abs(self.origin[1]) <= 360.0):
            raise BadInput(f"the origin {list(self.origin)} is no place", do="Give latitude and longitude in degrees.")


def in_our_axes(trial: Trial, frames: Frames) -> Trial:
    """The trial in seatruth's axes; each change is a step on record, the origin of positions in its conditions.

    Raises BadInput for positions that are none, with their lines.
    """
    if frames.earth == "ENU":
        trial = _from_enu(trial)
    if frames.body == "FLU":
        trial = _from_flu(trial)
    return _positions(trial, frames)


def _from_enu(trial: Trial) -> Trial:
    have = set(trial.outputs)
    if len(have & {"x", "y"}) == 1:
        raise BadInput(
            "the log's axes are east-north-up, and it names only one of x and y",
            where=trial.source,
            do="Name both: x is the column of the log's x axis (east).",
        )
    changes: dict[str, Callable[[Array], Array]] = {
        "z": lambda z: -z,
        "psi": lambda psi: 0.5 * math.pi - psi,
    }
    outputs = {name: changes[name](values) if name in changes else values for name, values in trial.outputs.items()}
    if "x" in have:
        outputs["x"], outputs["y"] = trial.outputs["y"], trial.outputs["x"]
    inputs = {name: changes[name](values) if name in changes else values for name, values in trial.inputs.items()}
    changed = [name for name in ("x", "y", "z", "psi") if name in {*outputs, *inputs}]
    step = Step("frames", {"earth": "ENU"}, f"east-north-up to north-east-down: {', '.join(changed) or 'no channel'}")
    return trial.with_step(step, outputs=outputs, inputs=inputs)


def _from_flu(trial: Trial) -> Trial:
    def turned(channels: Mapping[str, Array]) -> dict[str, Array]:
        return {name: -values if name in _MIRRORED else values for name, values in channels.items()}

    changed = [name for name in (*trial.inputs, *trial.outputs) if name in _MIRRORED]
    step = Step(
        "frames",
        {"body": "FLU"},
        f"forward-left-up to forward-starboard-down, sign changed: {', '.join(changed) or 'no channel'}",
    )
    return trial.with_step(step, outputs=turned(trial.outputs), inputs=turned(trial.inputs))


def _positions(trial: Trial, frames: Frames) -> Trial:
    """x and y from latitude and longitude, or from UTM coordinates."""
    pairs = [pair for pair in POSITIONS if {*pair} & {*trial.outputs}]
    if not pairs:
        return trial
    where = trial.source or f"trial {trial.name!r}"
    first, second = pairs[0]
    if len(pairs) > 1 or {"x", "y"} & {*trial.outputs}:
        raise BadInput(
            "its position is given twice", where=where, do="Name x and y, or latitude and longitude, or UTM."
        )
    if not {first, second} <= {*trial.outputs}:
        lacking = second if first in trial.outputs else first
        raise BadInput(f"{lacking} is missing beside the other coordinate", where=where, do="Name both columns.")
    if first == "northing" and frames.utm is None:
        raise BadInput(
            "UTM coordinates need their zone, as grid north is not true north",
            where=where,
            do='State it, as utm = "32 north" in [frames]; local coordinates are named x (north) and y (east).',
        )
    a, b = trial.outputs[first], trial.outputs[second]
    ok = np.isfinite(a) & np.isfinite(b)
    if not ok.any():
        raise BadInput("no sample has a position", where=where, do="Check the columns, or leave them out.")
    latitude, longitude = (a, b) if first == "latitude" else geographic(a, b, ok, frames.utm or "", place(trial, [0]))
    _refuse(trial, ok & ~((np.abs(latitude) < 90.0) & (np.abs(longitude) <= 360.0)), latitude, longitude,
            'are no degrees', 'NMEA writes ddmm.mmmm: set unit = "ddmm" for both.')  # fmt: skip
    _refuse(trial, ok & (latitude == 0.0) & (longitude == 0.0), latitude, longitude,
            "is what a receiver writes without a fix", "Mark them with invalid_where.")  # fmt: skip
    start = int(np.flatnonzero(ok)[0])
    origin = frames.origin or (float(latitude[start]), float(longitude[start]))
    x, y = to_plane(latitude, longitude, origin)
    far = ok & (np.hypot(x, y) > MAX_DISTANCE)
    if far[ok].all() and (np.hypot(*to_plane(longitude, latitude, origin))[ok] <= MAX_DISTANCE).all():
        raise BadInput("latitude and longitude stand in each other's place", where=place(trial, np.flatnonzero(far)),
                       do="Exchange their columns in [channels].")  # fmt: skip
    _refuse(trial, far, latitude, longitude,
            f"is more than {MAX_DISTANCE / 1e3:g} km from the origin {origin[0]:.7f}, {origin[1]:.7f}",
            "Mark wrong fixes with invalid_where, or set origin in [frames].")  # fmt: skip
    outputs = {name: values for name, values in trial.outputs.items() if name not in (first, second)}
    turn = math.degrees(convergence(latitude[ok], longitude[ok], origin))
    step = Step(
        "position",
        {"origin": list(origin), **({"utm": frames.utm} if first == "northing" else {})},
        f"x, y north and east of {origin[0]:.7f}, {origin[1]:.7f} (WGS-84, tangent plane) from {first} and {second}; "
        f"true north turns by up to {turn:.2g} deg against x over the run",
    )
    return trial.with_step(
        step, outputs={**outputs, "x": x, "y": y}, conditions={**trial.conditions, "origin": list(origin)}
    )


def _refuse(trial: Trial, wrong: NDArray[np.bool_], latitude: Array, longitude: Array, what: str, do: str) -> None:
    rows = np.flatnonzero(wrong)
    if rows.size:
        fix = f"latitude {latitude[rows[0]]:.7g}, longitude {longitude[rows[0]]:.7g}"
        more = f" ({rows.size} samples)" if rows.size > 1 else ""
        raise BadInput(f"{fix} {what}{more}", where=place(trial, rows), do=do)


def with_origin(frames: Frames, trial: Trial) -> Frames:
    """The frames with a trial's origin, for the other trials of the same study."""
    origin = trial.conditions.get("origin")
    if frames.origin is not None or not isinstance(origin, list):
        return frames
    return replace(frames, origin=(float(origin[0]), float(origin[1])))
