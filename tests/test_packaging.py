"""What is shipped: a whole and light wheel, its version in one place, known versions and licences of what it needs."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import sysconfig
import zipfile
from contextlib import suppress
from importlib.metadata import Distribution, PackageNotFoundError, distribution, version
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet
from packaging.utils import canonicalize_name

import seatruth

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tools"))
import licences  # noqa: E402  (the folder of tools is no package)
import lowest_versions  # noqa: E402
import pins  # noqa: E402

PROJECT = pins.PROJECT
PINNED: dict[str, str] = {canonicalize_name(pin.name): pins.exact(pin) for pin in pins.pins()}
PIP = [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check"]


def require_pinned() -> None:
    """Skips a test of constraints.txt where its versions are not installed: the lowest or the newest ones are."""
    if others := pins.other_versions(PINNED):
        pytest.skip(f"direct dependencies of other versions than those of constraints.txt: {', '.join(others)}")


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    command = [*PIP, "wheel", "--no-deps", "--no-build-isolation", "--wheel-dir", str(folder), str(ROOT)]
    subprocess.run(command, check=True, capture_output=True)
    (built,) = folder.glob("*.whl")
    return built


def test_the_version_stands_in_one_place() -> None:
    own = PROJECT["project"]["version"]
    assert seatruth.__version__ == own
    assert f"\nversion: {own}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    released = re.search(
        r"^## \[(\d[^]]*)\] - (\S+)$", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE
    )
    assert released is not None
    assert released[1] == own
    assert f"\ndate-released: {released[2]}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")


def test_a_plain_install_needs_no_compiler_and_no_heavy_framework() -> None:
    needed = licences.closure(PROJECT["project"]["dependencies"])
    assert "numpy" in needed
    assert not needed & {
        "jax",
        "jaxlib",
        "casadi",
        "numba",
        "torch",
        "tensorflow",
        "cython",
        "pythran",
        "dask",
        "sphinx",
    }


def test_the_table_of_licences_names_every_package_and_permits_each() -> None:
    require_pinned()
    assert licences.TABLE.read_text(encoding="utf-8") == licences.table(), "run: python tools/licences.py --write"


def test_a_package_that_is_not_installed_here_keeps_its_licence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def found(name: str) -> Distribution:
        if name in ("backports.zstd", "derivative", "pysindy", "colorama", "appnope"):
            raise PackageNotFoundError(name)
        return distribution(name)

    require_pinned()
    monkeypatch.setattr(licences, "distribution", found)
    assert licences.table() == licences.TABLE.read_text(encoding="utf-8")
    monkeypatch.setattr(licences, "TABLE", tmp_path / "new.md")
    with pytest.raises(
        licences.Unknown, match=r"^backports.zstd: it is not installed here\nderivative: .*\npysindy: .*"
    ):
        licences.table()


def test_each_dependency_promises_a_lowest_version() -> None:
    pins = lowest_versions.lowest(PROJECT["project"]["dependencies"])
    assert len(pins) == len(PROJECT["project"]["dependencies"])
    assert all(re.fullmatch(r"[\w.-]+==[\d.]+", pin) for pin in pins)
    with pytest.raises(ValueError, match="no lower bound"):
        lowest_versions.lowest(["numpy"])


def test_a_licence_that_nobody_has_read_is_refused() -> None:
    assert licences.parts("MIT AND (Apache-2.0 OR GPL-3.0-only)") == ["MIT", "Apache-2.0", "GPL-3.0-only"]
    assert "GPL-3.0-only" not in licences.COMPATIBLE


def test_the_wheel_holds_every_file_of_both_packages(wheel: Path) -> None:
    packed = set(zipfile.ZipFile(wheel).namelist())
    for package in (ROOT / "src" / "seatruth", ROOT / "optimizers" / "seatruth_optimizers"):
        wanted = {
            path.relative_to(package.parent).as_posix()
            for path in package.rglob("*")
            if path.is_file()
            and path.suffix in (".py", ".typed", ".csv", ".toml", ".json", ".md", ".html", ".css", ".js")
        }
        assert wanted <= packed, wanted - packed
    assert not [name for name in packed if name.startswith(("tests/", "experiments/", "docs/", "tools/"))]
    assert [name for name in packed if name.endswith(".dist-info/licenses/LICENSE")]


@pytest.mark.slow
def test_the_wheel_works_outside_the_repository(wheel: Path, tmp_path: Path) -> None:
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(tmp_path / "own")], check=True)
    binaries = tmp_path / "own" / ("Scripts" if os.name == "nt" else "bin")
    python = binaries / ("python.exe" if os.name == "nt" else "python")
    # Dependencies come from the packages that are installed here; seatruth itself from the wheel, which stands first.
    libraries = Path(
        subprocess.check_output(
            [python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))"], text=True
        ).strip()
    )
    (libraries / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n", encoding="utf-8")
    subprocess.run([*PIP, "--python", str(python), "install", "--no-deps", "--no-index", str(wheel)], check=True)

    def run(*arguments: str) -> str:
        environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
        return subprocess.run(
            [str(binaries / "seatruth"), *arguments],
            cwd=tmp_path,
            env=environment,
            check=True,
            capture_output=True,
            text=True,
        ).stdout

    where = "import seatruth, seatruth.sample, seatruth_optimizers as solvers; seatruth.sample.copy_to('.')"
    where += "; print(seatruth.__file__, solvers.__file__)"
    found = subprocess.check_output([str(python), "-I", "-c", where], cwd=tmp_path, text=True).split()
    assert all(Path(path).is_relative_to(libraries) for path in found), found
    assert run("--version").strip() == f"seatruth {seatruth.__version__}"
    assert "cma_es" in run("list", "optimizers")
    run("identify", "study.toml", "--evaluations", "60", "--quiet", "--out", "result")
    assert (tmp_path / "result" / "report.html").stat().st_size > 10_000


@pytest.mark.parametrize("system", pins.SYSTEMS)
def test_every_package_that_is_installed_has_an_exact_version(system: str) -> None:
    require_pinned()
    around = pins.SYSTEMS[system]
    pinned = {
        canonicalize_name(pin.name): pins.exact(pin)
        for pin in pins.pins()
        if pin.marker is None or pin.marker.evaluate(around)
    }
    missing = set()
    for requirement in pins.needed(pins.direct(), around):
        exact = pinned.get(canonicalize_name(requirement.name))
        if exact is None:
            missing.add(str(requirement))
        elif requirement.specifier and not requirement.specifier.contains(exact):
            missing.add(f"{requirement}, not {exact}")
    assert not missing, f"add to constraints.txt: {missing}"


def test_only_other_versions_of_direct_dependencies_are_a_reason_to_skip() -> None:
    here = {canonicalize_name(Requirement(text).name) for text in pins.direct()}
    installed = {}
    for name in here:
        with suppress(PackageNotFoundError):
            installed[name] = version(name)
    assert pins.other_versions(installed) == []
    assert pins.other_versions({}) == []
    assert pins.other_versions({**installed, "numpy": "1.0"}) == [f"numpy {installed['numpy']}"]
    with pytest.raises(ValueError, match="no exact version"):
        pins.exact(Requirement("numpy==2.*"))


def test_every_pinned_version_works_with_the_least_python() -> None:
    """With Python 3.11.2, as Debian 12 has it, nothing could be installed: one pin asked for 3.11.5."""
    require_pinned()
    least = PROJECT["project"]["requires-python"].removeprefix(">=")
    later = {}
    for name, exact in PINNED.items():
        with suppress(PackageNotFoundError):
            found = distribution(name)
            asked = ",".join(found.metadata.get_all("Requires-Python") or [])
            if found.version == exact and asked and not SpecifierSet(asked).contains(f"{least}.0"):
                later[name] = asked
    assert not later, f"pin an older version in constraints.txt: {later}"
