"""`seatruth demo`: identifies and diagnoses the synthetic trials that come with seatruth."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from importlib.resources import as_file, files
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from seatruth.commands import diagnose, identify
from seatruth.commands.common import JsonFile, Result, say
from seatruth.commands.progress import load_study
from seatruth.simulate.threads import thread_count
from seatruth.workers import Workers

if TYPE_CHECKING:
    from seatruth.estimate import Estimate

_LONGEST_S = 600.0
"""s after which the process that identifies is given up. Chosen here [S]: it takes some seconds."""


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
        shown: list[Result] = []
        with _identification(folder, out, threads) as identified:

            def show_the_first() -> None:
                shown.append(identify.told(*identified()))
                say("\nThe same trials, and a model without a current: what is the gap, and what causes it?\n")

            diagnosed = diagnose.run(
                load_study(folder / "diagnose.toml", quiet=quiet),
                out / "diagnosis",
                threads=threads,
                suggest=False,
                quiet=quiet,
                before_shown=show_the_first,
            )
    (first,) = shown
    return Result({**first.data, "diagnosis": diagnosed.data}, first.exit_code or diagnosed.exit_code)


_Identified = tuple["Estimate", Path, Path | None]


@contextmanager
def _identification(folder: Path, out: Path, threads: int | None) -> Iterator[Callable[[], _Identified]]:
    """Identifies the sample beside what is done inside, in a process of its own; gives what waits for it.

    On one core, or where no process can be started, it is done here.
    """
    given = (str(folder), str(out))
    if thread_count(threads) == 1:
        done = _identified(*given)
        yield lambda: done
        return
    workers = Workers(_identified)
    with ThreadPoolExecutor(1) as waiting:
        begun = waiting.submit(workers.call, given, _LONGEST_S)

        def found() -> _Identified:
            answer = begun.result()
            result: _Identified = _identified(*given) if answer.failure else answer.value
            return result

        try:
            yield found
        finally:
            workers.close()


def _identified(folder: str, out: str) -> _Identified:
    """On one thread: the diagnosis beside it has more to compute."""
    study = load_study(Path(folder) / "study.toml", quiet=True)
    return identify.carried_out(study, Path(out), threads=1, fresh=True, quiet=True)
