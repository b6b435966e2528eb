"""The motion with which a recorded run goes on from a moment, whatever its instruments measured of it."""

from __future__ import annotations

import numpy as np

from seatruth.arrays import Indices
from seatruth.errors import BadInput
from seatruth.models.base import Model
from seatruth.models.black_box import BlackBox
from seatruth.simulate.first_velocity import first_velocity
from seatruth.trials.trial import Trial


def first_motion(model: Model, run: Trial, rows: Indices) -> dict[str, float]:
    """The mean recorded outputs over some samples, and the speeds of the model that none of them is.

    These are those of the ground velocity or the log, else those of the positions from these samples on, as where a
    fit with fixed initial states begins.

    Args:
        model: of the run.
        run: without gaps, headings unwrapped.
        rows: the samples (n,), rising.

    Returns:
        m, rad, m/s, rad/s by name of output or state; no speed where nothing tells it.

    Example:
        >>> from seatruth.models import load_model
        >>> t = np.arange(0.0, 20.0, 0.5)
        >>> shown = {"x": 0.6 * t, "y": 0.8 * t, "psi": 0.0 * t + 0.9273}
        >>> run = Trial("run", t, {"delta": 0.0 * t, "n": 0.0 * t}, shown)
        >>> round(first_motion(load_model("mmg"), run, np.arange(3))["u"], 3)
        1.0
    """
    recorded = {name: values[rows] for name, values in run.outputs.items()}
    found = {name: float(np.mean(values)) for name, values in recorded.items() if np.isfinite(values).all()}
    own = [channel.name for channel in model.outputs]
    if "u" in found:
        return found
    shown = {name: found[name] for name in own if name in found}
    shown = first_velocity(model, run.samples(np.arange(rows[0], len(run)))) | shown
    if not any(channel.unit == "m/s" for channel in model.outputs if channel.name in shown):
        return found
    inputs = {name: float(values[rows[0]]) for name, values in run.inputs.items()}
    try:
        motion = model.complete(shown, inputs)
        if "u" not in motion and not isinstance(model, BlackBox):
            motion = dict(
                zip((state.name for state in model.states), model.first_state(shown, inputs, model.nominal()))
            )
    except (BadInput, KeyError):
        return found
    return {name: float(motion[name]) for name in ("u", "v") if name in motion} | found
