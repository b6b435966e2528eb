"""Second step: the diagnosing process, shut off from the seal, and the hash of all it said."""

from __future__ import annotations

import importlib.util
import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from threading import Thread

from seatruth.errors import BadInput, SeatruthError
from withheld.commits import told
from withheld.seal import digest_file, note, write

BLIND = Path(__file__).resolve().parent / "blind.py"
MANIFEST = "manifest.json"


def walls(denied: Sequence[Path]) -> list[str]:
    """Command prefix that runs a process where these folders are empty; [] where the system has no such thing."""
    if shutil.which("unshare") is None or shutil.which("mount") is None:
        return []
    covers = " && ".join(f'mount -t tmpfs none "${k + 1}"' for k in range(len(denied)))
    script = f'{covers} && shift {len(denied)} && exec "$@"'
    prefix = ["unshare", "--user", "--map-root-user", "--mount", "sh", "-c", script, "sh"]
    command = [*prefix, *(str(place.resolve()) for place in denied)]
    tried = subprocess.run([*command, "true"], capture_output=True, check=False)
    return command if tried.returncode == 0 else []


def diagnose(
    out: Path, program: str, workers: int, *, denied: Sequence[Path] = (), limit: int | None = None, skip: int = 0
) -> None:
    """Diagnoses every case of a set that has no verdict yet, then hashes all verdicts into the manifest.

    The sealed folder is out of reach of the process that does it, and `denied`, and what the set itself says must be.
    """
    seal_file = out / "public" / "seal.json"
    if not seal_file.exists():
        raise BadInput("there are no cases", where=str(out), do="Generate them first.")
    if program == "sindy" and importlib.util.find_spec("pysindy") is None:
        raise BadInput("sindy needs pysindy, which is not installed", do='pip install ".[benchmark]"')
    public = json.loads(seal_file.read_text(encoding="utf-8"))
    names = sorted(public["sealed"])[skip:limit]
    place = out / "verdicts" / program
    place.mkdir(parents=True, exist_ok=True)
    if (place / MANIFEST).exists():
        print(f"{program}: all {len(names)} verdicts are there and hashed", flush=True)
        return
    missing = [name for name in names if not (place / f"{name}.json").exists()]
    shut = [out / "sealed", *denied, *(Path(folder) for folder in public.get("denied", ()))]
    prefix = walls(shut)
    how = "in a mount namespace of its own" if prefix else "behind an audit hook alone"
    print(f"{program}: {len(missing)} of {len(names)} cases to diagnose, {how}", flush=True)
    told_of = told(out, "diagnose", program)
    asked = {"cases": len(missing), **({"skipped": skip} if skip else {})}
    note(out, "diagnose", "begin", {"program": program, **asked, "shut_off": how, **told_of})
    begin = time.perf_counter()
    parts = [part for part in (missing[k::workers] for k in range(workers)) if part]
    words = [*prefix, sys.executable, str(BLIND), program, str(out.resolve())]
    closing = ["--deny", *(str(folder.resolve()) for folder in shut)]
    threads = str(max(1, (os.cpu_count() or 1) // max(1, len(parts))))
    setting = {**os.environ, "OMP_NUM_THREADS": "1", "SEATRUTH_THREADS": os.environ.get("SEATRUTH_THREADS", threads)}
    errors = out / "verdicts" / f"{program}.err"
    with errors.open("ab") as stream:
        running = [
            subprocess.Popen([*words, *part, *closing], stdout=subprocess.PIPE, stderr=stream, text=True, env=setting)
            for part in parts
        ]
        try:
            _follow(running, len(missing))
        finally:
            for process in running:
                if process.poll() is None:
                    process.terminate()
                process.wait()
    if any(process.returncode for process in running):
        raise SeatruthError(f"the diagnosing process failed; {errors.name} says why")
    hashes = {name: digest_file(place / f"{name}.json") for name in names}
    write(place / MANIFEST, json.dumps({"program": program, "verdicts": hashes}, indent=1) + "\n")
    note(out, "diagnose", "end", {"program": program, "manifest": digest_file(place / MANIFEST)})
    failed = sum(bool(json.loads((place / f"{name}.json").read_text(encoding="utf-8")).get("failed")) for name in names)
    if failed:
        print(f"{program}: ATTENTION: {failed} of {len(names)} cases ended in an error, see {errors}", flush=True)
    print(f"{program}: {len(missing)} verdicts in {time.perf_counter() - begin:.0f} s, hashed", flush=True)


def _follow(running: Sequence[subprocess.Popen[str]], total: int) -> None:
    """Prints the processes' lines as they come, numbered."""
    done = 0

    def lines(process: subprocess.Popen[str]) -> None:
        nonlocal done
        assert process.stdout is not None
        for line in process.stdout:
            done += 1
            print(f"[{done}/{total}] {line.rstrip()}", flush=True)

    threads = [Thread(target=lines, args=(process,)) for process in running]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
