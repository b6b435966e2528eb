"""What is said where trials or models are not as they should be: a clear word, never a traceback."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
import small_case as small

from seatruth import (
    BadInput,
    BlackBox,
    Channel,
    Diagnosis,
    Parameter,
    Prior,
    Study,
    Trial,
    Trials,
    diagnose,
    write_report,
)
from seatruth.cli import run
from seatruth.report.page import render
from seatruth.report.text import diagnosis as text


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return small.folder_with_model(tmp_path_factory.mktemp("odd"))


@pytest.fixture(scope="module")
def runs(folder: Path) -> list[Trial]:
    return small.trials(folder, {"rudder_offset_angle": 0.02}, specs=["rudder_offset"])


def diagnosed(
    folder: Path, trials: list[Trial], effects: tuple[str, ...] = small.EFFECTS, **options: bool
) -> Diagnosis:
    found = diagnose(small.study(folder, trials), effects, threads=1, **options)
    page = render(found)  # every diagnosis can be shown
    assert "nan" not in page.replace("finance", "").lower().split("provenance")[0].split()
    return found


def codes(found: Diagnosis) -> set[str]:
    return {finding.code for finding in found.findings}


def test_one_trial_alone(folder: Path, runs: list[Trial]) -> None:
    found = diagnosed(folder, runs[:1])
    assert "one-trial" in codes(found)
    assert "nothing can be left out" in text.validation_in_words(found)
    assert found.verdict.sentence


def test_trials_without_excitation(folder: Path, runs: list[Trial]) -> None:
    """The rudder is never moved: no cause can be told, and none is named with certainty beyond what was seen."""
    rng = np.random.default_rng(1)
    t = runs[0].t
    still = [
        Trial(
            f"still {k}",
            t,
            {"delta": np.zeros(t.size)},
            {name: sd * rng.normal(size=t.size) for name, sd in small.NOISE.items()},
            synthetic=True,
        )
        for k in range(3)
    ]
    found = diagnosed(folder, still)
    assert found.verdict.kind in ("no_gap", "underpowered")
    assert "rudder_gain" in {effect.name for effect in text.undetectable(found)}
    assert "rudder effectiveness" in text.undetectable_in_words(found)


def test_a_channel_that_no_trial_recorded(folder: Path, runs: list[Trial]) -> None:
    bare = [dataclasses.replace(trial, outputs={"r": trial.outputs["r"]}) for trial in runs]
    found = diagnosed(folder, bare)
    assert set(found.gap["channel"]) == {"r"}
    assert "rudder_offset" in (*found.named, *found.verdict.members)


def test_channels_with_gaps(folder: Path, runs: list[Trial]) -> None:
    holes = []
    for trial in runs:
        psi = trial.outputs["psi"].copy()
        psi[30:60] = math.nan
        holes.append(dataclasses.replace(trial, outputs={**trial.outputs, "psi": psi}))
    found = diagnosed(folder, holes)
    assert found.named == ("rudder_offset",)
    assert found.gap.loc[found.gap["channel"] == "psi", "n"].iloc[0] == len(runs[0]) - 30


@pytest.mark.slow
def test_the_same_data_twice(folder: Path, runs: list[Trial]) -> None:
    twice = [*runs, dataclasses.replace(runs[0], name="copy")]
    found = diagnosed(folder, twice)
    assert text.data_first(found)
    assert any("copy" in f.message or "same" in f.message for f in found.findings if f.severity == "error")


def test_rate_of_turn_with_the_wrong_sign_is_said_first(folder: Path, runs: list[Trial]) -> None:
    wrong = [dataclasses.replace(t, outputs={**t.outputs, "r": -t.outputs["r"]}) for t in runs]
    found = diagnosed(folder, wrong)
    assert "psi-r-sign" in codes(found)
    first = text.data_first(found)
    assert "sign" in first
    page = render(found)
    assert page.index("The data first") < page.index("Which?")


def test_degrees_taken_for_radians_are_said_first(folder: Path, runs: list[Trial]) -> None:
    wrong = [dataclasses.replace(t, outputs={**t.outputs, "r": np.rad2deg(t.outputs["r"])}) for t in runs]
    found = diagnosed(folder, wrong)
    assert text.data_first(found)
    assert "deg/s" in text.data_first(found)


def test_a_simulation_that_is_unstable(folder: Path, runs: list[Trial]) -> None:
    """A model that runs away whatever its coefficients."""
    place = folder / "unstable"
    place.mkdir()
    grows = small.SHIP.replace("(p.K * i.delta - s.r) / p.T", "p.K * i.delta + 40.0 * (s.r + 0.01) * (1.0 + s.r * s.r)")
    (place / "ship.py").write_text(grows)
    with pytest.raises(BadInput, match="diverges"):
        diagnose(small.study(place, runs), small.EFFECTS, threads=1)


EXPLODES = """
from seatruth.effects import Effect
from seatruth.models import Parameter


class Explodes(Effect):
    name = "explodes"
    title = "a rudder that runs away"
    cause = "actuator.steering.gain"
    needs_inputs = ("delta",)
    needs_states = ("r",)
    acts_on = ("actuator:delta",)
    parameters = (Parameter("k", 1e3, "1"),)
    null = {"k": 0.0}
    starts = ({"k": 1e4},)

    @staticmethod
    def true_inputs(i, s, q, e):
        return i._replace(delta=i.delta + q.k * s.r * (1.0 + 1e6 * s.r * s.r))
"""


def test_an_effect_that_makes_the_model_diverge_is_not_named(folder: Path, runs: list[Trial]) -> None:
    from seatruth.effects import load_effects

    (folder / "explodes.py").write_text(EXPLODES)
    (effect,) = load_effects(["explodes.py:Explodes"], folder)
    found = diagnose(small.study(folder, runs), [effect, *small.EFFECTS], threads=1)
    assert "explodes" not in found.named
    assert "rudder_offset" in found.named


@pytest.mark.slow
def test_a_black_box_gets_the_effects_that_act_from_outside(folder: Path, runs: list[Trial]) -> None:
    def ship(trial: Trial, p: dict[str, float], first: dict[str, float] | None) -> dict[str, np.ndarray]:
        assert first is not None
        t, inputs = trial.t, trial.inputs
        r, psi = np.empty(t.size), np.empty(t.size)
        r[0], psi[0] = first["r"], first["psi"]
        for k in range(t.size - 1):
            h = float(t[k + 1] - t[k])
            middle = 0.5 * (inputs["delta"][k] + inputs["delta"][k + 1])
            steady, fade = p["K"] * middle, math.exp(-h / p["T"])
            psi[k + 1] = psi[k] + steady * h + (r[k] - steady) * p["T"] * (1.0 - fade)
            r[k + 1] = steady + (r[k] - steady) * fade
        return {"r": r, "psi": psi}

    box = BlackBox(
        "box",
        ship,
        states=(Channel("r", "rad/s"), Channel("psi", "rad", angle=True)),
        inputs=(Channel("delta", "rad"),),
        outputs=(Channel("r", "rad/s"), Channel("psi", "rad", angle=True)),
        parameters=(
            Parameter("K", 0.1, "1/s", min=0.01, max=1.0, vary=True, prior=Prior(0.1, 0.01)),
            Parameter("T", 10.0, "s", min=1.0, max=100.0, vary=True, prior=Prior(10.0, 1.0)),
        ),
    )
    short = [dataclasses.replace(t, t=t.t[:60], inputs={k: v[:60] for k, v in t.inputs.items()},
                                 outputs={k: v[:60] for k, v in t.outputs.items()}) for t in runs[:2]]  # fmt: skip
    study = Study(name="box", model=box, trials=Trials(short))
    found = diagnose(study, [*small.EFFECTS, "wind"], threads=1)
    assert "wind" in found.unavailable
    assert "rudder_offset" in found.named, str(found)
    assert "Which?" in render(found)


def test_a_formula_has_no_motion(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("data.csv").write_text("Fr,D\n" + "\n".join(f"{x / 10},{x * 0.2}" for x in range(1, 20)))
    Path("study.toml").write_text(
        '[formula]\nexpression = "D = a * Fr"\nfile = "data.csv"\n[parameters]\na = { value = 1.0, vary = true }\n'
        '[cost]\nkind = "formula"\n'
    )
    assert run(["diagnose", "study.toml", "--quiet"]) == 2
    shown = capsys.readouterr().err
    assert "formula has no motion" in shown


def test_a_trial_of_a_few_samples_is_refused(folder: Path, runs: list[Trial]) -> None:
    cut = dataclasses.replace(
        runs[0],
        t=runs[0].t[:5],
        inputs={name: v[:5] for name, v in runs[0].inputs.items()},
        outputs={name: v[:5] for name, v in runs[0].outputs.items()},
    )
    with pytest.raises(BadInput, match="fewer than 10 samples"):
        diagnose(small.study(folder, [cut, *runs[1:]]), small.EFFECTS, threads=1)


@pytest.mark.slow
def test_nothing_free(folder: Path, runs: list[Trial]) -> None:
    study = small.study(folder, runs)
    fixed = study.replace(parameters=tuple(p.replace(vary=False, prior=None) for p in study.parameters))
    found = diagnose(fixed, small.EFFECTS, threads=1, validate=False, suggest=False)
    assert "no-coefficients" in codes(found)
    write_report(found, folder / "fixed.html")
