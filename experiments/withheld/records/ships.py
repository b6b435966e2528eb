"""The real ships' own studies and predictions (experiments/real_ships), which are scripts and no package."""

from __future__ import annotations

import importlib.util
import sys
from functools import cache
from pathlib import Path
from types import ModuleType

from seatruth import Study, Trials, identify
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


def with_runs(source: str, data: Path) -> Study:
    """The ship's own study with the runs of a source, all of them fitted and none held out."""
    own = SOURCES[source]
    study: Study = script("__main__.py").load(own.study, data)
    runs = {run.name: run for run in (*study.trials, *study.holdout)}
    return study.but(trials=Trials([runs[name] for name in own.runs]), holdout=Trials([]), name=source)


def fitted_elsewhere(source: str, data: Path, threads: int | None = None) -> dict[str, dict[str, float]]:
    """What a fit to the other basin's runs says of each free coefficient: mean and sd of a prior.

    The ships' own study is fitted, whose noise is the error that is expected of the model, so that the deviations are
    not those of the sensors' noise alone. Every run of that basin takes part.
    """
    other: Study = script("__main__.py").load(SOURCES[BASINS[source]].study, data)
    runs = [run for own in ("fitted", "left out") for run in script("__main__.py").sets(other)[own]]
    estimate = identify(other.but(trials=Trials(runs), holdout=Trials([])), seed=SEED, threads=threads)
    table = estimate.parameters
    return {
        str(name): {"mean": float(table.loc[name, "value"]), "sd": float(table.loc[name, "stderr"])}
        for name in table.index
    }
