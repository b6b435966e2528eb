"""SINDy on the discrepancy: which term, added to which equation, explains the accelerations that are left over."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from withheld.programs.common import fitted, recorded
from withheld.verdicts import verdict

THRESHOLD = 0.1
"""Of sequentially thresholded least squares, on standardised columns."""
QUIET = 0.02
"""Share of the residual accelerations' variance below which a formula counts as nothing."""
BLAMED = {
    ("u", "1"): "thrust_gain", ("u", "u"): "drag_increase", ("u", "u^2"): "drag_increase", ("u", "v r"): "turning_loss",
    ("u", "w q"): "turning_loss_vertical", ("v", "1"): "wind", ("v", "v"): "shallow_water", ("v", "r"): "added_mass",
    ("v", "u"): "propeller_walk", ("v", "delta"): "rudder_gain", ("r", "1"): "rudder_offset",
    ("r", "u"): "rudder_offset", ("r", "u^2"): "rudder_offset", ("r", "v"): "munk", ("r", "u v"): "munk",
    ("r", "r"): "added_mass",
    ("r", "delta"): "rudder_gain", ("w", "1"): "net_weight", ("w", "w"): "cross_flow_vertical",
    ("w", "u^2"): "asymmetry", ("q", "1"): "trim", ("q", "u^2"): "asymmetry",
    ("q", "delta_s"): "plane_gain",
    ("q", "u w"): "munk_vertical", ("q", "w"): "munk_vertical", ("q", "q"): "added_mass",
}  # fmt: skip
"""What a term in an equation stands for; another term is outside the library."""
EQUATIONS = {"u": "surge", "v": "sway", "r": "yaw", "w": "heave", "q": "pitch"}


def sindy(study: Path) -> dict[str, Any]:
    """Refits, takes measured less modelled accelerations along the records, and lets pysindy find a sparse formula."""
    import pysindy

    from seatruth import load_study

    loaded = load_study(study)
    model = loaded.model
    values = {p.name: p.value for p in loaded.parameters} | fitted(loaded)
    velocities = [name for name in ("u", "v", "w", "r", "q") if any(s.name == name for s in model.states)]
    inputs = [channel.name for channel in model.inputs if channel.name != "n"]
    features, targets = [], []
    for trial in loaded.trials:
        states = np.stack([_smooth(recorded(trial, s.name)) for s in model.states], axis=1)
        columns = [*states.T, *(np.asarray(trial.inputs[c.name]) for c in model.inputs)]
        rates = _modelled(model, values, columns)
        real = np.gradient(states, trial.t, axis=0)
        keep = [k for k, s in enumerate(model.states) if s.name in velocities]
        targets.append((real - rates)[5:-5, keep])
        used = [states[:, k] for k in keep] + [np.asarray(trial.inputs[name]) for name in inputs]
        features.append(np.stack(used, axis=1)[5:-5])
    x, y = np.concatenate(features), np.concatenate(targets)
    library = pysindy.PolynomialLibrary(degree=2).fit(x)
    names = library.get_feature_names([*velocities, *inputs])
    theta = np.asarray(library.transform(x))
    scale = np.maximum(theta.std(axis=0), 1e-12)
    scale[names.index("1")] = 1.0
    best: tuple[float, str, str] = (QUIET, "", "")
    for k, name in enumerate(velocities):
        spread = max(float(y[:, k].std()), 1e-300)
        optimizer = pysindy.STLSQ(threshold=THRESHOLD, alpha=1e-3)
        optimizer.fit(theta / scale, y[:, k : k + 1] / spread)
        found = np.ravel(optimizer.coef_)
        explained = 1 - float(np.var(y[:, k] / spread - (theta / scale) @ found))
        strongest = int(np.argmax(np.abs(found)))
        if found[strongest] != 0 and explained > best[0]:
            best = (explained, name, names[strongest])
    case = study.parent.name
    if not best[1]:
        return verdict(case, [([], 1.0)])
    cause = BLAMED.get((best[1], best[2]), "unknown")
    return verdict(case, [([cause], 1.0)], places=[EQUATIONS[best[1]]])


def _smooth(series: Any, width: int = 7) -> Any:
    """A running quadratic, so that noise can be differentiated at all."""
    from scipy.signal import savgol_filter

    return savgol_filter(series, width, 2)


def _modelled(model: Any, values: dict[str, float], columns: list[Any]) -> Any:
    """The model's rates at each sample, (n, states)."""
    from seatruth.models import Environment
    from seatruth.models.base import record

    s, i, p = (record(name, fields) for name, fields in zip("sip", (model.states, model.inputs, model.parameters)))
    own = p(*(values.get(q.name, q.value) for q in model.parameters))
    count = len(model.states)
    rows = np.stack(columns, axis=1)
    return np.array([model.rhs(s(*row[:count]), i(*row[count:]), own, Environment()) for row in rows.tolist()])
