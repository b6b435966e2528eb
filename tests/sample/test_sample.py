"""The embedded sample is what its generator makes, says that it is synthetic, and holds what its README says."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from seatruth import sample
from seatruth.manoeuvres import Stepper, steady_current
from seatruth.models.mmg import MMGShip
from seatruth.sample import make
from seatruth.trials import Trial

FILES = sorted(sample.FOLDER.glob("*.csv"))


def test_the_generator_makes_it_again_byte_for_byte(tmp_path: Path) -> None:
    make.main([str(tmp_path)])
    made = sorted(tmp_path.iterdir())
    assert [file.name for file in made] == sorted([*(f.name for f in FILES), "truth.json"])
    for file in made:
        assert file.read_bytes() == (sample.FOLDER / file.name).read_bytes(), file.name


def test_it_is_small_and_labelled() -> None:
    assert len(FILES) == 5
    assert sum(file.stat().st_size for file in FILES) < 400_000
    for file in FILES:
        assert file.read_text().startswith("# SYNTHETIC")
    study = (sample.FOLDER / sample.STUDY).read_text()
    assert "synthetic = true" in study
    for file in FILES:
        assert file.name in study
    assert all(trial.synthetic for trial in make.trials()[2])


def test_copy(tmp_path: Path) -> None:
    study = sample.copy_to(tmp_path / "new")
    assert study.is_file()
    names = {file.name for file in study.parent.iterdir()}
    assert {file.name for file in FILES} < names
    assert "truth.json" not in names


def replay(trial: Trial, values: dict[str, float], current: float) -> dict[str, np.ndarray]:
    """Outputs from the recorded inputs and the first state of the clean run."""
    stepper = Stepper(MMGShip(), values, steady_current(current, make.CURRENT_DIRECTION))
    clean = {run.name: run for run in make.runs(trial.inputs["n"][0])}[trial.name]
    east = make.CURRENT_DIRECTION - clean.heading
    state = stepper.first(
        {"u": make.SPEED + make.CURRENT * math.cos(east), "v": make.CURRENT * math.sin(east), "psi": clean.heading}
    )
    states = [state]
    inputs = [{name: float(x[k]) for name, x in trial.inputs.items()} for k in range(len(trial))]
    for k in range(len(trial) - 1):
        states.append(stepper.step(trial.t[k], states[-1], inputs[k], inputs[k + 1], make.STEP))
    return dict(zip((c.name for c in MMGShip.states), np.array(states).T))


@pytest.fixture(scope="module")
def made() -> tuple[dict[str, float], list[Trial]]:
    values, _, trials = make.trials()
    return values, trials


@pytest.mark.parametrize("k", range(5))
def test_the_truth_leaves_the_noise_and_nothing_else(made: tuple[dict[str, float], list[Trial]], k: int) -> None:
    values, trials = made
    simulated = replay(trials[k], values, make.CURRENT)
    for name, sd in make.NOISE.items():
        residual = trials[k].outputs[name] - simulated[name]
        assert np.std(residual) == pytest.approx(sd, rel=0.12)
        assert abs(residual.mean()) < 4 * sd / math.sqrt(len(residual))


def test_without_the_current_a_gap_is_left(made: tuple[dict[str, float], list[Trial]]) -> None:
    values, trials = made
    simulated = replay(trials[0], values, 0.0)
    assert np.abs(trials[0].outputs["x"] - simulated["x"]).max() > 10 * make.NOISE["x"]


def test_coefficients_are_10_to_20_percent_off() -> None:
    truth = json.loads((sample.FOLDER / "truth.json").read_text())
    nominal = MMGShip().nominal()
    assert set(truth["parameters"]) == set(make.MOVED)
    for name, value in truth["parameters"].items():
        assert 0.0999 <= abs(value / nominal[name] - 1) <= 0.2001, name


def test_no_code_but_the_generator_names_the_truth() -> None:
    source = sample.FOLDER.parent
    for file in source.rglob("*.py"):
        if file.parent != sample.FOLDER:
            assert "truth.json" not in file.read_text(), file


def test_the_study_reads_the_files() -> None:
    from seatruth.models import load_model
    from seatruth.study import parse, trial_files

    path = sample.FOLDER / sample.STUDY
    file, problems = parse(path.read_text(), str(path))
    assert file.model is not None
    assert set(file.model.vary) == {*make.MOVED, "current_*"}
    model = load_model(file.model.use, parameter_set=file.model.set)
    found = trial_files.recordings(file, path.parent, problems)
    fitted, held = trial_files.read(file, model, found, problems, synthetic=file.study.synthetic)
    problems.stop()
    assert (len(fitted), held.names) == (4, ("zigzag_20_10",))
    for trial, true in zip((*fitted, *held), make.trials()[2]):
        assert trial.synthetic
        for name in ("x", "psi", "r", "delta", "n"):
            assert trial.channel(name) == pytest.approx(true.channel(name), abs=0.006)


def test_the_fit_finds_the_coefficients_and_the_current() -> None:
    """Every parameter within three and a half standard errors, and nothing but noise left."""
    from seatruth.costs import cost_of
    from seatruth.optimizers import Budget, minimise
    from seatruth.study import load_study

    truth = json.loads((sample.FOLDER / "truth.json").read_text())
    speed, towards = truth["effect"]["speed_m_s"], math.radians(truth["effect"]["runs_towards_deg"])
    true = {
        **truth["parameters"],
        "current_north": speed * math.cos(towards),
        "current_east": speed * math.sin(towards),
    }
    cost = cost_of(load_study(sample.FOLDER / sample.STUDY), threads=2)
    found = minimise(cost, "least_squares", budget=Budget(evaluations=20_000), seed=1)
    residuals, derivative = cost.residuals(found.x), cost.jacobian(found.x)
    assert residuals @ residuals / residuals.size == pytest.approx(1.0, abs=0.05)
    errors = np.sqrt(np.diag(np.linalg.inv(derivative.T @ derivative)))
    own = [k for k, name in enumerate(cost.names) if name not in cost.nuisances]
    assert {cost.names[k] for k in own} == set(true)
    for k in own:
        assert abs(found.x[k] - true[cost.names[k]]) < 3.5 * errors[k], cost.names[k]
