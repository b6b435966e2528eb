"""The diagnosis on real ships that were told nothing of wind or water, and what the anemometer says afterwards.

    python experiments/real_gap.py [--quick]

KVLCC2 was tested indoors in calm water: naming anything of the environment there is a false alarm. The Esso Osaka model
sailed on a pond in the open. Each day of trials is diagnosed by itself, as one wind blew; only then is the anemometer
opened, its wind compared with what was named, and the gap on trials left out compared between the refitted model, the
model in the wind that the diagnosis estimated, and the model in the wind that was measured.
"""

from __future__ import annotations

import importlib.util
import math
import sys
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pandas as pd

from seatruth import Study, Trials, identify
from seatruth.gap import Diagnosis, diagnose

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

from common import Options, Results, main  # noqa: E402

SEED = 0
ENVIRONMENT = ("current", "varying_current", "wind", "wave_drift", "wave_forces", "shallow_water", "bank")
DAYS = {"31-Jul": "zigzags of 31 July", "14-Sep": "turns of 14 September", "14-Oct": "turns of 14 October"}


def _beside(path: str, name: str) -> ModuleType:
    """Another experiment's module, by its file."""
    spec = importlib.util.spec_from_file_location(name, HERE / path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def studies(data: Path, quick: bool) -> dict[str, Study]:
    """What is diagnosed: each basin's zigzags, and each day of the pond, with every run that is there."""
    ships = _beside("real_ships/__main__.py", "real_ships_studies")
    found: dict[str, Study] = {}
    for basin in ("kvlcc2_marin",) if quick else ("kvlcc2_marin", "kvlcc2_hsva"):
        study: Study = ships.load(basin, data)
        runs = [*study.trials, *ships.sets(study)["left out"]]
        found[basin] = study.but(trials=Trials(runs), holdout=Trials([]))
    if not quick:
        pond: Study = ships.load("esso_osaka", data)
        runs = [*pond.trials, *pond.holdout]
        for day in DAYS:
            own = [run for run in runs if f"_{day}-" in run.name]
            if len(own) > 1:
                found[f"esso_osaka_{day}"] = pond.but(trials=Trials(own), holdout=Trials([]), name=f"Esso Osaka, {day}")
    return found


def diagnosed(study: Study, folder: Path, threads: int) -> dict[str, Any]:
    """Diagnoses without any knowledge of the weather, saves it, and gives what scoring and figures need."""
    found = diagnose(study, seed=SEED, threads=threads, suggest=False)
    found.save(folder)
    return {**found.as_verdict(), "sentence": found.verdict["sentence"], "shares": found.shares}


def environment(found: Diagnosis) -> float:
    """Probability that anything of the environment acts."""
    return float(sum(c["probability"] for c in found.candidates if any(e in ENVIRONMENT for e in c["effects"])))


def left_out(study: Study) -> dict[str, float]:
    """Errors of each channel on runs left out in turn, from fits to the others: root mean squares over all runs."""
    table = identify(study, seed=SEED, cross_validate=True).cross_validation
    assert table is not None
    return {str(c): float(np.sqrt(np.mean(part["rmse"] ** 2))) for c, part in table.groupby("channel")}


def body(options: Options, results: Results) -> None:
    data = (
        options.trials("kvlcc2_marin") if options.quick else options.trials("kvlcc2_marin", "kvlcc2_hsva", "esso_osaka")
    )
    chosen = studies(data, options.quick)
    results.expect(len(chosen) + (0 if options.quick else 2 * len(DAYS)))
    rows: list[dict[str, Any]] = []
    for name, study in chosen.items():
        folder = options.out / "diagnoses" / name
        definition = {"study": study.content_hash, "seed": SEED}
        results.stage(f"diagnose {name}", definition, partial(diagnosed, study, folder, options.workers))
        found = Diagnosis.load(folder)
        alarm = environment(found)
        calm = name.startswith("kvlcc2")
        results.add_figure(
            f"{name}: probability of wind, current, waves or shallow water",
            alarm,
            "1",
            goal="< 0.5: indoors, calm water" if calm else "",
            met=alarm < 0.5 if calm else None,
            note=found.verdict["sentence"],
        )
        rows.extend(_cause(name, found, cause) for cause in found.which[:6])
        closure = (found.how_far or {}).get("closure")
        if closure:
            results.add_figure(f"{name}: gap closed on runs left out", closure["value"], "1", note=_interval(closure))
    results.add_table("causes", pd.DataFrame(rows))
    if not options.quick:
        _open_the_anemometer(options, results, chosen)


def _open_the_anemometer(options: Options, results: Results, chosen: dict[str, Study]) -> None:
    """After every diagnosis is written: the measured wind beside the one that was estimated."""
    from real_gap_wind import in_measured_wind, mean_wind

    for name, study in chosen.items():
        if not name.startswith("esso"):
            continue
        found = Diagnosis.load(options.out / "diagnoses" / name)
        wind = mean_wind([t.name for t in study.trials], options.data)
        note = (
            f"goes towards {math.degrees(wind['towards']):.0f} deg of the pond; runs differ by {wind['spread']:.2g} m/s"
        )
        results.add_figure(f"{name}: wind by the anemometer", wind["speed"], "m/s", note=note)
        estimated = next((c for c in found.which if c["name"] == "wind" and c["parameters"]), None)
        if estimated:
            values = {q["name"]: q["value"] for q in estimated["parameters"]}
            note = f"{estimated['in_words']}; probability {estimated['probability']:.2g}"
            results.add_figure(f"{name}: wind estimated", math.hypot(values["north"], values["east"]), "m/s", note=note)
            off = math.degrees(math.atan2(values["east"], values["north"]) - wind["towards"])
            results.add_figure(
                f"{name}: direction of the wind, estimated less measured", (off + 180) % 360 - 180, "deg"
            )
        without, within = (in_measured_wind(study, options.data, vary=vary) for vary in (False, True))
        calm = results.stage(f"left out, {name}, no wind", {"study": without.content_hash}, partial(left_out, without))
        blown = results.stage(f"left out, {name}, measured", {"study": within.content_hash}, partial(left_out, within))
        for channel, error in calm.items():
            results.add_figure(
                f"{name}: {channel} on runs left out, measured wind over none",
                blown[channel] / error,
                "1",
                note="under 1: the measured wind helps",
            )


def _cause(name: str, found: Diagnosis, cause: dict[str, Any]) -> dict[str, Any]:
    values = [f"{q['name']} {q['value']:.3g} +- {q['stderr']:.2g} {q['unit']}" for q in cause["parameters"]]
    return {
        "study": name,
        "verdict": found.verdict["kind"],
        "effect": cause["name"],
        **{key: cause[key] for key in ("probability", "log_evidence", "lambda")},
        "value": "; ".join(values),
    }


def _interval(closure: dict[str, float]) -> str:
    return f"95 % interval {closure['lower']:.2g} to {closure['upper']:.2g}"


if __name__ == "__main__":
    raise SystemExit(main("real_gap", "The diagnosis on real ships", body, seeds={"diagnosis": SEED}))
