"""Reads a MATLAB file in a process of its own: scipy's reader can crash the interpreter on a damaged file.

Run as a script by binary_files.matlab: the file's bytes come in on stdin, its vectors go out on stdout as an .npz whose
arrays are named by position, with the names as the first of them. It imports nothing of seatruth, so that it starts
fast. Exit code 3 and one line on stderr mean that scipy refused the file.
"""

from __future__ import annotations

import io
import sys
from collections.abc import Mapping
from typing import Any

import numpy as np

REFUSED = 3
_BESIDE_THE_FILE = 4 * 2**30


def main() -> int:
    """Reads stdin, writes stdout; the exit code says how it went."""
    data = sys.stdin.buffer.read()
    _limit_memory(_BESIDE_THE_FILE + 40 * len(data))
    import scipy.io

    try:
        stream: Any = io.BytesIO(data)
        content = scipy.io.loadmat(stream, simplify_cells=True)
        arrays = vectors({name: value for name, value in content.items() if not name.startswith("__")})
    except Exception as problem:  # scipy raises many kinds for a damaged file
        text = str(problem).strip().splitlines()
        sys.stderr.write(text[0][:200] if text else type(problem).__name__)
        return REFUSED
    out = io.BytesIO()
    names = np.array([name for name, _ in arrays], dtype=np.str_)
    np.savez(out, names, *[values for _, values in arrays])
    sys.stdout.buffer.write(out.getvalue())
    return 0


def vectors(content: Mapping[str, Any], prefix: str = "", depth: int = 0) -> list[tuple[str, Any]]:
    """All vectors in nested structs, as ("struct.field", values); a matrix gives one vector a column."""
    arrays: list[tuple[str, Any]] = []
    for name, value in content.items():
        full = f"{prefix}{name}"
        if isinstance(value, Mapping) and depth < 8:
            arrays += vectors(value, f"{full}.", depth + 1)
        elif isinstance(value, np.ndarray) and value.dtype.kind in "buif" and value.size:
            native = value.astype(value.dtype.newbyteorder("="))
            if native.ndim == 1 or (native.ndim == 2 and min(native.shape) == 1):
                arrays.append((full, native.ravel()))
            elif native.ndim == 2:
                arrays += [(f"{full}({k + 1})", native[:, k]) for k in range(native.shape[1])]
    return arrays


def _limit_memory(most: int) -> None:
    """A damaged size field must not take the machine's memory; not every system can limit it."""
    try:
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (most, most))
    except (ImportError, OSError, ValueError):
        return


if __name__ == "__main__":
    sys.exit(main())
