"""The standard comparison: ten solvers, hybrids and restarts on published systems, to 100,000 evaluations.

    python experiments/standard_comparison.py [--quick] [--workers 1] [--ships] [--kinds]

The published systems are simulated with their published or reconstructed values (synthetic), at 0, 1, 3 and 10 %
noise. 15 realisations of each noise, the same for all solvers, which start at the same random place. One search gives
the accuracy at every budget; it ends early once it is at the best fit to 0.001 chi-square. `--ships` adds two recorded
ships at their smaller budgets, `--kinds` four other kinds of noise at 3 %. Before it starts it says how long it will
take at most; after an interruption it goes on. `--only-report` writes the report of what there is, also while the
comparison runs. What is measured and how it is tested: docs/compare.md.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any

import standard_comparison_systems as systems
from common import Options, Results, main, say

from seatruth.comparison import Comparison, Noise, compare, forecast, standing
from seatruth.optimizers import make
from seatruth.progress import ProgressEvent
from seatruth.report.comparison import write_comparison_report, write_tables
from seatruth.report.figures.comparison import accuracy, ranks, reached
from seatruth.report.figures.comparison_anytime import expected

SEED, SEEDS = 20261122, 15
BUDGETS = (100, 1000, 10_000, 100_000)
LEVELS = (0.0, 0.01, 0.03, 0.10)
KINDS = ("coloured", "outliers", "dropouts", "input")
OTHERS_AT = 0.03
TARGETS = (100.0, 10.0, 1.0, 0.1, 0.01)
SOLVERS: dict[str, Any] = {
    "least_squares": "least_squares",
    "newton": "newton",
    "nelder_mead": "nelder_mead",
    "ls_svm": "ls_svm",
    "differential_swarm": "differential_swarm",
    "particle_swarm": "particle_swarm",
    "genetic": make("genetic", generations=100_000),
    "simulated_annealing": make("simulated_annealing", iterations=100_000),
    "differential_evolution": "differential_evolution",
    "cma_es": "cma_es",
    "cma_es, restarts": make("cma_es", restarts=20),
    "multi_start": "multi_start",
    "swarm, then least squares": ["differential_swarm", "least_squares"],
}
"""All with their defaults; the limits of generations and steps are moved beyond the budget."""
_SAY_EVERY_S = 60.0


def comparison(
    data: Path | None, *, quick: bool = False, seeds: int = SEEDS, kinds: bool = False, largest: int = BUDGETS[-1]
) -> Comparison:
    """The standard comparison; without the ships where `data` is None."""
    noise = [Noise("white", level) for level in (LEVELS[:2] if quick else LEVELS)]
    noise += [Noise(kind, OTHERS_AT) for kind in KINDS] if kinds else []
    return Comparison(
        problems=systems.problems(data, quick),
        solvers=SOLVERS,
        noise=noise,
        seeds=2 if quick else seeds,
        budgets=[100, 400] if quick else [budget for budget in BUDGETS if budget <= largest],
        stop="targets",
        targets=TARGETS,
        name="Standard comparison" + (" (quick)" if quick else ""),
        description="Published systems, simulated with their published or reconstructed values"
        + (", and recorded runs of two ship models" if data is not None else "")
        + "; see experiments/standard_comparison.py.",
        seed=SEED,
    )


def body(options: Options, results: Results) -> None:
    data = None if options.quick or not options.asked("ships") else options.trials("kvlcc2_marin", "esso_osaka")
    made = comparison(data, quick=options.quick, kinds=options.asked("kinds"))
    if options.asked("only-report"):
        write(standing(made, options.out), options, results, 0.0)
        return
    say(f"{len(made.runs)} runs of {len({(run.instance, run.solver) for run in made.runs})} searches")
    expected_time = forecast(made, options.out)
    for solver, seconds in expected_time.groupby("solver", sort=False)["seconds"].sum().items():
        say(f"  {solver}: at most {seconds / 60.0:.0f} min")
    say(f"Forecast: at most {expected_time['seconds'].sum() / 3600.0 / options.workers:.1f} h of this many processors.")
    begun = time.perf_counter()
    found = compare(made, options.out, workers=options.workers, fresh=options.fresh, progress=_teller())
    write(found, options, results, time.perf_counter() - begun)


def write(found: Any, options: Options, results: Results, spent: float) -> None:
    """The report, the tables, the figures."""
    made = found.comparison
    write_comparison_report(found, options.out / "report.html")
    write_tables(found, options.out / "tables")
    results.add_text(__doc__ or "")
    for about in ("optimisation", "estimation", "caution"):
        lines = [f"- {said.text}" for said in found.conclusions if said.about == about]
        results.add_text(f"**{about.capitalize()}**\n\n" + "\n".join(lines))
    results.add_figure("runs", len(found.runs), "1", f"{made.seeds} realisations of each noise, kept ones included")
    results.add_figure("failed runs", len(found.failures), "1", "kept with their reasons")
    searches = found.final
    results.add_figure("searches", len(searches), "1", f"of up to {max(made.budgets)} evaluations")
    results.add_figure("search time of all together", float(searches["search_s"].sum()), "s", "one core each")
    results.add_figure("evaluations of all together", float(searches["evaluations"].sum()), "1")
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
        results.add_picture(f"evaluations to targets, {cost}", reached(found, cost, "ecdf"))
        results.add_picture(f"expected running time, {cost}", expected(found, cost))
    results.add_table("expected running time", found.expected.set_index(["problem", "cost", "solver"]))
    results.add_table("overall", found.overall.set_index(["problem", "cost", "solver", "noise", "level", "budget"]))
    results.add_picture("accuracy against noise", accuracy(found, "white"))


def _teller() -> Any:
    """Says now and then how far it is."""
    last = [0.0]

    def tell(now: ProgressEvent) -> None:
        if time.monotonic() - last[0] > _SAY_EVERY_S or not now.left:
            last[0] = time.monotonic()
            say(f"  {now}")

    return tell


if __name__ == "__main__":
    about = str(__doc__).splitlines()[0]
    switches = {
        "only-report": "only write the report of what there is",
        "ships": "also two recorded ships",
        "kinds": "also four other kinds of noise at 3 %",
    }
    sys.exit(main("standard_comparison", about, body, seeds={"comparison": SEED}, switches=switches))
