"""What must come out of the experiment on Xu, Zou et al. 2012 [V], beside what did.

All figures are those of independent code for the same plant, to their printed digits.
"""

from __future__ import annotations

from typing import Any

import pandas as pd
from common import Results, say

TRAPEZOID = {
    **{"X_uu": -0.01, "X_wq": 0.5, "X_qq": 0.7},
    **{"Z_0": -0.7, "Z_w": -0.35, "Z_aw": 9.0, "Z_waw": 42.0, "Z_q": 1.3, "Z_qaq": -27.0, "Z_ds": 0.8},
    **{"M_w": -0.65, "M_aw": 13.0, "M_waw": -243.0, "M_q": 1.4, "M_qaq": -33.0, "M_ds": 0.9, "z_B": -0.3},
}
"""[V] Errors in per cent of the trapezoid form, C = 3e4."""
SENSITIVITIES = {
    **{"Z_ds": 1.45, "Z_q": 1.34, "M_ds": 0.71, "Z_w": 0.67, "M_q": 0.55, "Z_0": 0.36, "M_w": 0.22, "Z_aw": 0.089},
    **{"M_aw": 0.032, "Z_qaq": 0.025, "Z_waw": 0.019, "M_qaq": 0.009, "M_waw": 0.0015},
}
"""[V] Sensitivities."""


class Checks:
    """The figures that are checked, found and expected."""

    def __init__(self, results: Results) -> None:
        self.results = results
        self.rows: list[dict[str, Any]] = []

    def near(self, name: str, found: float, expected: float, within: float, unit: str) -> None:
        """Equal to the printed digits, or within what the printed figure leaves open."""
        self._add(name, found, f"{expected:g}", abs(found - expected) <= within, unit)

    def at_most(self, name: str, found: float, limit: float, unit: str, digit: float = 0.0) -> None:
        """No more than a limit, which is printed to this digit."""
        self._add(name, found, f"<= {limit:g}", found <= limit + 0.5 * digit, unit)

    def at_least(self, name: str, found: float, limit: float, unit: str, digit: float = 0.0) -> None:
        """No less than a limit, which is printed to this digit."""
        self._add(name, found, f">= {limit:g}", found >= limit - 0.5 * digit, unit)

    def finish(self) -> None:
        """The table, and a failure for each figure that did not come out."""
        self.results.add_table("checks", pd.DataFrame(self.rows).set_index("figure"))
        met = sum(row["met"] for row in self.rows)
        self.results.add_figure("check figures [V]", met, f"of {len(self.rows)}", goal="all", met=met == len(self.rows))
        lines = ["Check figures: expected [V] and found.\n", "| figure | expected | found | met |", "|---|---|---|---|"]
        for row in self.rows:
            found = f"{row['found']:.4g} {row['unit']}".strip()
            lines.append(f"| {row['figure']} | {row['expected']} | {found} | {'yes' if row['met'] else 'no'} |")
            if not row["met"]:
                self.results.fail(f"{row['figure']}: {found}, expected {row['expected']}")
        self.results.add_text("\n".join(lines))

    def _add(self, name: str, found: float, expected: str, met: bool, unit: str) -> None:
        self.rows.append({"figure": name, "found": found, "expected": expected, "unit": unit, "met": bool(met)})
        say(f"  {name}: {found:.4g} {unit} (expected [V] {expected}){'' if met else '  NOT MET'}")
