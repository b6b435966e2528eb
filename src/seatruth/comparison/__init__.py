"""Comparisons: any solvers on any problems under any noise, with statistics that say how sure it all is.

from seatruth import Comparison, compare
from seatruth.comparison import Noise, Problem

comparison = Comparison(
    problems=[Problem("zigzags", load_study("zigzags.toml"), truth={"Y_v": -0.3, "N_v": -0.1})],
    solvers=["least_squares", "cma_es", ["differential_swarm", "least_squares"]],
    noise=[Noise("white", 0.01), Noise("outliers", 0.01)],
    seeds=20,
    budgets=[500, 5000],
)
results = compare(comparison, "zigzags-result", workers=4)
results.overall, results.ranking("accuracy"), results.conclusions
"""

from seatruth.comparison.noise import KINDS, Noise
from seatruth.comparison.problem import Problem, Run
from seatruth.comparison.results import Results
from seatruth.comparison.runner import compare, merge, standing
from seatruth.comparison.spec import Comparison
from seatruth.comparison.time_forecast import forecast

__all__ = ["KINDS", "Comparison", "Noise", "Problem", "Results", "Run", "compare", "forecast", "merge", "standing"]
