"""The command line of the benchmark."""

from __future__ import annotations

import argparse
import importlib.util
import json
import os
import shutil
import sys
from collections.abc import Sequence
from pathlib import Path

from seatruth.errors import SeatruthError
from withheld.calibrate import calibrate
from withheld.diagnose import diagnose
from withheld.generate import SETS, generate
from withheld.markdown import markdown
from withheld.page import write_page
from withheld.pooled import in_words
from withheld.pooled import markdown as pooled
from withheld.records.make import SET as REAL
from withheld.records.make import make as make_real
from withheld.records.page import write_page as write_real_page
from withheld.records.score import score as score_real
from withheld.records.tables import DATA
from withheld.score import score
from withheld.seal import ROOT, note

PROGRAMS = ("seatruth", "rmse", "bic", "white", "sindy", "classifier", "orthogonal", "prior")
REAL_PROGRAMS = ("seatruth", "kinematics", "prior")
QUICK_PROGRAMS = ("seatruth", "prior")
WHICH = [*sorted(SETS), REAL]


def main(argv: Sequence[str] | None = None) -> int:
    """Runs one step; returns the exit code (0; 2 bad input; 130 stopped)."""
    parser = argparse.ArgumentParser(
        prog="experiments/withheld", description="The withheld-effect benchmark, step by step."
    )
    steps = parser.add_subparsers(dest="step", required=True)
    make = steps.add_parser("generate", help="make cases; the public and the sealed part are written apart")
    make.add_argument("--set", choices=WHICH, required=True, help="development set, test set, or real records")
    make.add_argument("--out", type=Path, required=True, help="folder of the set")
    make.add_argument("--cases", type=int, help="how many; the real set has its own number")
    make.add_argument("--seed", type=int, help="default: fixed for dev, drawn and sealed for test")
    make.add_argument("--data", type=Path, help="folder of the real trials, for the real set (default: ../shared/data)")
    make.add_argument("--quick", action="store_true", help="a handful of cases")
    make.add_argument(
        "--as-is", action="store_true", help="seal what is there; what cannot be drawn is named in the log"
    )
    make.add_argument("--workers", type=int, default=min(4, os.cpu_count() or 1))
    blind = steps.add_parser("diagnose", help="verdicts on the public part, with the sealed one out of reach; hashed")
    blind.add_argument("--out", type=Path, required=True, help="folder of the set")
    blind.add_argument(
        "--program", choices=sorted({*PROGRAMS, *REAL_PROGRAMS}), default="seatruth", help="who diagnoses"
    )
    blind.add_argument("--workers", type=int, default=2)
    blind.add_argument("--limit", type=int, help="only the first so many cases")
    blind.add_argument("--skip", type=int, default=0, help="without the first so many cases, which were opened before")
    last = steps.add_parser("score", help="open the seal, score every program's verdicts, write the page")
    last.add_argument("--out", type=Path, required=True, help="folder of the set")
    last.add_argument("--data", type=Path, help="folder of the real trials, for the real set (default: ../shared/data)")
    last.add_argument("--workers", type=int, default=min(4, os.cpu_count() or 1), help="for the suggested trials")
    fitted = steps.add_parser("calibrate", help="fit the constants of the decision to diagnosed sets")
    fitted.add_argument(
        "--out", type=Path, nargs="+", required=True, help="folders of development sets, and of opened test sets"
    )
    fitted.add_argument("--seed", type=int, default=0, help="of the folds of the cross-validation")
    fitted.add_argument(
        "--keep-temperature", action="store_true", help="leave the temperature as the set was diagnosed with"
    )
    fitted.add_argument("--keep-priors", action="store_true", help="leave the shares of the kinds of answers likewise")
    shown = steps.add_parser("table", help="the score as a table in Markdown, for the page of the blind sets")
    shown.add_argument("--out", type=Path, required=True, help="folder of a set that is scored")
    shown.add_argument("--draft", action="store_true", help="also of a tree with changes, and marked so")
    steps.add_parser("pooled", help="all published blind sets as one table in Markdown, and in words")
    whole = steps.add_parser("all", help="all three steps in turn, with every program; what is finished is kept")
    whole.add_argument("--set", choices=WHICH, help="default: dev, and then real where the real trials are there")
    whole.add_argument("--out", type=Path, help="default: results/withheld-SET, with -quick for --quick")
    whole.add_argument("--cases", type=int, help="how many")
    whole.add_argument("--quick", action="store_true", help="a handful of cases")
    whole.add_argument("--fresh", action="store_true", help="start from nothing")
    whole.add_argument("--data", type=Path, help="folder of the real trials (default: ../shared/data)")
    whole.add_argument("--workers", type=int, default=min(4, os.cpu_count() or 1))
    words = list(sys.argv[1:] if argv is None else argv)
    # As any experiment it runs without a step's name, too.
    step_named = bool(words) and (not words[0].startswith("--") or words[0] == "--help")
    given = parser.parse_args(words if step_named else ["all", *words])
    try:
        if given.step == "generate":
            generated(given.set, given.out, given)
        elif given.step == "diagnose":
            diagnose(given.out, given.program, given.workers, limit=given.limit, skip=given.skip)
        elif given.step == "score":
            scored(given.out, given.data, given.workers)
        elif given.step == "calibrate":
            kept = {"keep_temperature": given.keep_temperature, "keep_priors": given.keep_priors}
            print(json.dumps(calibrate(given.out, seed=given.seed, **kept), indent=1))
        elif given.step == "table":
            print(markdown(given.out, draft=given.draft), end="")
        elif given.step == "pooled":
            print(pooled(), in_words(), sep="\n")
        else:
            everything(given)
    except SeatruthError as problem:
        print(problem.message, file=sys.stderr)
        return int(problem.exit_code)
    except KeyboardInterrupt:
        print("Stopped. What is finished is kept: the same command goes on from here.", file=sys.stderr)
        return 130
    return 0


def generated(which: str, out: Path, given: argparse.Namespace) -> None:
    """The first step, of whichever set."""
    if which == REAL:
        make_real(out, given.data, given.quick)
    else:
        seed, as_is = getattr(given, "seed", None), getattr(given, "as_is", False)
        generate(which, out, given.cases, seed, given.quick, given.workers, as_is=as_is)


def scored(out: Path, data: Path | None, workers: int) -> None:
    """The last step: a set of real records is scored by measures of its own."""
    if set_of(out) == REAL:
        write_real_page(out, score_real(out, data))
    else:
        write_page(out, score(out, workers))


def set_of(out: Path) -> str:
    """Which set is in a folder, by its public part; "" where there is none."""
    seal = out / "public" / "seal.json"
    return str(json.loads(seal.read_text(encoding="utf-8"))["set"]) if seal.exists() else ""


def everything(given: argparse.Namespace) -> None:
    """All steps of one set; without a name, of the development set and then of the real one, where its trials are."""
    real_trials = (given.data or DATA).is_dir()
    for which in [given.set] if given.set else ["dev", REAL]:
        if which == REAL and not given.set and not real_trials:
            print("real: left out, the real trials are not there (--data FOLDER)", flush=True)
            continue
        one_set(which, given)


def one_set(which: str, given: argparse.Namespace) -> None:
    """Generates, diagnoses with every program that can run here, and scores; SINDy only where pysindy is installed."""
    name = f"withheld-{which}{'-quick' if given.quick else ''}"
    out: Path = given.out / name if given.out and not given.set else given.out or ROOT / "results" / name
    if given.fresh and (out / "log.jsonl").exists():
        shutil.rmtree(out)
    generated(which, out, given)
    programs = REAL_PROGRAMS if which == REAL else PROGRAMS
    for program in QUICK_PROGRAMS if given.quick else programs:
        if program == "sindy" and importlib.util.find_spec("pysindy") is None:
            print('sindy: left out, pysindy is not installed (pip install ".[benchmark]")', flush=True)
            note(out, "diagnose", "left out", {"program": "sindy", "why": "pysindy is not installed"})
            continue
        diagnose(out, program, given.workers)
    scored(out, given.data, given.workers)
    shown = out.relative_to(ROOT) if out.is_relative_to(ROOT) else out
    print(f"Written: {shown}/score.html and score.json", flush=True)
