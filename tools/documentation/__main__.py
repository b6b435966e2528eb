"""Makes the documentation site: `python tools/documentation [html|linkcheck]` writes build/docs (or build/links).

The pages of docs/ and of the repository's top folder are put together with pages that are written from the code, in
build/site; Sphinx makes the site from there, runs the tutorials, and takes every warning for an error. A tutorial whose
figure is not shown is an error too. Further arguments go to Sphinx: `html -D nb_execution_mode=off` leaves the
tutorials as they are.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]


def main(arguments: list[str]) -> int:
    """Assembles the pages and builds them; the exit code of Sphinx."""
    from assemble import assemble
    from built import lacking
    from sphinx.cmd.build import main as sphinx

    builder, *more = arguments or ["html"]
    source = ROOT / "build" / "site"
    # Tutorials call `seatruth`; small matrices need no threads.
    os.environ["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', '')}"
    os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1", COLUMNS="100")
    assemble(ROOT, source)
    target = ROOT / "build" / ("links" if builder == "linkcheck" else "docs")
    strict = [] if builder == "linkcheck" else ["--fail-on-warning", "--keep-going"]
    trees = ["--doctree-dir", f"{target}-trees"]
    jobs = ["--jobs", "auto"]  # pages side by side, on all cores, and so the tutorials
    code = int(sphinx(["--builder", builder, *strict, "--quiet", *jobs, *trees, *more, str(source), str(target)]))
    faults = lacking(target) if builder == "html" and "nb_execution_mode=off" not in more else []
    sys.stderr.writelines(f"tutorials, {fault}\n" for fault in faults)
    return code or int(bool(faults))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
