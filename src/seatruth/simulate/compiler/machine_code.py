"""LLVM IR to machine code, kept on disk under a hash of everything that decides it.

A kernel's key is the hash of the IR itself, the compiler's version and the processor, so a changed model never runs
the code of the old one.
"""

from __future__ import annotations

import ctypes
import ctypes.util
import functools
import hashlib
import itertools
import os
import platform
import sys
import threading
from contextlib import suppress
from typing import Any

import llvmlite
import llvmlite.binding as llvm

from seatruth.errors import SeatruthError
from seatruth.simulate.compiler import cache
from seatruth.simulate.compiler.vector_math import LIBRARY
from seatruth.storage.atomic import CannotWrite

PROCESSOR = "SEATRUTH_CPU"
"""Environment variable: compile for this processor (LLVM's name, such as x86-64-v3) instead of this machine's own."""
_BY_COMPILER = ("fma", "floor", "ceil", "trunc", "sqrt", "fabs", "copysign")
"""Functions of the C library that LLVM itself calls on processors that lack the instruction."""
_lock = threading.RLock()
_loaded: dict[str, Kernel] = {}
_initialised = False
_linker: Any = None
_link_numbers = itertools.count()
_SMALL_CODE = sys.platform in ("linux", "darwin")
"""Whether LLVM's linker on this system (JITLink) places code and constants of a kernel close together."""


class Kernel:
    """One compiled function void(ptr). A call releases Python's global lock, so threads run in parallel."""

    def __init__(self, owner: Any, address: int) -> None:
        self._owner = owner  # keeps the machine code in memory
        self._call = ctypes.CFUNCTYPE(None, ctypes.c_void_p)(address)

    def __call__(self, context: int) -> None:
        self._call(context)


def kernel(text: str) -> Kernel:
    """The function `kernel` of a module in LLVM IR: from memory, from disk, or compiled now.

    Raises SeatruthError where the machine code cannot be loaded on this machine.
    """
    with _lock:
        key = _key(text)
        if key not in _loaded:
            _loaded[key] = _load(key, _object_code(key, text))
        return _loaded[key]


def processor() -> tuple[str, str]:
    """LLVM's name and features of the processor for which kernels are compiled."""
    return _processor(os.environ.get(PROCESSOR, ""))


@functools.cache
def _processor(chosen: str) -> tuple[str, str]:
    _initialise()
    if chosen:
        # A name that LLVM does not know then means a plain 64-bit processor, not a crash.
        return chosen, _baseline_features()
    try:
        return str(llvm.get_host_cpu_name()), str(llvm.get_host_cpu_features().flatten())
    except (RuntimeError, OSError):
        return "", _baseline_features()  # LLVM does not know this machine


def _baseline_features() -> str:
    """Features that every processor of this family has."""
    return "+64bit,+sse2,+cx8" if platform.machine().lower() in ("x86_64", "amd64") else ""


def vector_bytes() -> int:
    """Bytes of the processor's widest vectors, as far as LLVM reports them: 16, 32 or 64."""
    return _vector_bytes(*processor())


@functools.cache
def _vector_bytes(name: str, features: str) -> int:
    if "+avx512f" in features or "avx512" in name or name.endswith("v4"):
        return 64
    return 32 if "+avx2" in features or name.endswith("v3") else 16


def _initialise() -> None:
    global _initialised
    with _lock:
        if not _initialised:
            llvm.initialize_native_target()
            llvm.initialize_native_asmprinter()
            _initialised = True


def _machine() -> Any:
    name, features = processor()
    target = llvm.Target.from_default_triple()
    # Code and constants close together: a constant is then an operand, not an address to be loaded first.
    reloc, model = ("pic", "small") if _SMALL_CODE else ("default", "jitdefault")
    return target.create_target_machine(cpu=name, features=features, opt=3, reloc=reloc, codemodel=model, jit=True)


def _library() -> dict[str, int]:
    """Addresses of the C library's functions that a kernel may call."""
    library = ctypes.CDLL(ctypes.util.find_library("m") if os.name != "nt" else "ucrtbase")
    addresses = {name: ctypes.cast(getattr(library, name), ctypes.c_void_p).value for name in (*LIBRARY, *_BY_COMPILER)}
    return {name: address for name, address in addresses.items() if address is not None}


def _key(text: str) -> str:
    parts = (llvmlite.__version__, repr(llvm.llvm_version_info), *processor(), text)
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()


def _object_code(key: str, text: str) -> bytes:
    folder = cache.folder()
    path = folder / f"{key}.kernel" if folder else None
    cached = cache.read(path) if path else None
    if cached is not None:
        return cached
    code = _compile(text)
    if path:
        # A full disk or a read-only home costs the next process a second, nothing else.
        with suppress(CannotWrite):
            cache.write(path, code)
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
        _linker = llvm.create_lljit_compiler(_machine(), use_jit_link=_SMALL_CODE)
    builder = llvm.JITLibraryBuilder().add_object_img(code).export_symbol("kernel")
    for name, address in _library().items():
        builder.import_symbol(name, address)
    try:
        library = builder.link(_linker, f"{key}-{next(_link_numbers)}")
    except RuntimeError as problem:
        raise SeatruthError(
            f"the compiled equations cannot be loaded on this machine ({processor()[0] or 'unknown processor'}): "
            f"{' '.join(str(problem).split())[:200]}",
            do=f"Set {PROCESSOR} to a plainer processor, such as x86-64, and report this.",
        ) from None
    return Kernel(library, library["kernel"])
