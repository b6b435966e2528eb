"""The gallery of effects: each with its equation, its signature in a run, and what it is confused with."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from codes_pages import literal
from joblib import Parallel, cpu_count, delayed
from matplotlib.figure import Figure
from scipy.optimize import minimize_scalar

from seatruth import Model, Trial, load_model, simulator
from seatruth.arrays import Array
from seatruth.effects import Effect, available, with_effects
from seatruth.effects.reference import ordered
from seatruth.models import Observation, observed
from seatruth.report.figures.style import BLUE, GREY, INK, MEASURED, VERMILLION, placed, styled

_HEAD = """# Effects and their signatures

Each picture shows what an effect of its typical size changes in a standard run of a built-in model: the difference of
the outputs with and without the effect, nothing refitted; effects of thrusters are shown on a boat with two and on an
underwater vehicle with six. Noise changes no equation: its pictures show a record with it and one with white noise
alone. All runs are **synthetic**. Two effects with signatures of
one shape look alike in such a run; *confused with* names those that only some trials can tell apart, *never told from*
those that none can.

"""
_DEG = math.radians(1.0)
_WITH_THRUSTERS = ("twin_thruster", "bluerov2")
"""Vehicles on which effects of thrusters and of a tether are shown."""
_MOST_WORKERS = 4
"""Processes that draw. Chosen here [S]: each loads the numerical libraries."""


Sizes = Mapping[str, float]
"""An effect's typical values by parameter."""
Setting = tuple[Model, Trial, dict[str, float], str]
"""Model, run, first outputs and a description."""


def write(folder: Path) -> None:
    """Writes index.md with all effects by cause, a page each, and the pictures, on all cores."""
    folder.mkdir(parents=True, exist_ok=True)
    lines = [_HEAD]
    causes: dict[str, list[Effect]] = {}
    every = ordered(available().values())
    for effect in every:
        causes.setdefault(effect.cause, []).append(effect)
    Parallel(n_jobs=min(cpu_count(), _MOST_WORKERS))(delayed(_write)(effect.name, folder) for effect in every)
    for cause, effects in causes.items():
        lines.append(f"## {cause}\n\n")
        lines += [f"- [{effect.name}]({effect.name}.md): {literal(effect.title)}\n" for effect in effects]
        lines.append("\n")
    lines.append("```{toctree}\n:hidden:\n:glob:\n*\n```\n")
    (folder / "index.md").write_text("".join(lines), encoding="utf-8")


def _write(name: str, folder: Path) -> None:
    known = available()
    (folder / f"{name}.md").write_text(page(known[name], known, folder), encoding="utf-8")


def page(effect: Effect, known: Mapping[str, Effect], folder: Path) -> str:
    """The page of an effect in Markdown; its picture goes into the folder."""
    title = literal(effect.title)
    text = f"# {effect.name}\n\n{title[:1].upper()}{title[1:]}. Cause: {effect.cause}.\n\n"
    if effect.equation:
        text += f"```text\n{effect.equation}\n```\n\n"
    for setting in shown_on(effect):
        figure = signature(effect, *setting)
        if figure is not None:
            file = f"{effect.name}_{setting[0].name}.svg"
            figure.savefig(folder / file)
            text += f"![What {effect.name} changes]({file})\n\n"
            text += "What an effect of its typical size (table below) changes in each output, positions in red. "
            text += f"Synthetic run of `{setting[0].name}`: {setting[3]}.\n\n"
    if effect.name in _NOISE:
        noise_signature(effect).savefig(folder / f"{effect.name}.svg")
        text += f"![What {effect.name} does to a record]({effect.name}.svg)\n\n"
        text += f"Synthetic: {_NOISE_RUN}. Left the record, right what remains of it without the motion.\n\n"
    if "![" not in text:  # each effect of the gallery has its picture: the build stops here where one has none
        raise ValueError(f"no run of the gallery shows {effect.name!r}: add one to _settings() or to _NOISE")
    for label, names in (("Never told from", effect.equivalent), ("Confused with", effect.confused_with)):
        if names:
            linked = [f"[{name}]({name}.md)" if name in known else f"`{name}`" for name in names]
            text += f"**{label}**: {', '.join(linked)}\n\n"
    if not effect.equivalent and not effect.confused_with:
        text += "**Confused with**: no other effect.\n\n"
    if effect.distinguished_by:
        text += f"**Told apart by**: {literal(effect.distinguished_by)}\n\n"
    text += f"**Source**: {literal(effect.source)}\n\n" if effect.source else ""
    rows = [
        f"| `{q.name}` | {q.unit} | {effect.null[q.name]:g} | {q.value:.4g} | {literal(q.description)} |"
        for q in effect.parameters
    ]
    return text + "| parameter | unit | null | typical | means |\n|---|---|---|---|---|\n" + "\n".join(rows) + "\n"


def shown_on(effect: Effect) -> list[Setting]:
    """The runs that show an effect: of the most usual vehicle that it acts on, or of those that have thrusters."""
    fitting = [made for made in _settings() if not effect.missing(made[0])]
    if effect.actuator == "thruster" or effect.name == "tether":
        return [made for made in fitting if made[0].name in _WITH_THRUSTERS] or fitting[:1]
    return fitting[:1]


@functools.cache
def _settings() -> list[Setting]:
    """The runs, of the most usual vehicle first."""
    t = np.arange(0.0, 90.0, 0.5)
    zigzag = np.where((t // 12).astype(int) % 2 == 0, 15 * _DEG, -15 * _DEG)
    ship = {"delta": zigzag, "n": np.where(t < 60, 11.85, 8.0)}
    dive = {"delta_s": np.where((t // 15).astype(int) % 2 == 0, 6 * _DEG, -6 * _DEG)}
    torpedo = {"delta": 0.3 * zigzag, "delta_s": 0.3 * dive["delta_s"], "delta_d": 0 * t, "n": np.full(t.size, 22.0)}
    driven = {**dive, "T": np.where((t // 20).astype(int) % 2 == 0, 400.0, -200.0)}
    boat = {
        "n_port": np.where((t // 20).astype(int) % 2 == 0, 10.0, 5.0),
        "n_starboard": np.where((t // 12).astype(int) % 3 == 2, -4.0, 9.0),
    }
    dwell = (t // 10).astype(int)  # each thruster has a pattern of its own
    vehicle = {f"c_{k}": 0.4 * np.sin(1.0 + (2 * k + 1) * dwell) for k in (1, 2, 3, 4)}
    vehicle |= {f"c_{k}": np.where((t // 25).astype(int) % 2 == 0, 0.2, -0.2) for k in (5, 6)}
    vehicle["voltage"] = 16.0 - t / 60.0
    revolutions = {"n": np.where((t // 20).astype(int) % 2 == 0, 22.0, 12.0)}
    made = []
    for name, inputs, first, about in (
        ("mmg", ship, {"u": 1.1, "psi": 0.5}, "zigzag 15/15, fewer revolutions after 60 s"),
        ("diving_plane", dive, {"u": 1.5, "z": 5.0, "depth": 5.0}, "plane angles of 6 deg up and down"),
        ("torpedo", torpedo, {"u": 1.5, "z": 5.0}, "rudder and planes in steps"),
        (
            "diving_plane_driven",
            driven,
            {"u": 1.5, "z": 5.0},
            "plane angles of 6 deg up and down, thrust ahead and astern",
        ),
        ("twin_thruster", boat, {"u": 0.8, "psi": 0.5}, "each thruster in steps, ahead and astern"),
        ("bluerov2", vehicle, {"z": 5.0}, "each thruster in steps, the battery's voltage falling"),
        ("torpedo_forward", revolutions, {"u": 1.5}, "revolutions in steps"),
    ):
        made.append((load_model(name), Trial("run", t, inputs, {}, synthetic=True), first, about))
    # Last, so that it shows only what acts on a receiver's velocity.
    followed = observed(load_model("mmg"), [Observation("v_n"), Observation("v_e")])
    run = Trial("run", t, ship, {}, synthetic=True)
    made.append((followed, run, {"u": 1.1, "psi": 0.5}, "zigzag 15/15, with velocity north and east"))
    return made


def _quantised(
    y: Array, white: Array, sd: float, size: Mapping[str, float], dt: float, rng: np.random.Generator
) -> Array:
    step = size["step"] * _COARSE * sd
    return step * np.round((y + white) / step)


def _with_outliers(
    y: Array, white: Array, sd: float, size: Mapping[str, float], dt: float, rng: np.random.Generator
) -> Array:
    few = rng.choice(len(y), max(2, round(size["rate"] * len(y))), replace=False)
    far = np.zeros(len(y))
    far[few] = rng.choice([-1.0, 1.0], len(few)) * rng.uniform(8.0, 15.0, len(few)) * sd
    return y + white + far


def _coloured(
    y: Array, white: Array, sd: float, size: Mapping[str, float], dt: float, rng: np.random.Generator
) -> Array:
    keep = math.exp(-dt / size["time"])
    slow = np.zeros(len(y))
    for k in range(1, len(y)):
        slow[k] = keep * slow[k - 1] + math.sqrt(1.0 - keep**2) * rng.standard_normal()
    return y + white + size["sd"] * sd * slow


_COARSE = 6.0
"""Quantisation is drawn with so many times its typical step, which the noise would hide in a picture of this size."""
_NOISE = {"quantisation": _quantised, "outliers": _with_outliers, "coloured_noise": _coloured}
"""What each kind of noise makes of a channel (n,) with white noise (n,) of a standard deviation."""
_NOISE_RUN = "yaw rate of `mmg` in a zigzag 15/15, with white noise alone (grey) and with this noise (blue)"


@styled
def noise_signature(effect: Effect) -> Figure:
    """A channel with white noise alone and with this noise, and what the noise leaves of it without the motion."""
    model, trial, first, _ = _settings()[0]
    start = model.first_state(
        {c.name: first.get(c.name, 0.0) for c in model.outputs},
        {name: float(v[0]) for name, v in trial.inputs.items()},
        model.nominal(),
    )
    run = simulator(model, [trial], backend="reference", max_step=0.5)
    column = [channel.name for channel in model.outputs].index("r")
    y = math.degrees(1.0) * run.outputs(np.zeros((1, 0)), np.array(start)[None]).y[0][:, column]
    rng, sd, dt = np.random.default_rng(1), 0.03 * float(np.ptp(y)), float(trial.t[1] - trial.t[0])
    white = sd * rng.standard_normal(len(y))
    noisy = _NOISE[effect.name](y, white, sd, {q.name: q.value for q in effect.parameters}, dt, rng)
    figure = Figure(figsize=(6.8, 1.9))
    for left, motion, title in ((0.6, 0.0, "r (deg/s)"), (4.0, 1.0, "noise of r (deg/s)")):
        axes: Any = placed(figure, left, 0.45, 2.6, 1.2)
        axes.plot(trial.t, y + white - motion * y, color=GREY, linewidth=0.7)
        axes.plot(trial.t, noisy - motion * y, color=BLUE, linewidth=0.9)
        axes.set_title(title, loc="left")
        axes.set_xlabel("t (s)")
    return figure


def change(effect: Effect, model: Model, trial: Trial, first: Mapping[str, float], sizes: Sizes) -> Array:
    """The change of the outputs (n, outputs) by an effect of its typical size, but for the sizes that are given."""
    changed = with_effects(model, [effect])
    size = {effect.named(q.name): sizes.get(q.name, q.value) for q in effect.parameters}
    outputs = []
    for values in ({}, size):
        every = {**changed.nominal(), **values}
        start = changed.first_state(
            {c.name: first.get(c.name, 0.0) for c in changed.outputs},
            {name: float(v[0]) for name, v in trial.inputs.items()},
            every,
        )
        run = simulator(changed, [trial], values=every, backend="reference", max_step=0.5)
        outputs.append(run.outputs(np.zeros((1, 0)), np.array(start)[None]).y[0])
    return np.asarray(outputs[1] - outputs[0])


PAIR = ("drag_increase", "thrust_gain")
"""Two effects that look alike at one number of revolutions; each has one size."""
_ALIKE_UNTIL = 60.0
"""Time at which the run's revolutions are reduced, s."""
_PLACE = "<!-- look_alikes.svg -->"


def write_pair(page: Path) -> None:
    """Puts the picture of the two that look alike where its page has a place for it."""
    text = page.read_text(encoding="utf-8")
    if text.count(_PLACE) != 1:
        raise ValueError(f"{page.name} has no place for its picture: write {_PLACE} there")
    figure, drag, thrust = pair_signatures()
    figure.savefig(page.parent / "look_alikes.svg")
    shown = (
        "![Two signatures that look alike at first, and their difference](look_alikes.svg)\n\n"
        f"Synthetic zigzag 15/15 of `mmg`, with fewer revolutions after {_ALIKE_UNTIL:.0f} s: what "
        f"{100 * drag:.0f} % more drag (`drag_increase`, grey) and {-100 * thrust:.0f} % less thrust (`thrust_gain`, "
        "blue) change in the speed, and below their difference. The thrust is the one that comes nearest in the first "
        f"{_ALIKE_UNTIL:.0f} s. As long as the revolutions stay the same, the two look alike; a trial with other "
        "revolutions tells them apart."
    )
    page.write_text(text.replace(_PLACE, shown), encoding="utf-8")


@styled
def pair_signatures() -> tuple[Figure, float, float]:
    """The signatures of the pair in the speed, the second fitted to the start of the first, and the size of each."""
    model, trial, first, _ = _settings()[0]
    column = [channel.name for channel in model.outputs].index("u")
    known = available()
    one, other = (known[name] for name in PAIR)
    aim = change(one, model, trial, first, {})[:, column]
    early = trial.t < _ALIKE_UNTIL

    def near(size: float) -> Array:
        return np.asarray(change(other, model, trial, first, {other.parameters[0].name: size})[:, column])

    found = minimize_scalar(
        lambda size: float(np.sum((near(size) - aim)[early] ** 2)),
        bounds=(-0.5, 0.0),
        method="bounded",
        options={"maxiter": 12},
    )
    figure = Figure(figsize=(5.4, 3.0))
    upper: Any = placed(figure, 0.7, 1.35, 4.5, 1.3)
    lower: Any = placed(figure, 0.7, 0.42, 4.5, 0.6)
    for axes, name in ((upper, "u (m/s)"), (lower, "difference (m/s)")):
        axes.axhline(0.0, color=GREY, linewidth=0.7)
        axes.axvline(_ALIKE_UNTIL, color=GREY, linewidth=0.7, linestyle=":")
        axes.set_title(name, loc="left")
    upper.plot(trial.t, aim, color=MEASURED, linewidth=3.0)
    upper.plot(trial.t, near(float(found.x)), color=BLUE)
    upper.tick_params(labelbottom=False)
    lower.plot(trial.t, aim - near(float(found.x)), color=INK)
    lower.set_ylim(-0.02, 0.02)
    lower.set_xlabel("t (s)")
    return figure, one.parameters[0].value, float(found.x)


@styled
def signature(effect: Effect, model: Model, trial: Trial, first: Mapping[str, float], about: str) -> Figure | None:
    """The change of each output by the effect at its typical size; None where nothing changes."""
    effect = effect.of_trials([trial.name, "another"])  # where it has values for each trial: two at least
    changed = with_effects(model, [effect])
    difference = change(effect, model, trial, first, {})
    shown = [k for k in range(difference.shape[1]) if np.nanmax(np.abs(difference[:, k])) > 1e-9]
    if not shown:
        return None
    across = min(len(shown), 3)
    down = math.ceil(len(shown) / across)
    figure = Figure(figsize=(2.7 * across, 1.5 * down + 0.1))
    for k, column in enumerate(shown):
        axes: Any = placed(figure, 2.7 * (k % across) + 0.6, 1.5 * (down - 1 - k // across) + 0.42, 2.0, 0.88)
        channel = changed.outputs[column]
        factor, unit = (
            (180 / math.pi, channel.unit.replace("rad", "deg")) if "rad" in channel.unit else (1.0, channel.unit)
        )
        axes.axhline(0.0, color=GREY, linewidth=0.7)
        axes.plot(trial.t, factor * difference[:, column], color=VERMILLION if channel.name in "xyz" else BLUE)
        axes.set_title(f"{channel.name} ({unit})", loc="left")
        axes.set_xlabel("t (s)")
    return figure
