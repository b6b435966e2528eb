"""matplotlib, loaded without the settings of the working directory.

matplotlib reads a file `matplotlibrc` of the working directory when it is imported. Beside a study from someone else
such a file could break the report or, as a link to a device, never end.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

_SETTINGS = "matplotlibrc"


def import_matplotlib() -> None:
    """Imports matplotlib; for that moment a working directory that holds a `matplotlibrc` is left."""
    if "matplotlib" in sys.modules or not os.path.lexists(_SETTINGS):
        return
    with _elsewhere():
        import matplotlib  # noqa: F401 - the import is what is wanted


@contextmanager
def _elsewhere() -> Iterator[None]:
    back = os.getcwd()
    os.chdir(sys.prefix)  # Python's own folder: it holds neither settings nor modules that an import could take up
    try:
        yield
    finally:
        os.chdir(back)
