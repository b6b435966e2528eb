"""The standard comparison: seven solvers on published systems and two recorded ships, at 0, 1, 3 and 10 % noise.

    python experiments/standard_comparison.py [--quick]

The published systems are simulated with their published or reconstructed values (synthetic); noise comes on top of the
ships' records. 20 realisations of each noise, the same for all solvers, which start at the same random place. Beside
white noise, the other kinds at 3 %. What is measured and how it is tested: docs/compare.md.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any

import standard_comparison_systems as systems
from common import Options, Results, main, say

from seatruth.comparison import Comparison, Noise, compare
from seatruth.progress import ProgressEvent
from seatruth.report.comparison import write_comparison_report, write_tables
from seatruth.report.figures.comparison import accuracy, ranks, reached

SEED, SEEDS, BUDGET = 20260301, 20, 2000
LEVELS = (0.0, 0.01, 0.03, 0.10)
KINDS = ("coloured", "outliers", "dropouts", "input")
OTHERS_AT = 0.03
SOLVERS: dict[str, Any] = {
    "least_squares": "least_squares",
    "ls_svm": "ls_svm",
    "cma_es": "cma_es",
    "differential_swarm": "differential_swarm",
    "particle_swarm": "particle_swarm",
    "genetic": "genetic",
    "swarm, then least squares": ["differential_swarm", "least_squares"],
}
_SAY_EVERY_S = 20.0


def comparison(data: Path | None, *, quick: bool = False, seeds: int = SEEDS) -> Comparison:
    """The standard comparison; without the ships where `data` is None."""
    noise = [Noise("white", level) for level in (LEVELS[:2] if quick else LEVELS)]
    noise += [] if quick else [Noise(kind, OTHERS_AT) for kind in KINDS]
    return Comparison(
        problems=systems.problems(data, quick),
        solvers=SOLVERS,
        noise=noise,
        seeds=2 if quick else seeds,
        budgets=[400 if quick else BUDGET],
        name="Standard comparison" + (" (quick)" if quick else ""),
        description="Published systems, simulated with their published or reconstructed values, and recorded runs of "
        "two ship models; see experiments/standard_comparison.py.",
        seed=SEED,
    )


def body(options: Options, results: Results) -> None:
    data = None if options.quick else options.trials("kvlcc2_marin", "esso_osaka")
    made = comparison(data, quick=options.quick)
    say(f"{len(made.runs)} runs, {len(made.references)} reference fits")
    begun = time.perf_counter()
    found = compare(made, options.out, workers=options.workers, fresh=options.fresh, progress=_teller())
    spent = time.perf_counter() - begun
    write_comparison_report(found, options.out / "report.html")
    write_tables(found, options.out / "tables")
    results.add_text(__doc__ or "")
    for about in ("optimisation", "estimation", "caution"):
        lines = [f"- {said.text}" for said in found.conclusions if said.about == about]
        results.add_text(f"**{about.capitalize()}**\n\n" + "\n".join(lines))
    results.add_figure("runs", len(found.runs), "1", f"{made.seeds} realisations of each noise, kept ones included")
    results.add_figure("failed runs", len(found.failures), "1", "kept with their reasons")
    searching = float(found.runs["search_s"].sum())
    results.add_figure("search time of all runs together", searching, "s", "one core each")
    results.add_figure("evaluations of all runs together", float(found.runs["evaluations"].sum()), "1")
    results.add_figure("wall time of this call", spent, "s", f"{options.workers} workers; kept runs cost none")
    for cost in dict.fromkeys(found.runs["cost"]):
        for by in ("effort", "accuracy"):
            ranking = found.ranking(by, cost=cost)
            if ranking is not None:
                best = ranking.table.iloc[0]
                note = f"{best['solver']} of {len(ranking.order)}, over {ranking.blocks} {ranking.block_kind}s"
                results.add_figure(f"{cost}, {by}: best mean rank", float(best["mean_rank"]), "1", note)
                results.add_table(f"pairs by {by}, {cost}", ranking.pairs.set_index(["first", "second"]))
                results.add_picture(f"ranks by {by}, {cost}", ranks(ranking))
    results.add_table("overall", found.overall.set_index(["problem", "cost", "solver", "noise", "level", "budget"]))
    results.add_picture("accuracy against noise", accuracy(found, "white"))
    results.add_picture("evaluations to targets", reached(found, "trajectory", "ecdf"))


def _teller() -> Any:
    """Says now and then how far it is."""
    last = [0.0]

    def tell(now: ProgressEvent) -> None:
        if time.monotonic() - last[0] > _SAY_EVERY_S or not now.left:
            last[0] = time.monotonic()
            say(f"  {now}")

    return tell


if __name__ == "__main__":
    sys.exit(main("standard_comparison", str(__doc__).splitlines()[0], body, seeds={"comparison": SEED}))
