"""`seatruth demo`: identifies and diagnoses the synthetic trials that come with seatruth."""

from __future__ import annotations

from importlib.resources import as_file, files
from pathlib import Path
from typing import Annotated

import typer

from seatruth.commands import diagnose, identify
from seatruth.commands.common import JsonFile, Result, say
from seatruth.commands.progress import load_study


def demo(
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder of the result.")] = Path("seatruth-demo"),
    threads: Annotated[
        int | None, typer.Option("--threads", min=1, help="Threads of the simulation [all cores].")
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress.")] = False,
    json_file: JsonFile = None,
) -> Result:
    """Identify and diagnose synthetic example trials."""
    with as_file(files("seatruth") / "sample") as folder:
        study = load_study(folder / "study.toml", quiet=quiet)
        say(f"Identifying {study.name}: {len(study.trials)} synthetic trials that come with seatruth.\n")
        identified = identify.run(study, out, threads=threads, fresh=True, quiet=quiet)
        if identified.exit_code:
            return identified
        say("\nThe same trials, and a model without a current: what is the gap, and what causes it?\n")
        study = load_study(folder / "diagnose.toml", quiet=quiet)
        diagnosed = diagnose.run(study, out / "diagnosis", threads=threads, suggest=False, quiet=quiet)
    return Result({**identified.data, "diagnosis": diagnosed.data}, diagnosed.exit_code)
