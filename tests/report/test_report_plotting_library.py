"""matplotlib is loaded without the settings of the working directory."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path


def test_settings_of_matplotlib_in_the_working_directory_are_not_read(tmp_path: Path) -> None:
    """A link to a device would be read without an end; this one would end the import with an error."""
    (tmp_path / "matplotlibrc").write_bytes(b"\xff\xfe font.size: 99")
    code = "import seatruth.report.plotting_library, os, sys; print(os.getcwd(), 'matplotlib' in sys.modules)"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False, env=environment
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == f"{tmp_path.resolve()} True"
