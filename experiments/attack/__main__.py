"""Attacks seatruth: random models against Python, mutated inputs, hostile files, kills. One table says what gave way.

    python experiments/attack [--quick] [--cases N] [--minutes M] [--only PART ...] [--seed S] [--guided] [--out FOLDER]

`--minutes` ends each part after that time; the table counts what was tried by then. `--guided` lets coverage lead the
mutations (needs `pip install 'seatruth[attack]'`), from the folder "corpus" of the results, where it keeps what reached
new lines. The exit code is 1 where anything gave way; those inputs are then kept in the folder "gave way" of the
results. All data are SYNTHETIC.
"""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path

# In place of this folder, whose modules must not be found under their bare names.
HERE = Path(__file__).resolve().parent
sys.path[:] = [str(HERE.parent), *(entry for entry in sys.path if entry and Path(entry).resolve() != HERE)]

from attack import parts  # noqa: E402


def main() -> int:
    parser = argparse.ArgumentParser(prog="experiments/attack", description="Attacks seatruth; says what gave way.")
    parser.add_argument("--quick", action="store_true", help="a small version")
    parser.add_argument("--cases", type=int, help="cases of each part (default: as many as its kind needs)")
    parser.add_argument("--minutes", type=float, default=math.inf, help="longest time of each part (default: none)")
    parser.add_argument("--only", nargs="+", metavar="PART", default=[], help=f"of: {', '.join(parts.NAMES)}")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--guided", action="store_true", help="let coverage lead the mutations")
    parser.add_argument("--out", type=Path, help="folder of the results (default: results/attack or -quick)")
    parser.add_argument("--part", help=argparse.SUPPRESS)
    # Options that all experiments take, and that mean nothing here.
    parser.add_argument("--workers", help=argparse.SUPPRESS)
    parser.add_argument("--data", help=argparse.SUPPRESS)
    parser.add_argument("--fresh", action="store_true", help=argparse.SUPPRESS)
    given = parser.parse_args()
    out = given.out or HERE.parents[1] / "results" / ("attack-quick" if given.quick else "attack")
    out = out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    if given.part:
        parts.run(given.part, given.cases, given.seed, out, given.guided, 60.0 * given.minutes)
        return 0
    usual = parts.QUICK if given.quick and not given.only else parts.NAMES
    chosen = [name for name in usual if not given.only or any(name.startswith(word) for word in given.only)]
    tallies = []
    for name in chosen:
        cases = parts.cases_of(name, given.quick, given.cases)
        tally = parts.in_own_process(name, cases, given.seed, out, given.guided and name in parts.FUZZED, given.minutes)
        tallies.append(tally)
        print(f"{name}: {tally.tried} tried, {tally.failed or 'nothing'} gave way, {tally.seconds:.0f} s", flush=True)
        for reason in tally.gave_way:
            print(f"    {reason}", flush=True)
    (out / "summary.md").write_text(parts.table(tallies))
    parts.draw(tallies, out / "attack.png")
    print(parts.table(tallies))
    return int(any(tally.failed for tally in tallies))


if __name__ == "__main__":
    sys.exit(main())
