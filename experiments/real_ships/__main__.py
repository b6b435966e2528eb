"""Real ships: MMG models fitted to recorded runs, and the runs left out that they predict.

    python experiments/real_ships [--quick]

`studies` are the TOML files beside this one; README.md says what was chosen and why.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd

from seatruth import Study, Trials, identify
from seatruth.models import Parameter
from seatruth.study import read_text, study_from

sys.path[:0] = [str(Path(__file__).resolve().parent), str(Path(__file__).resolve().parents[1])]

from common import COLOURS, Options, Results, main  # noqa: E402
from figures_with_intervals import DRAWS, QUICK_DRAWS, coverage, picture, predicted, text  # noqa: E402
from predict import errors, manoeuvre_figures, simulated, windows  # noqa: E402
from prior_widths import QUICK_WIDTHS, WIDTHS, errors_left_out, narrowed  # noqa: E402

HERE = Path(__file__).resolve().parent
USUAL = "../../../shared/data"
"""The folder of real trials as the study files name it."""
STUDIES = ("kvlcc2_hsva", "kvlcc2_marin", "esso_osaka")
SEED = 0
OTHER_BASIN = "zz_"
"""Names of MARIN's runs; left out of HSVA's study they are another basin's, a set of their own."""


def load(name: str, data: Path) -> Study:
    """A study with its trials taken from this folder of real trials."""
    source = HERE / f"{name}.toml"
    text = read_text(source)
    if data.resolve() != (HERE / USUAL).resolve():
        text = text.replace(USUAL, data.resolve().as_posix())
    return study_from(text, source)


def sets(study: Study) -> dict[str, list[Any]]:
    """The study's runs: fitted, left out, and left out from another basin."""
    elsewhere = study.name == "kvlcc2_hsva"
    out = [run for run in study.holdout if not (elsewhere and run.name.startswith(OTHER_BASIN))]
    other = [run for run in study.holdout if elsewhere and run.name.startswith(OTHER_BASIN)]
    found = {"fitted": list(study.trials), "left out": out}
    return {**found, "other basin": other} if other else found


def only_resistance(study: Study) -> Study:
    """The baseline: published coefficients, only the resistance fitted to the same runs, so that the speed is right."""
    return study.replace(parameters=tuple(_fixed(p) if p.vary and p.name != "R_0" else p for p in study.parameters))


def fit(study: Study, threads: int | None, draws: int = 0) -> dict[str, Any]:
    """Fits without the runs left out: they are not even given. All values, and the table of those that were free; with
    `draws`, also the figures of manoeuvres with intervals.
    """
    estimate = identify(study.replace(holdout=Trials([])), seed=SEED, threads=threads)
    values = {p.name: p.value for p in study.parameters} | estimate.values
    columns = ["value", "stderr", "start", "prior_sd", "min", "max", "verdict"]
    table = estimate.parameters[columns].reset_index(names="name").to_dict("records")
    found = predicted(study, estimate, draws, threads) if draws else None
    return {"values": values, "table": table, "outcome": estimate.outcome["reason"], "predicted": found}


def body(options: Options, results: Results) -> None:
    options.trials("kvlcc2_hsva", "kvlcc2_marin", "esso_osaka")
    names = STUDIES[1:2] if options.quick else STUDIES
    widths = QUICK_WIDTHS if options.quick else WIDTHS
    results.expect(2 * len(names) + len(widths) + 1)
    pooled, intervals = {}, {}
    for name in names:
        study = load(name, options.data)
        definition = {"study": study.content_hash, "seed": SEED}
        draws = QUICK_DRAWS if options.quick else DRAWS
        fitted = results.stage(
            f"fit {name}", {**definition, "draws": draws}, partial(fit, study, options.workers, draws)
        )
        baseline = results.stage(f"baseline {name}", definition, partial(fit, only_resistance(study), options.workers))
        models = {
            "before": {p.name: p.value for p in study.parameters},
            "baseline": baseline["values"],
            "fitted": fitted["values"],
        }
        pooled[name] = report(name, study, models, fitted, options, results)
        intervals[name] = fitted["predicted"]
        groups = {group: [run.name for run in own] for group, own in sets(study).items()}
        results.add_text(text(name, fitted["predicted"], groups))
        for part in ("planned", "measured"):
            results.add_table(f"{name} {part} figures", pd.DataFrame(fitted["predicted"][part]))
        checked = coverage(fitted["predicted"], groups)
        for group, own in checked.groupby("set", sort=False):
            results.add_figure(
                f"{name}: {group}, measured figures inside 95 % intervals",
                100 * float(own.inside.sum()) / float(own.n.sum()), "%", f"{own.n.sum()} figures",
            )  # fmt: skip
    at_its_width = f"{names[0]}, narrowed"
    intervals[at_its_width] = with_the_best_width(load(names[0], options.data), widths, options, results)
    results.add_picture("errors", _errors_picture(pooled))
    results.add_picture("figures", picture(intervals, COLOURS))


def with_the_best_width(study: Study, widths: Sequence[float], options: Options, results: Results) -> dict[str, Any]:
    """The figures of manoeuvres with the priors' width at which fitted runs predict each other best."""
    definition = {"study": study.content_hash, "seed": SEED}
    rows = []
    for width in widths:
        left_out = partial(errors_left_out, study, width, SEED, options.workers)
        found = results.stage(f"priors of {study.name} times {width}", {**definition, "width": width}, left_out)
        rows.append(
            {"width": width, "mean": sum(found) / len(found), **dict(zip([t.name for t in study.trials], found))}
        )
    best = min(rows, key=lambda row: float(row["mean"]))["width"]
    results.add_table(f"{study.name} widths of priors", pd.DataFrame(rows))
    lines = "".join(f"\n| {row['width']} | {row['mean']:.3f} |" for row in rows)
    results.add_text(
        f"### {study.name}: width of the priors\n\nMean logarithm of the errors of each fitted run, predicted from the "
        f"other fitted ones.\n\n| standard deviations times | error |\n|---|---|{lines}"
    )
    draws = QUICK_DRAWS if options.quick else DRAWS
    what = partial(fit, narrowed(study, best), options.workers, draws)
    fitted = results.stage(f"fit {study.name} narrowed", {**definition, "draws": draws, "width": best}, what)
    name = f"{study.name}, priors times {best}"
    results.add_text(text(name, fitted["predicted"], {g: [run.name for run in own] for g, own in sets(study).items()}))
    for part in ("planned", "measured"):
        results.add_table(f"{study.name} narrowed {part} figures", pd.DataFrame(fitted["predicted"][part]))
    predicted_figures: dict[str, Any] = fitted["predicted"]
    return predicted_figures


def report(
    name: str,
    study: Study,
    models: Mapping[str, Mapping[str, float]],
    fitted: Mapping[str, Any],
    options: Options,
    results: Results,
) -> pd.DataFrame:
    """Tables, figures by name and pictures of one study; the errors of each set of runs, over all its runs."""
    runs = sets(study)
    table = errors(study, models, runs, options.workers)
    results.add_table(f"{name} rmse", table)
    results.add_table(f"{name} parameters", pd.DataFrame(fitted["table"]))
    figures = manoeuvre_figures(study, models, runs)
    results.add_table(f"{name} manoeuvres", figures)
    pooled = table[table.trial == "all"].set_index(["set", "over", "model"])
    lines = [
        f"## {name}",
        "Root mean square error, open loop: u, v mm/s; r, psi deg(/s); x, y m.",
        "| runs | over | model | u | v | r | psi | x | y |\n|---|---|---|---|---|---|---|---|---|",
    ]
    scales = {"u": 1e3, "v": 1e3, "r": 180 / math.pi, "psi": 180 / math.pi, "x": 1.0, "y": 1.0}
    for row in table[table.trial == "all"].to_dict("records"):
        where = [str(row[key]) for key in ("set", "over", "model")]
        shown = [f"{float(row[name]) * scale:.3g}" for name, scale in scales.items()]
        lines[-1] += f"\n| {' | '.join([*where, *shown])} |"
    for group in runs:
        for channel, unit, scale in (("psi", "deg", 180 / math.pi), ("u", "m/s", 1.0), ("y", "m", 1.0)):
            ours, theirs = (float(pooled[channel][group, "100 s", model]) for model in ("fitted", "baseline"))
            results.add_figure(
                f"{name}: {group}, {channel} over 100 s", ours * scale, unit,
                f"baseline {theirs * scale:.3g} {unit}", goal="below the baseline", met=ours < theirs,
            )  # fmt: skip
    if "figure" in figures:
        lines.append(
            "| runs | model | figure | n | mean difference | mean size of it |\n|---|---|---|---|---|---|"
            + "".join(_summary_line(where, part) for where, part in figures.groupby(["set", "model", "figure"]))
        )
    results.add_text("\n\n".join(lines))
    for group, own in runs.items():
        results.add_picture(f"{name} {group}", _picture(study, models, own, options.workers))
    return pooled


def _errors_picture(pooled: Mapping[str, pd.DataFrame]) -> Any:
    """Errors of the runs left out, over 100 s, before and after the fit."""
    import matplotlib.pyplot as plt

    rows = [
        (name, group) for name, table in pooled.items() for group in ("left out", "other basin") if group in table.u
    ]
    figure, axes = plt.subplots(1, 3, figsize=(10, 1.4 + 0.55 * len(rows)), sharey=True, layout="constrained")
    channels = (("psi", "heading (deg)", 180 / math.pi), ("u", "speed u (mm/s)", 1e3), ("y", "position y (m)", 1.0))
    for axis, (channel, label, scale) in zip(axes, channels, strict=True):
        for offset, model, colour in ((-0.18, "baseline", COLOURS[1]), (0.18, "fitted", COLOURS[0])):
            sizes = [scale * float(pooled[name][channel][group, "100 s", model]) for name, group in rows]
            axis.barh([k + offset for k in range(len(rows))], sizes, 0.34, color=colour, label=model)
        axis.set_xlabel(label)
        axis.grid(True, axis="x", alpha=0.3)
    axes[0].set_yticks(range(len(rows)), [f"{name}\n{group}" for name, group in rows])
    axes[0].invert_yaxis()
    axes[-1].legend(fontsize=8)
    figure.suptitle("Root mean square error of runs left out, open loop over 100 s", fontsize=10)
    return figure


def _summary_line(where: Any, part: pd.DataFrame) -> str:
    gap = part.difference.dropna()
    missing = len(part) - len(gap)
    count = f"{len(gap)}" + (f" ({missing} without)" if missing else "")
    return f"\n| {' | '.join(where)} | {count} | {gap.mean():.3g} | {gap.abs().mean():.3g} |"


def _picture(study: Study, models: Mapping[str, Mapping[str, float]], runs: list[Any], threads: int) -> Any:
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(len(runs), 2, figsize=(10, 1.6 * len(runs) + 0.6), squeeze=False)
    for row, run in zip(axes, runs, strict=True):
        pieces = windows(run)
        for axis, channel, scale, unit in zip(row, ("psi", "u"), (180 / math.pi, 1.0), ("deg", "m/s"), strict=True):
            axis.plot(run.t, scale * run.outputs[channel], color=COLOURS[7], linewidth=1, label="measured")
            for model, colour in (("baseline", COLOURS[1]), ("fitted", COLOURS[0])):
                for k, made in enumerate(simulated(study, models[model], pieces, threads)):
                    axis.plot(
                        made.t, scale * made.outputs[channel], color=colour, linewidth=1, label="" if k else model
                    )
            axis.set_ylabel(f"{channel}, {unit}")
        row[0].set_title(run.name, fontsize=8, loc="left")
    axes[0][0].legend(fontsize=7)
    axes[-1][0].set_xlabel("t, s")
    figure.tight_layout()
    return figure


def _fixed(parameter: Parameter) -> Parameter:
    return replace(parameter, vary=False, prior=None)


if __name__ == "__main__":
    sys.exit(main("real_ships", (__doc__ or "").splitlines()[0], body, seeds={"search": SEED}))
