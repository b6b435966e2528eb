"""The diagnosing process: given public folders, it writes verdicts. It runs where nothing sealed can be reached.

    python blind.py PROGRAM OUT CASE [CASE ...] --deny FOLDER [FOLDER ...]

`diagnose` starts it in a mount namespace where the denied folders are empty (where the system allows that), and here an
audit hook refuses every opening of a file or folder in them, as a second lock or as the only one. Before anything
else it tries to look into each, and ends if it can.
"""

from __future__ import annotations

import json
import os
import sys
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

WATCHED = (
    "open",
    "os.listdir",
    "os.scandir",
    "os.chmod",
    "os.rename",
    "os.link",
    "os.symlink",
    "os.mkdir",
    "os.remove",
)


class Refused(PermissionError):
    """Something sealed was asked for."""


def refuse(denied: Sequence[Path]) -> None:
    """From now on, whatever lies in these folders is refused to this process, under any name."""
    roots = [os.path.realpath(folder) for folder in denied]

    def hook(event: str, arguments: tuple[Any, ...]) -> None:
        if event not in WATCHED:
            return
        for argument in arguments[:2]:
            if isinstance(argument, str | bytes | os.PathLike):
                path = os.path.realpath(os.fsdecode(argument))
                if any(path == root or path.startswith(root + os.sep) for root in roots):
                    raise Refused(f"refused: {Path(path).name} is sealed")
                if path.startswith("/proc/") and "/root" in path:
                    raise Refused("refused: another process's files")

    sys.addaudithook(hook)


def unreachable(folder: Path) -> bool:
    """Whether nothing can be read in a folder."""
    try:
        inside = os.listdir(folder)
    except OSError:
        return True
    return not inside


def program(name: str) -> Callable[[Path], dict[str, Any]]:
    """A diagnosing program by name: study file -> verdict."""
    if name == "seatruth":
        from withheld.programs.own import diagnosed

        return diagnosed
    from withheld.programs import BASELINES

    return BASELINES[name]


def main(argv: Sequence[str]) -> int:
    """Diagnoses the cases that have no verdict yet; one line of progress each."""
    split = argv.index("--deny")
    (name, folder), cases, denied = argv[:2], argv[2:split], [Path(word) for word in argv[split + 1 :]]
    refuse(denied)
    for place in denied:
        if not unreachable(place):
            print(f"{place.name} can be read from here: nothing is diagnosed", file=sys.stderr)
            return 3
    out = Path(folder)
    run = program(name)
    from withheld.seal import write
    from withheld.verdicts import problems, verdict

    for case in cases:
        try:
            found = run(out / "public" / case / "study.toml")
            found["case"] = case
            wrong = problems(found)
            if wrong:
                raise ValueError("; ".join(wrong))
        except Refused:
            raise
        except Exception as problem:  # a case that cannot be diagnosed is a verdict too, and scored as one
            traceback.print_exc()
            found = verdict(case, [], declared=False, failed=f"{type(problem).__name__}: {problem}")
        write(out / "verdicts" / name / f"{case}.json", json.dumps(found, indent=1) + "\n")
        print(f"{case}: {found['verdict']} {', '.join(found['effects'])}", flush=True)
    return 0


if __name__ == "__main__":
    sys.path[0] = str(Path(__file__).resolve().parents[1])
    sys.exit(main(sys.argv[1:]))
