"""Small identifications and one comparison, printed as JSON with every number as exact hexadecimal text.

`test_pinned_results.py` runs this file in a process of its own, because the libraries read the environment variables
that select instructions (`PLAIN`) when they are loaded, and compares the text with `pinned_results.json`. To pin new
values on purpose, after a change of a method that is meant to change results:

    python tests/pinned_results.py --write
"""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
import tempfile
from importlib.metadata import version
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
PINNED = HERE / "pinned_results.json"

PLAIN = {
    "SEATRUTH_CPU": "x86-64",
    "NPY_DISABLE_CPU_FEATURES": "",
    "OPENBLAS_CORETYPE": "PRESCOTT",
    "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX,-AVX2,-FMA,-FMA4,-AVX512F",
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
}
"""The first x86-64 instructions alone, which every processor of that family has: in our kernels, NumPy, OpenBLAS, libm.

With the newer ones (fused multiply-add, wider vectors) the last digits of a solver's result depend on the processor.
"""

LIBRARIES = ("numpy", "scipy", "pandas", "pymoo", "cma", "pyswarms", "scikit-learn", "llvmlite")
"""A new version of one of these may round differently; the values hold for the versions that are stored with them."""


def environment() -> dict[str, str]:
    """The variables of the process that computes the values."""
    paths = [str(HERE), str(HERE / "comparison"), *(path for path in sys.path if path)]
    plain = {**PLAIN, "NPY_DISABLE_CPU_FEATURES": " ".join(_numpy_features())}
    return {**os.environ, **plain, "PYTHONPATH": os.pathsep.join(paths)}


def versions() -> dict[str, str]:
    return {name: version(name) for name in LIBRARIES}


def computed() -> dict[str, Any]:
    """The values, computed in a process that uses plain instructions."""
    command = [sys.executable, str(Path(__file__)), "--print"]
    ended = subprocess.run(command, env=environment(), capture_output=True, text=True, check=False)
    if ended.returncode:
        raise RuntimeError(ended.stderr)
    values: dict[str, Any] = json.loads(ended.stdout.splitlines()[-1])
    return values


def _numpy_features() -> list[str]:
    """What NumPy would choose from on this processor, beyond its baseline."""
    import numpy as np

    found = np.show_config(mode="dicts")["SIMD Extensions"].get("found", [])
    return [str(name) for name in found]


def _pendulum() -> Any:
    """A study with a sine, an exponential and a root, so that their values are pinned as well."""
    import numpy as np

    from seatruth import Channel, Model, Parameter, Study, Trial, Trials

    class Pendulum(Model):
        name = "pendulum"
        title = "A damped pendulum"
        states = (Channel("q", "rad/s"), Channel("phi", "rad"))
        inputs = (Channel("moment", "N m"),)
        outputs = states
        parameters = (
            Parameter("stiffness", 1.5, "N m", 0.1, 9.0, vary=True, source="test"),
            Parameter("damping", 0.2, "N m s", 0.0, 3.0, vary=True, source="test"),
        )

        @staticmethod
        def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
            lift = p.stiffness * math.sin(s.phi) * math.exp(-0.1 * s.phi * s.phi)
            return i.moment - lift - p.damping * s.q * math.sqrt(1.0 + s.q * s.q), s.q

    t = 0.1 * np.arange(120.0)
    outputs = {"q": np.cos(1.3 * t) * np.exp(-0.1 * t), "phi": 0.8 * np.sin(1.3 * t) * np.exp(-0.1 * t)}
    trial = Trial("swing", t, {"moment": np.where(t < 4.0, 0.5, -0.25)}, outputs)
    return Study("pendulum", Pendulum(), Trials([trial]), noise={"q": 0.1, "phi": 0.1})


def identifications() -> dict[str, Any]:
    """Name -> the parameters with their uncertainty, the lowest cost and the number of evaluations."""
    import known_glide
    from small_comparison import line

    from seatruth import Budget, RegressionOptions, identify
    from seatruth.optimizers import make

    glide, regression = known_glide.study(), known_glide.study(cost=RegressionOptions())
    asked: dict[str, tuple[Any, Any, int]] = {
        "least_squares on a trajectory": (glide, "least_squares", 400),
        "least_squares with estimated noise": (known_glide.study(noise={}), "least_squares", 400),
        "least_squares on sine, exponential and root": (_pendulum(), "least_squares", 400),
        "newton on a trajectory": (glide, "newton", 400),
        "ls_svm on a regression": (regression, "ls_svm", 100),
        "differential_swarm on a trajectory": (glide, make("differential_swarm", particles=20), 300),
        "particle_swarm on a trajectory": (glide, make("particle_swarm", particles=20), 300),
        "genetic on a regression": (regression, make("genetic"), 300),
        "cma_es on a formula": (line(), make("cma_es"), 200),
    }
    results = {}
    for name, (study, optimizer, evaluations) in asked.items():
        estimate = identify(study, optimizer, budget=Budget(evaluations=evaluations), seed=7, threads=1)
        table = estimate.parameters
        results[name] = {
            "values": [_exact(value) for value in table["value"]],
            "stderr": [_exact(value) for value in table["stderr"]],
            "cost": _exact(estimate.outcome["value"]),
            "evaluations": int(estimate.outcome["evaluations"]),
            "code": estimate.outcome["code"],
        }
    return results


def comparison() -> list[list[str]]:
    """The runs of a comparison of two solvers, two noise levels and two seeds: a row of exact texts each."""
    from small_comparison import small

    from seatruth import compare
    from seatruth.optimizers import make

    solvers = {"local": make("least_squares"), "swarm": make("differential_swarm", particles=10)}
    with tempfile.TemporaryDirectory() as folder:
        results = compare(small(solvers=solvers, seeds=2), folder)
    runs = results.runs.sort_values(["solver", "level", "seed"])[list(COMPARED)]
    return [[_exact(cell) for cell in row] for row in runs.itertuples(index=False)]


COMPARED = ("solver", "level", "seed", "code", "evaluations", "diverged", "value", "best", "excess")
"""The columns of the comparison's runs that are pinned."""


def _exact(value: Any) -> str:
    return value.hex() if isinstance(value, float) else str(value)


if __name__ == "__main__":
    if "--print" in sys.argv:
        print(json.dumps({"identifications": identifications(), "comparison": comparison()}))
    elif "--write" in sys.argv:
        PINNED.write_text(json.dumps({"versions": versions(), **computed()}, indent=1) + "\n")
