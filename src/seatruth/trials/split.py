"""A trial with pauses as several trials, each of which begins anew."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np

from seatruth.errors import BadInput
from seatruth.trials.check.helpers import pauses
from seatruth.trials.check.limits import FEW_SAMPLES
from seatruth.trials.trial import Step, Trial


def split_at_gaps(trial: Trial) -> list[Trial]:
    """The parts of a trial between pauses of the sampling, called NAME_1, NAME_2, ...; itself where it has none.

    What the inputs did in a pause is not known, so that each part has an initial state of its own. Parts of fewer than
    20 samples are left out; the step that stands on record in each part says how many.

    Raises:
        BadInput: no part is long enough.

    Example:
        >>> import numpy as np
        >>> from seatruth import Trial
        >>> t = np.concatenate([np.arange(30.0), np.arange(50.0, 90.0)])
        >>> [(part.name, len(part)) for part in split_at_gaps(Trial("run", t, {"delta": 0.0 * t}, {"r": 0.0 * t}))]
        [('run_1', 30), ('run_2', 40)]
    """
    if len(trial) < 3 or not (np.diff(trial.t) > 0).all():
        return [trial]  # the checks say what is wrong with it
    before, _ = pauses(trial)
    if not before.size:
        return [trial]
    edges = [0, *(before + 1).tolist(), len(trial)]
    parts = [(a, b) for a, b in itertools.pairwise(edges) if b - a >= FEW_SAMPLES]
    if not parts:
        raise BadInput(
            f"no part between its pauses has {FEW_SAMPLES} samples",
            where=f"trial {trial.name!r}",
            do="Leave out split_at_gaps.",
        )
    lost = len(trial) - sum(b - a for a, b in parts)
    effect = f"{len(edges) - 1} parts between pauses"
    if lost:
        short = len(edges) - 1 - len(parts)
        effect += f", {short} of them of fewer than {FEW_SAMPLES} samples: left out ({lost} samples)"
    step = Step("split_at_gaps", {}, effect)
    found = [trial.section(a, b, f"{trial.name}_{number}") for number, (a, b) in enumerate(parts, 1)]
    return [replace(part, steps=(*part.steps, step)) for part in found]
