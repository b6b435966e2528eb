"""The real ships' own studies and predictions (experiments/real_ships), which are scripts and no package."""

from __future__ import annotations

import importlib.util
import math
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import ModuleType

import numpy as np

from seatruth import Study, Trials, identify, load_study
from seatruth.costs.options import as_trajectory
from withheld.records.plan import BASINS, SOURCES

FOLDER = Path(__file__).resolve().parents[2] / "real_ships"
SEED = 0


@cache
def script(file: str) -> ModuleType:
    """A module of experiments/real_ships by its file's name."""
    name = f"real_ships_{Path(file).stem.strip('_')}"
    spec = importlib.util.spec_from_file_location(name, FOLDER / file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


def to_fit(file: Path, source: str, data: Path) -> Study:
    """A case's study under the names of its runs, to be fitted as the ship's own study is: over windows, from their
    first samples, with the noise that stands for the model's expected error.
    """
    own: Study = script("__main__.py").load(SOURCES[source].study, data)
    study = load_study(file)
    runs = Trials([replace(trial, name=run) for trial, run in zip(study.trials, SOURCES[source].runs, strict=True)])
    # That noise has grown with the root of the rate, so that a second weighs the same at any rate.
    steps = [float(np.median(np.diff(trials[0].t))) for trials in (list(own.trials), list(runs))]
    factor = math.sqrt(steps[0] / steps[1])
    noise = {name: factor * float(sd) for name, sd in own.noise.items() if not isinstance(sd, str)}
    windows = as_trajectory(own.cost).segments
    return study.replace(
        trials=runs,
        noise=noise,
        cost=as_trajectory(study.cost).replace(segments=windows, initial="fixed", initial_sd={}),
    )


def fitted_elsewhere(source: str, data: Path, threads: int | None = None) -> dict[str, dict[str, float]]:
    """What a fit to the other basin's runs says of each free coefficient: mean and sd of a prior.

    The ships' own study is fitted, whose noise is the error that is expected of the model, so that the deviations are
    not those of the sensors' noise alone. Every run of that basin takes part.
    """
    other: Study = script("__main__.py").load(SOURCES[BASINS[source]].study, data)
    runs = [run for own in ("fitted", "left out") for run in script("__main__.py").sets(other)[own]]
    estimate = identify(other.replace(trials=Trials(runs), holdout=Trials([])), seed=SEED, threads=threads)
    table = estimate.parameters
    return {
        str(name): {"mean": float(table.loc[name, "value"]), "sd": float(table.loc[name, "stderr"])}
        for name in table.index
    }
