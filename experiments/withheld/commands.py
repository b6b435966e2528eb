"""The command line of the benchmark."""

from __future__ import annotations

import argparse
import importlib.util
import os
import shutil
import sys
from collections.abc import Sequence
from pathlib import Path

from seatruth.errors import SeatruthError
from withheld.diagnose import diagnose
from withheld.generate import SETS, generate
from withheld.markdown import markdown
from withheld.page import write_page
from withheld.score import score
from withheld.seal import ROOT, note

PROGRAMS = ("seatruth", "rmse", "bic", "white", "sindy", "prior")
QUICK_PROGRAMS = ("seatruth", "prior")


def main(argv: Sequence[str] | None = None) -> int:
    """Runs one step; returns the exit code (0; 2 bad input; 130 stopped)."""
    parser = argparse.ArgumentParser(
        prog="experiments/withheld", description="The withheld-effect benchmark, step by step."
    )
    steps = parser.add_subparsers(dest="step", required=True)
    make = steps.add_parser("generate", help="make cases; the public and the sealed part are written apart")
    make.add_argument("--set", choices=sorted(SETS), required=True, help="development set, or test set")
    make.add_argument("--out", type=Path, required=True, help="folder of the set")
    make.add_argument("--cases", type=int, help="how many")
    make.add_argument("--seed", type=int, help="default: fixed for dev, drawn and sealed for test")
    make.add_argument("--quick", action="store_true", help="a handful of cases")
    make.add_argument("--workers", type=int, default=min(4, os.cpu_count() or 1))
    blind = steps.add_parser("diagnose", help="verdicts on the public part, with the sealed one out of reach; hashed")
    blind.add_argument("--out", type=Path, required=True, help="folder of the set")
    blind.add_argument("--program", choices=PROGRAMS, default="seatruth", help="who diagnoses")
    blind.add_argument("--workers", type=int, default=2)
    blind.add_argument("--limit", type=int, help="only the first so many cases")
    last = steps.add_parser("score", help="open the seal, score every program's verdicts, write the page")
    last.add_argument("--out", type=Path, required=True, help="folder of the set")
    shown = steps.add_parser("table", help="the score as a table in Markdown, to stand in a README")
    shown.add_argument("--out", type=Path, required=True, help="folder of a set that is scored")
    shown.add_argument("--draft", action="store_true", help="also of a tree with changes, and marked so")
    whole = steps.add_parser("all", help="all three steps in turn, with every program; what is finished is kept")
    whole.add_argument("--set", choices=sorted(SETS), default="dev")
    whole.add_argument("--out", type=Path, help="default: results/withheld-SET, with -quick for --quick")
    whole.add_argument("--cases", type=int, help="how many")
    whole.add_argument("--quick", action="store_true", help="a handful of cases")
    whole.add_argument("--fresh", action="store_true", help="start from nothing")
    whole.add_argument("--data", type=Path, help="not used: no real trials are needed")
    whole.add_argument("--workers", type=int, default=min(4, os.cpu_count() or 1))
    words = list(sys.argv[1:] if argv is None else argv)
    # As any experiment it runs without a step's name, too.
    step_named = bool(words) and (not words[0].startswith("--") or words[0] == "--help")
    given = parser.parse_args(words if step_named else ["all", *words])
    try:
        if given.step == "generate":
            generate(given.set, given.out, given.cases, given.seed, given.quick, given.workers)
        elif given.step == "diagnose":
            diagnose(given.out, given.program, given.workers, limit=given.limit)
        elif given.step == "score":
            write_page(given.out, score(given.out))
        elif given.step == "table":
            print(markdown(given.out, draft=given.draft), end="")
        else:
            everything(given)
    except SeatruthError as problem:
        print(problem.message, file=sys.stderr)
        return int(problem.exit_code)
    except KeyboardInterrupt:
        print("Stopped. What is finished is kept: the same command goes on from here.", file=sys.stderr)
        return 130
    return 0


def everything(given: argparse.Namespace) -> None:
    """Generates, diagnoses with every program that can run here, and scores; SINDy only where pysindy is installed."""
    out: Path = given.out or ROOT / "results" / f"withheld-{given.set}{'-quick' if given.quick else ''}"
    if given.fresh and (out / "log.jsonl").exists():
        shutil.rmtree(out)
    generate(given.set, out, given.cases, None, given.quick, given.workers)
    for name in QUICK_PROGRAMS if given.quick else PROGRAMS:
        if name == "sindy" and importlib.util.find_spec("pysindy") is None:
            print('sindy: left out, pysindy is not installed (pip install ".[benchmark]")', flush=True)
            note(out, "diagnose", "left out", {"program": "sindy", "why": "pysindy is not installed"})
            continue
        diagnose(out, name, given.workers)
    write_page(out, score(out))
    shown = out.relative_to(ROOT) if out.is_relative_to(ROOT) else out
    print(f"Written: {shown}/score.html and score.json", flush=True)
