"""Assembly to machine code, kept on disk under a hash of everything that decides it.

A file's name is the hash of the assembly itself, the compiler's version and the processor, so a changed model can
never meet the code of the old one; its content carries its own checksum, so a torn file is compiled again.
"""

from __future__ import annotations

import ctypes
import ctypes.util
import hashlib
import itertools
import os
import platform
import sys
import threading
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import llvmlite
import llvmlite.binding as llvm

from seatruth.errors import SeatruthError
from seatruth.simulate.compiler.vector_maths import LIBRARY
from seatruth.storage.atomic import CannotWrite, write_file

CACHE = "SEATRUTH_CACHE"
"""Environment variable: folder of the compiled kernels, or "off"."""
PROCESSOR = "SEATRUTH_CPU"
"""Environment variable: compile for this processor (LLVM's name, such as x86-64-v3) instead of the one found."""
_BY_COMPILER = ("fma", "floor", "ceil", "trunc", "sqrt", "fabs", "copysign")
"""What the compiler itself calls on processors that lack it."""
_KEPT = 400
_FORMAT = b"seatruth kernel 1\n"
_lock = threading.RLock()
_loaded: dict[str, Kernel] = {}
_ready = False
_linker: Any = None
_numbers = itertools.count()
_CLOSE = sys.platform in ("linux", "darwin")
"""Whether the linker keeps code and constants of a kernel close together."""


class Kernel:
    """One compiled function void(ptr); calling it leaves Python's lock, so threads run together."""

    def __init__(self, owner: Any, address: int) -> None:
        self._owner = owner  # of the code
        self._call = ctypes.CFUNCTYPE(None, ctypes.c_void_p)(address)

    def __call__(self, context: int) -> None:
        self._call(context)


def kernel(text: str) -> Kernel:
    """The function `kernel` of a module's assembly, from memory, from disk, or compiled now."""
    with _lock:
        key = _key(text)
        found = _loaded.get(key)
        if found is None:
            found = _loaded[key] = _load(key, _object(key, text))
        return found


def processor() -> tuple[str, str]:
    """LLVM's name and features of the processor that is compiled for."""
    return _processor(os.environ.get(PROCESSOR, ""))


@cache
def _processor(chosen: str) -> tuple[str, str]:
    _start()
    if chosen:
        # A name that LLVM does not know then means a plain 64-bit processor, not a crash.
        return chosen, _plainest()
    try:
        return str(llvm.get_host_cpu_name()), str(llvm.get_host_cpu_features().flatten())
    except (RuntimeError, OSError):
        return "", _plainest()  # LLVM does not know this machine


def _plainest() -> str:
    """What every processor of this family has."""
    return "+64bit,+sse2,+cx8" if platform.machine().lower() in ("x86_64", "amd64") else ""


def vector_bytes() -> int:
    """Size of the processor's vectors, as far as LLVM says."""
    return _vector_bytes(*processor())


@cache
def _vector_bytes(name: str, features: str) -> int:
    if "+avx512f" in features or "avx512" in name or name.endswith("v4"):
        return 64
    return 32 if "+avx2" in features or name.endswith("v3") else 16


def folder() -> Path | None:
    """Where compiled kernels are kept; None where they are not."""
    given = os.environ.get(CACHE)
    if given is not None:
        return None if given.strip().lower() in ("", "off", "0") else Path(given)
    base = os.environ.get("XDG_CACHE_HOME") or (os.environ.get("LOCALAPPDATA") if os.name == "nt" else None)
    try:
        return (Path(base) if base else Path.home() / ".cache") / "seatruth"
    except RuntimeError:
        return None


def _start() -> None:
    global _ready
    with _lock:
        if not _ready:
            llvm.initialize_native_target()
            llvm.initialize_native_asmprinter()
            _ready = True


def _machine() -> Any:
    name, features = processor()
    target = llvm.Target.from_default_triple()
    # Code and constants close together: a constant is then an operand, not an address to be loaded first.
    reloc, model = ("pic", "small") if _CLOSE else ("default", "jitdefault")
    return target.create_target_machine(cpu=name, features=features, opt=3, reloc=reloc, codemodel=model, jit=True)


def _library() -> dict[str, int]:
    """Addresses of the C library's functions."""
    library = ctypes.CDLL(ctypes.util.find_library("m") if os.name != "nt" else "ucrtbase")
    found = {name: ctypes.cast(getattr(library, name), ctypes.c_void_p).value for name in (*LIBRARY, *_BY_COMPILER)}
    return {name: address for name, address in found.items() if address is not None}


def _key(text: str) -> str:
    parts = (llvmlite.__version__, repr(llvm.llvm_version_info), *processor(), text)
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()


def _object(key: str, text: str) -> bytes:
    place = folder()
    path = place / f"{key}.kernel" if place else None
    kept = _read(path) if path else None
    if kept is not None:
        return kept
    code = _compile(text)
    if path:
        # A full disk or a read-only home costs the next process a second, nothing else.
        with suppress(CannotWrite):
            _write(path, code)
    return code


def _compile(text: str) -> bytes:
    machine = _machine()
    module = llvm.parse_assembly(text)
    module.triple = llvm.get_process_triple()
    module.data_layout = str(machine.target_data)
    module.verify()
    options = llvm.create_pipeline_tuning_options(speed_level=2)
    options.loop_vectorization = False
    options.slp_vectorization = False
    builder = llvm.create_pass_builder(machine, options)
    builder.getModulePassManager().run(module, builder)
    return bytes(machine.emit_object(module))


def _load(key: str, code: bytes) -> Kernel:
    global _linker
    if _linker is None:
        _linker = llvm.create_lljit_compiler(_machine(), use_jit_link=_CLOSE)
    builder = llvm.JITLibraryBuilder().add_object_img(code).export_symbol("kernel")
    for name, address in _library().items():
        builder.import_symbol(name, address)
    try:
        library = builder.link(_linker, f"{key}-{next(_numbers)}")
    except RuntimeError as problem:
        raise SeatruthError(
            f"the compiled equations cannot be loaded on this machine ({processor()[0] or 'unknown processor'}): "
            f"{' '.join(str(problem).split())[:200]}",
            do=f"Set {PROCESSOR} to a plainer processor, such as x86-64, and report this.",
        ) from None
    return Kernel(library, library["kernel"])


def _read(path: Path) -> bytes | None:
    try:
        data = path.read_bytes()
    except OSError:
        return None
    head, code = data[: len(_FORMAT) + 32], data[len(_FORMAT) + 32 :]
    if head != _FORMAT + hashlib.sha256(code).digest():
        return None
    with suppress(OSError):
        os.utime(path)
    return code


def _write(path: Path, code: bytes) -> None:
    # Not durable: a damaged kernel is noticed by its checksum and compiled again.
    write_file(path, _FORMAT + hashlib.sha256(code).digest() + code, mode=0o600, durable=False)
    _trim(path.parent)


def _trim(place: Path) -> None:
    """Keeps the kernels used last."""
    ages = []
    for path in place.glob("*.kernel"):
        with suppress(OSError):
            ages.append((path.stat().st_mtime, path))
    for _, path in sorted(ages)[: max(0, len(ages) - _KEPT)]:
        with suppress(OSError):
            path.unlink()
