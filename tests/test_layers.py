"""The direction of imports, and what `import seatruth` costs and gives."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterable, Iterator, Mapping
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


def test_no_circle_of_imports() -> None:
    """Not even through imports inside functions. Imports for type checkers alone do not count: they never run."""
    packages = {
        "seatruth": ROOT / "src" / "seatruth",
        "seatruth_optimizers": ROOT / "optimizers" / "seatruth_optimizers",
    }
    circles = circles_of(import_graph(packages))
    assert not circles, "modules that import each other:\n" + "\n".join(" <-> ".join(circle) for circle in circles)


def test_circles_are_found(tmp_path: Path) -> None:
    files = {
        "__init__.py": "from pack.a import f",
        "a.py": "def f():\n    from pack import b",
        "b.py": "import pack.sub.c",
        "sub/__init__.py": "",
        "sub/c.py": "class C:\n    def g(self):\n        from ..a import f",
        "d.py": "if TYPE_CHECKING:\n    from pack.e import E\nelse:\n    import pack.a",
        "e.py": "import pack.d\nfrom importlib import import_module",
    }
    for name, text in files.items():
        (tmp_path / "pack" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "pack" / name).write_text(text)
    graph = import_graph({"pack": tmp_path / "pack"})
    assert graph["pack.d"] == {"pack.a"}
    assert graph["pack.e"] == {"pack.d"}
    assert circles_of(graph) == [["pack.a", "pack.b", "pack.sub.c"]]


def import_graph(packages: Mapping[str, Path]) -> dict[str, set[str]]:
    """The modules that each module of these packages imports when it, or any of its functions, runs.

    `from package import name` counts as an import of the module `package.name` if there is one, and otherwise of
    `package`. That a module's import also runs the packages around it does not count: it holds for each module of a
    package whose __init__ imports from it.
    """
    files = {
        ".".join([name, *path.relative_to(folder).with_suffix("").parts]).removesuffix(".__init__"): path
        for name, folder in packages.items()
        for path in sorted(folder.rglob("*.py"))
    }
    graph: dict[str, set[str]] = {}
    for module, path in files.items():
        package = module if path.name == "__init__.py" else module.rpartition(".")[0]
        targets: set[str] = set()
        for node in run_time_nodes(ast.parse(path.read_text(encoding="utf-8"))):
            targets.update(imported(node, package, files))
        graph[module] = targets - {module}
    return graph


def run_time_nodes(node: ast.AST) -> Iterator[ast.AST]:
    """All nodes of a syntax tree but those under `if TYPE_CHECKING`."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.If) and "TYPE_CHECKING" in ast.unparse(child.test):
            for other in child.orelse:
                yield other
                yield from run_time_nodes(other)
            continue
        yield child
        yield from run_time_nodes(child)


def imported(node: ast.AST, package: str, modules: Iterable[str]) -> Iterator[str]:
    """Modules of ours that one statement imports."""
    if isinstance(node, ast.Import):
        yield from (alias.name for alias in node.names if alias.name in modules)
    if isinstance(node, ast.ImportFrom):
        above = package.split(".")[: len(package.split(".")) - node.level + 1] if node.level else []
        base = ".".join([*above, *([node.module] if node.module else [])])
        for alias in node.names:
            if f"{base}.{alias.name}" in modules:
                yield f"{base}.{alias.name}"
            elif base in modules:
                yield base


def circles_of(graph: Mapping[str, set[str]]) -> list[list[str]]:
    """Strongly connected components of two modules or more (Tarjan 1972), each sorted."""
    index: dict[str, int] = {}
    lowest: dict[str, int] = {}
    stack: list[str] = []
    circles: list[list[str]] = []

    def visit(module: str) -> None:
        index[module] = lowest[module] = len(index)
        stack.append(module)
        for target in sorted(graph[module]):
            if target not in index:
                visit(target)
                lowest[module] = min(lowest[module], lowest[target])
            elif target in stack:
                lowest[module] = min(lowest[module], index[target])
        if lowest[module] == index[module]:
            first = stack.index(module)
            component = sorted(stack[first:])
            del stack[first:]
            if len(component) > 1:
                circles.append(component)

    for module in graph:
        if module not in index:
            visit(module)
    return circles


def test_importing_seatruth_is_quick() -> None:
    """It loads the standard library's modules alone, and few of its own."""
    own, others = python(
        "import sys; before = set(sys.modules); import seatruth; new = set(sys.modules) - before;"
        "own = [m for m in new if m.partition('.')[0] == 'seatruth'];"
        "others = [m for m in new if m.partition('.')[0] not in {*sys.stdlib_module_names, 'seatruth'}];"
        "print(len(own), others, sep=';')"
    ).split(";")
    assert int(own) <= 3
    assert others == "[]"


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
