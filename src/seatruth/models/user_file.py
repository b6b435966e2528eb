"""A user's own model or effect from a Python file, "my_ship.py:MyShip"."""

from __future__ import annotations

import ast
import hashlib
import linecache
import sys
import traceback
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType, ModuleType
from typing import Any

from seatruth.errors import BadInput, PluginError, SeatruthError, nearest
from seatruth.storage.regular import check_name, read_regular

_LARGEST = 4_000_000
"""Bytes; a model is written by hand, so anything larger is another kind of file."""


_OWN = "seatruth_user_"
"""How the names of the modules begin that are made of a user's files."""
_IMPORTS: Mapping[str, str] = MappingProxyType({"math": "import math", "np": "import numpy as np"})
"""What brings a name into a file that equations are often written with."""


def is_file(spec: str) -> bool:
    """Whether a model or effect is named by its file rather than by its installed name."""
    return ":" in spec or spec.endswith(".py") or "/" in spec


def load_object(spec: str, folder: Path, kind: str = "model") -> Any:
    """The class or object behind "file.py:Name", relative to `folder`; runs that file and no other.

    BadInput if there is no such file or name or it is not Python, PluginError if running it raises; both name the
    line. `kind` says in them what the file should define.
    """
    path_text, _, name = spec.rpartition(":") if ".py:" in spec else (spec, "", "")
    path = folder / path_text
    if path.suffix != ".py":
        raise BadInput(f"{spec!r} names no Python file", do='Write it as "file.py:ClassName".')
    try:
        source = read_regular(path, _LARGEST).decode("utf-8-sig")
    except FileNotFoundError:
        beside = [entry.name for entry in path.parent.glob("*.py")] if path.parent.is_dir() else []
        raise BadInput(
            f"there is no {kind} file {path_text!r}", do=nearest(path.name, beside) or f"Looked in {folder}."
        ) from None
    except BadInput as problem:
        raise BadInput(f"the {kind} file {path_text!r} cannot be read: {problem.what}", do=problem.do) from None
    except (OSError, UnicodeDecodeError) as problem:
        raise BadInput(f"the {kind} file {path_text!r} cannot be read ({problem})") from None
    known = _defined(source, path_text, kind)
    if not name:
        raise BadInput(f"{spec!r} names no class", do=f'Write it as "{path_text}:{(known or ["ClassName"])[0]}".')
    module = _run(source, path, path_text, kind)
    result = getattr(module, name, None)
    if result is None:
        classes = [one for one in known if isinstance(getattr(module, one, None), type)]
        raise BadInput(f"{path_text} defines no {name!r}", do=nearest(name, classes or known))
    return result


def _defined(source: str, name: str, kind: str) -> list[str]:
    """What the file defines at its top level; BadInput for a file that is not Python."""
    try:
        tree = ast.parse(source, filename=name)
    except (SyntaxError, ValueError, RecursionError, MemoryError) as problem:
        line = getattr(problem, "lineno", None)
        raise BadInput(
            f"it is not valid Python ({getattr(problem, 'msg', problem)})",
            where=f"{name}, line {line}" if line else name,
            do=f"Correct the {kind} file.",
        ) from None
    defined = [node.name for node in tree.body if isinstance(node, (ast.ClassDef, ast.FunctionDef))]
    for node in tree.body:
        if isinstance(node, ast.Assign):
            defined += [target.id for target in node.targets if isinstance(target, ast.Name)]
    return defined


def _run(source: str, path: Path, name: str, kind: str) -> ModuleType:
    """Runs the file as a module of its own.

    It is compiled from the text just read, never from a stored .pyc, so an edit within the clock's resolution counts;
    and it is found by `inspect`, from which the engine takes the equations.
    """
    full = path.resolve()
    check_name(full.as_posix())
    module = ModuleType(f"{_OWN}{path.stem}_{hashlib.sha256(str(full).encode()).hexdigest()[:12]}")
    module.__file__ = str(full)
    linecache.checkcache(str(full))
    sys.modules[module.__name__] = module
    try:
        exec(compile(source, str(full), "exec"), module.__dict__)
    except SeatruthError:
        raise
    except Exception as problem:
        frames = [frame for frame in traceback.extract_tb(problem.__traceback__) if frame.filename == str(full)]
        line = frames[-1].lineno if frames else None
        raise PluginError(
            f"running it raised {type(problem).__name__}: {problem}",
            where=f"{name}, line {line}" if line else name,
            do=f"Correct the {kind} file.",
        ) from problem
    except SystemExit:
        raise PluginError("running it ended the program", where=name, do=f"Its file only defines a {kind}.") from None
    return module


def place_in_user_file(problem: BaseException) -> str:
    """File and line of what a user's own code raised, "my_ship.py, line 12"; "" where other code raised it."""
    frames = traceback.extract_tb(problem.__traceback__)
    own = {getattr(module, "__file__", None) for name, module in [*sys.modules.items()] if name.startswith(_OWN)}
    if not frames or frames[-1].filename not in own:
        return ""
    return f"{Path(frames[-1].filename).name}, line {frames[-1].lineno}"


def name_missing(problem: NameError) -> str:
    """What to do about a name that a file uses and does not have.

    Example:
        >>> name_missing(NameError("name 'math' is not defined", name="math"))
        'Write "import math" at the top of the file.'
    """
    line = _IMPORTS.get(problem.name or "")
    return f'Write "{line}" at the top of the file.' if line else "Define or import it in the model file."
