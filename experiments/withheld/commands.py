"""The command line of the benchmark."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from seatruth.errors import SeatruthError
from withheld.diagnose import diagnose
from withheld.generate import SETS, generate
from withheld.page import write_page
from withheld.score import score

PROGRAMS = ("seatruth", "rmse", "bic", "white", "sindy", "prior")


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
    given = parser.parse_args(argv)
    try:
        if given.step == "generate":
            generate(given.set, given.out, given.cases, given.seed, given.quick, given.workers)
        elif given.step == "diagnose":
            diagnose(given.out, given.program, given.workers, limit=given.limit)
        else:
            write_page(given.out, score(given.out))
    except SeatruthError as problem:
        print(problem.message, file=sys.stderr)
        return int(problem.exit_code)
    except KeyboardInterrupt:
        print("Stopped. What is finished is kept: the same command goes on from here.", file=sys.stderr)
        return 130
    return 0
