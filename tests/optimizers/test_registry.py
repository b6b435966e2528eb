"""The registry: built-in and third-party optimizers, plug-ins that fail, options and their messages."""

from __future__ import annotations

import importlib
import subprocess
import sys
from pathlib import Path

import pytest

from seatruth.errors import BadInput, PluginError
from seatruth.optimizers import available, from_callable, make, minimise
from seatruth.testing.problems import rosenbrock

BUILT_IN = {
    "differential_swarm": {"values"},
    "particle_swarm": {"values"},
    "genetic": {"values"},
    "simulated_annealing": {"values"},
    "ls_svm": {"regression"},
    "newton": {"residuals", "derivatives"},
    "least_squares": {"residuals", "derivatives"},
    "multi_start": {"residuals", "derivatives"},
    "secant": {"residuals", "derivatives"},
    "nelder_mead": {"values"},
    "differential_evolution": {"values"},
    "cma_es": {"values"},
}

PLUGIN = '''
"""A third party's optimizer: this one file and one entry-point line."""

from dataclasses import dataclass

import numpy as np

from seatruth.optimizers import Optimizer, option


@dataclass(frozen=True)
class HillClimber(Optimizer):
    """Gaussian steps from the best point, wider after success, narrower after failure (one-fifth rule)."""

    name = "hill_climber"
    title = "Gaussian steps from the best point"
    needs = frozenset({"values"})

    batch: int = option(10, "steps tried at once", low=2)

    def run(self, problem, rng):
        size = 0.2
        best = problem.start
        value = problem.value(best)
        while size > 1e-9:
            steps = np.clip(best + size * rng.standard_normal((self.batch, problem.dimension)), *problem.box)
            values = problem.values(steps)
            if values.min() < value:
                best, value = steps[values.argmin()], values.min()
                size *= 1.5
            else:
                size *= 0.7
        return "its steps became negligible"
'''


def install(folder: Path, name: str, entry_points: dict[str, str], source: str) -> None:
    """What an installer would leave: a module and a dist-info folder."""
    (folder / f"{name}.py").write_text(source)
    info = folder / f"{name}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    lines = [f"{key} = {value}" for key, value in entry_points.items()]
    (info / "entry_points.txt").write_text("[seatruth.optimizers]\n" + "\n".join(lines) + "\n")


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.syspath_prepend(str(tmp_path))
    importlib.invalidate_caches()
    return tmp_path


@pytest.mark.parametrize(("name", "needs"), BUILT_IN.items())
def test_every_built_in_is_found_with_what_it_needs(name: str, needs: set[str]) -> None:
    info = available()[name]
    assert info.error == ""
    assert info.needs == needs
    assert info.title
    assert info.doc
    assert all(option.doc for option in info.options)
    assert info.package == "seatruth"
    assert make(name).name == name


def test_listing_and_making_do_not_import_the_heavy_libraries() -> None:
    code = (
        "import sys, seatruth.optimizers as o; o.make('particle_swarm'), o.make('genetic'), o.make('cma_es');"
        "print([m for m in ('pyswarms', 'pymoo', 'cma', 'sklearn', 'matplotlib') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_names_are_corrected() -> None:
    with pytest.raises(BadInput, match="Did you mean 'least_squares'"):
        make("least_square")
    with pytest.raises(BadInput, match="Did you mean 'particles'"):
        make("differential_swarm", particle=20)
    with pytest.raises(BadInput, match="Did you mean 'B_scalar'"):
        make("differential_swarm", variant="B_scaler")


@pytest.mark.parametrize(
    ("option", "value", "words"),
    [
        ("particles", 1, "Give 4 to 100000"),
        ("particles", 20.5, "not a whole number"),
        ("particles", "many", "not a whole number"),
        ("particles", True, "not a whole number"),
        ("omega", -1, "Give 0 or more"),
        ("omega", float("nan"), "out of range"),
        ("omega", "1", "not a number"),
        ("variant", 3, "not a text"),
    ],
)
def test_wrong_options_are_refused_in_words(option: str, value: object, words: str) -> None:
    with pytest.raises(BadInput, match=words) as caught:
        make("differential_swarm", **{option: value})
    assert option in caught.value.where


def test_a_whole_number_is_a_number() -> None:
    assert make("differential_swarm", omega=1).describe() == make("differential_swarm", omega=1.0).describe()


def test_one_file_makes_an_optimizer(site: Path) -> None:
    install(site, "climber", {"hill_climber": "climber:HillClimber"}, PLUGIN)
    info = available()["hill_climber"]
    assert (info.package, info.error, [o.name for o in info.options]) == ("climber", "", ["batch"])
    outcome = minimise(rosenbrock().cost, "hill_climber", seed=1)
    assert outcome.value < 1e-6
    assert outcome.optimizer == {"name": "hill_climber", "options": {"batch": 10}}
    with pytest.raises(BadInput, match="Did you mean 'batch'"):
        make("hill_climber", bath=3)


@pytest.mark.slow
def test_the_one_file_passes_the_conformance_suite(site: Path) -> None:
    install(site, "climber", {"hill_climber": "climber:HillClimber"}, PLUGIN)
    (site / "test_climber.py").write_text(
        "import pytest\n"
        "from seatruth.optimizers import make\n"
        "from seatruth.testing.optimizers import OptimizerConformance\n\n\n"
        "class TestHillClimber(OptimizerConformance):\n"
        "    tolerance = 1e-4\n\n"
        "    @pytest.fixture\n"
        "    def optimizer(self):\n"
        "        return make('hill_climber')\n"
    )
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--rootdir", str(site), str(site)]
    done = subprocess.run(command, capture_output=True, text=True, cwd=site, timeout=120)
    assert done.returncode == 0, done.stdout[-3000:]
    assert " passed" in done.stdout


def test_a_plug_in_that_cannot_be_imported_is_reported_and_harms_no_other(site: Path) -> None:
    install(
        site, "broken", {"broken": "broken:Mine", "missing": "broken_too:Mine"}, "raise RuntimeError('no licence')\n"
    )
    found = available()
    assert "RuntimeError: no licence" in found["broken"].error
    assert "broken_too" in found["missing"].error
    assert found["least_squares"].error == ""
    with pytest.raises(PluginError, match="no licence"):
        make("broken")
    assert make("least_squares").name == "least_squares"


def test_a_plug_in_that_is_no_optimizer(site: Path) -> None:
    source = (
        "from dataclasses import dataclass\nfrom seatruth.optimizers import Optimizer\n"
        "class Plain: pass\n"
        "@dataclass(frozen=True)\nclass NoRun(Optimizer):\n    name = 'no_run'\n"
        "@dataclass(frozen=True)\nclass NoName(Optimizer):\n    def run(self, problem, rng): return ''\n"
    )
    points = {"plain": "odd:Plain", "no_run": "odd:NoRun", "no_name": "odd:NoName", "nothing": "odd:Nothing"}
    install(site, "odd", points, source)
    found = available()
    assert "not an Optimizer" in found["plain"].error
    assert "no method `run`" in found["no_run"].error
    assert "no `name`" in found["no_name"].error
    assert "AttributeError" in found["nothing"].error


def test_two_packages_with_one_name_are_not_guessed_between(site: Path) -> None:
    install(site, "mine", {"least_squares": "mine:HillClimber"}, PLUGIN)
    assert "several packages" in available()["least_squares"].error
    with pytest.raises(PluginError, match="Uninstall one"):
        make("least_squares")


def test_a_function_is_an_optimizer(site: Path) -> None:
    source = (
        "from seatruth.optimizers import from_callable\n"
        "def pick(problem, rng):\n    problem.values(problem.sample(rng, 100))\n    return 'a hundred tried'\n"
        "random_pick = from_callable(pick)\n"
    )
    install(site, "picker", {"random_pick": "picker:random_pick"}, source)
    assert available()["random_pick"].error == ""
    outcome = minimise(rosenbrock().cost, "random_pick")
    assert (outcome.evaluations, outcome.reason) == (100, "a hundred tried")
    with pytest.raises(BadInput, match="takes no options"):
        make("random_pick", n=3)


def test_needs_of_a_function_are_checked() -> None:
    with pytest.raises(BadInput, match="Did you mean 'residuals'"):
        from_callable(lambda problem, rng: "", needs=("residual",))
