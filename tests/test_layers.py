"""The direction of imports, and what `import seatruth` costs and gives."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import seatruth

ROOT = Path(__file__).parents[1]


def python(code: str) -> str:
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return done.stdout.strip()


def test_imports_point_one_way() -> None:
    code = "import sys; from importlinter.cli import lint_imports; sys.exit(lint_imports(no_cache=True))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0, done.stdout
    assert "0 broken" in done.stdout


def test_importing_seatruth_loads_nothing_heavy_and_is_quick() -> None:
    heavy = "('numpy', 'scipy', 'pandas', 'llvmlite', 'numba', 'matplotlib', 'pydantic', 'typer')"
    loaded, seconds = python(
        "import sys, time; begun = time.perf_counter(); import seatruth; took = time.perf_counter() - begun;"
        f"print([m for m in {heavy} if m in sys.modules], took, sep=';')"
    ).split(";")
    assert loaded == "[]"
    assert float(seconds) < 0.1


def test_every_public_name_is_there_and_listed() -> None:
    for name in seatruth.__all__:
        assert getattr(seatruth, name) is not None
        assert name in dir(seatruth)
    assert python("from seatruth import *; print(identify.__name__, Study.__name__)") == "identify Study"


def test_static_types_and_loaded_names_are_the_same() -> None:
    """What a type checker sees under TYPE_CHECKING is what is loaded at run time."""
    source = Path(seatruth.__file__).read_text()
    block = source[source.index("if TYPE_CHECKING:") : source.index("__all__")]
    seen: dict[str, object] = {}
    exec("\n".join(line.strip() for line in block.splitlines()[1:] if "import" in line), seen)
    names = {name for name in seen if not name.startswith("__")}
    assert names == set(seatruth.__all__) - {"__version__"}
    assert all(getattr(seatruth, name) is seen[name] for name in names)


def test_a_name_that_is_not_there_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'identfy'"):
        seatruth.identfy  # noqa: B018


def test_the_command_line_starts_without_the_engine() -> None:
    loaded = python(
        "import sys, seatruth.cli; print([m for m in ('llvmlite', 'seatruth.simulate') if m in sys.modules])"
    )
    assert loaded == "[]"
