"""`seatruth demo`: the whole job on trials that come with seatruth."""

from __future__ import annotations

from importlib.resources import as_file, files
from pathlib import Path
from typing import Annotated

import typer

from seatruth.commands import diagnose, identify
from seatruth.commands.common import JsonFile, Result, say
from seatruth.study import read_plan


def demo(
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder of the result.")] = Path("seatruth-demo"),
    threads: Annotated[
        int | None, typer.Option("--threads", min=1, help="Threads of the simulation [all cores].")
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress.")] = False,
    json_file: JsonFile = None,
) -> Result:
    """Run the whole job on trials that come with it."""
    with as_file(files("seatruth") / "sample") as folder:
        plan = read_plan(folder / "study.toml").but(folder=out)
        say(f"Identifying {plan.study.name}: {len(plan.study.trials)} synthetic trials that come with seatruth.\n")
        identified = identify.run(plan, threads=threads, fresh=True, quiet=quiet)
        if identified.exit_code:
            return identified
        say("\nThe same trials, and a model that knows of no current: what is the gap, and what causes it?\n")
        plan = read_plan(folder / "diagnose.toml").but(folder=out / "diagnosis")
        diagnosed = diagnose.run(plan, threads=threads, suggest=False, quiet=quiet)
    return Result({**identified.data, "diagnosis": diagnosed.data}, diagnosed.exit_code)
