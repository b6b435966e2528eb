"""A user's own model from a Python file, "my_ship.py:MyShip": the only code that a study file can run."""

from __future__ import annotations

import ast
import hashlib
import linecache
import sys
import traceback
from pathlib import Path
from types import ModuleType
from typing import Any

from seatruth.errors import BadInput, PluginError, SeatruthError, nearest
from seatruth.models.base import Model


def is_file(use: str) -> bool:
    """Whether [model] use names a file rather than an installed model."""
    return ":" in use or use.endswith(".py") or "/" in use


def load(use: str, folder: Path) -> Any:
    """The class or object behind "file.py:Name"; BadInput if there is none, PluginError if the file raises."""
    path_text, _, name = use.rpartition(":") if ".py:" in use else (use, "", "")
    path = folder / path_text
    if path.suffix != ".py":
        raise BadInput(f"{use!r} names no Python file", do='Write it as "file.py:ClassName".')
    try:
        source = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        beside = [entry.name for entry in path.parent.glob("*.py")] if path.parent.is_dir() else []
        hint = nearest(path.name, beside)
        raise BadInput(f"there is no model file {path_text!r}", do=hint or "Paths are relative to the study.") from None
    except (OSError, UnicodeDecodeError, ValueError) as problem:
        raise BadInput(f"the model file {path_text!r} cannot be read ({problem})") from None
    known = _classes(source, path_text)
    if not name:
        raise BadInput(f"{use!r} names no class", do=f'Write it as "{path_text}:{(known or ["ClassName"])[0]}".')
    module = _run(source, path, path_text)
    found = getattr(module, name, None)
    if found is None:
        raise BadInput(f"{path_text} defines no {name!r}", do=nearest(name, known))
    return found


def instance(found: Any, use: str) -> Model:
    """A model from what the file defines: a Model class, a Model, or a function that makes one."""
    made = found
    if callable(found) and not isinstance(found, Model):
        try:
            made = found()
        except SeatruthError:
            raise
        except Exception as problem:
            raise PluginError(
                f"{use} raised {type(problem).__name__}: {problem}", do="Correct the model file."
            ) from None
    if not isinstance(made, Model):
        raise BadInput(f"{use} is no Model", do="Derive the class from seatruth.models.Model.")
    return made


def _classes(source: str, name: str) -> list[str]:
    """Classes and objects that the file defines at its top; BadInput for a file that is not Python."""
    try:
        tree = ast.parse(source, filename=name)
    except (SyntaxError, ValueError) as problem:
        line = getattr(problem, "lineno", None)
        raise BadInput(
            f"it is not valid Python ({getattr(problem, 'msg', problem)})",
            where=f"{name}, line {line}" if line else name,
            do="Correct the model file.",
        ) from None
    return [node.name for node in tree.body if isinstance(node, (ast.ClassDef, ast.FunctionDef))]


def _run(source: str, path: Path, name: str) -> ModuleType:
    """Runs the file as a module of its own.

    It is compiled from the text just read, never from a stored .pyc, so an edit within the clock's resolution counts;
    and it is found by `inspect`, from which the engine takes the equations.
    """
    full = path.resolve()
    module = ModuleType(f"seatruth_user_{path.stem}_{hashlib.sha256(str(full).encode()).hexdigest()[:12]}")
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
            do="Correct the model file.",
        ) from problem
    except SystemExit:
        raise PluginError("running it ended the program", where=name, do="A model file only defines a model.") from None
    return module
