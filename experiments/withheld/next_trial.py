"""What a suggested trial would tell: the referee runs it in reality and measures the pairs anew.

The menu is the diagnosis' own, by name: [beam course: |reciprocal course: |slow start: ] and manoeuvres, joined by
", then ", each as long as the longest trial: [slow ]turn by +input or -input, [slow ]zigzag, small zigzag, wide zigzag
or staircase of the input, steps of or coast-down (of the revolutions), or a straight run.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from withheld.names import NAMES
from withheld.reality.families import Family, family_of
from withheld.reality.manoeuvres import Fixed, Trial
from withheld.reality.motion import Array
from withheld.reality.sensors import Noise
from withheld.reality.simulate import Present, Record, make
from withheld.refit import judged, pairs
from withheld.studies import UNITS

COURSES = {"beam course: ": math.pi / 2, "reciprocal course: ": math.pi}
THEN = ", then "
SLOW_START = "slow start: "
SLOW = 0.6
"""Share of the revolutions in slow manoeuvres, of the speed at a slow start."""
STAIRS = (0.25, 0.5, 0.75, 0.0, -0.25, -0.5, -0.75, 0.0)
"""Shares of the largest angle in a staircase."""
NONE_SUGGESTED = (
    "zigzag of {input}", "turn by +{input}", "staircase of {input}", "reciprocal course: zigzag of {input}",
    "beam course: turn by -{input}",
)  # fmt: skip
"""What is tried where a diagnosis says that no trial helps: some of the menu, of several kinds."""
Orders = tuple[float, float, float]
"""From so many seconds on: angle, share of the revolutions."""


def pairs_after(
    truth: Mapping[str, Any], public: Path, manoeuvre: str, rivals: Collection[str] | None = None
) -> dict[str, float]:
    """Pairwise lambda of the cause against these effects (all others where None) with the suggested trial; {} if it is
    on no menu."""
    family = sealed_family(truth)
    records = read(family, truth, public)
    trial = suggested(family, records, manoeuvre.format(input=family.input))
    if trial is None:
        return {}
    noise = {name: Noise(*values) for name, values in truth["noise"].items()}
    cause = truth["causes"][0]
    acting = [Present(family.mechanism(cause["key"]), cause["values"])]
    rng = np.random.default_rng([truth["seed"], 1])
    added = make(family, [trial], truth["coefficients"], acting, noise, rng, truth["ordered"])
    names = NAMES[family.name]
    others = [one for one in family.mechanisms if one.key in names and one.key != cause["key"]]
    others = [one for one in others if truth["ordered"] or not one.orders]
    others = [one for one in others if rivals is None or names[one.key] in rivals]
    try:
        found = judged(family, [*records, *added], truth["coefficients"], noise, acting, 0)
        after = pairs(found, others)
    except np.linalg.LinAlgError:
        # In a motion that runs away nothing can be told: what the recorded trials tell is what there is.
        return dict(truth["pairs"][cause["key"]])
    return {names[key]: value for key, value in after.items()}


def suggested(family: Family, records: list[Record], words: str) -> Trial | None:
    """The trial of the diagnosis' menu: inputs by the clock within what the records did; None for other words."""
    turned, speed, rest = 0.0, 1.0, words
    if rest.startswith(SLOW_START):
        rest, speed = rest.removeprefix(SLOW_START), SLOW
    for course, angle in COURSES.items():
        if rest.startswith(course):
            rest, turned = rest.removeprefix(course), angle
    longest = max(records, key=lambda record: record.t[-1])
    seconds = float(longest.t[-1])
    # Orders count from the trim, and so does the largest one.
    usual = float(np.median(np.concatenate([record.delta for record in records]))) if family.trimmed else 0.0
    full = max(float(np.abs(record.delta - usual).max()) for record in records) * family.craft.sense
    known = manoeuvres(family, seconds, full)
    parts = rest.split(THEN)
    if not all(part in known for part in parts):
        return None
    plan = [(k * seconds + t, delta, n) for k, part in enumerate(parts) for t, delta, n in known[part]]
    heading = (longest.trial.heading + turned) if family.vehicle.earth_current else 0.0
    return Trial(words, lambda: Fixed(plan), heading, len(parts) * seconds, speed)


def manoeuvres(family: Family, seconds: float, full: float) -> dict[str, list[Orders]]:
    """Orders of every manoeuvre of the menu by its name; each lasts so many seconds, `full` is the largest angle."""
    name, eighth = family.input, seconds / 8
    steered: dict[str, list[Orders]] = {
        f"turn by +{name}": [(0.0, full, 1.0)],
        f"turn by -{name}": [(0.0, -full, 1.0)],
        f"zigzag of {name}": [(k * eighth, full * (-1.0) ** k, 1.0) for k in range(8)],
        f"small zigzag of {name}": [(k * eighth / 2.5, full / 4 * (-1.0) ** k, 1.0) for k in range(20)],
        f"wide zigzag of {name}": [(2 * k * eighth, full / 2 * (-1.0) ** k, 1.0) for k in range(4)],
        f"staircase of {name}": [(k * eighth, part * full, 1.0) for k, part in enumerate(STAIRS)],
    }
    slow = [f"turn by +{name}", f"turn by -{name}", f"zigzag of {name}"]
    return {
        **steered,
        **{f"slow {key}": [(t, delta, SLOW) for t, delta, _ in steered[key]] for key in slow},
        "steps of n": [(0.0, 0.0, 1.0), (seconds / 3, 0.0, SLOW), (2 * seconds / 3, 0.0, 1.0)],
        "coast-down (n to zero)": [(0.0, 0.0, 1.0), (seconds / 4, 0.0, 0.0)],
        **_thrusters(family, seconds),
        "straight run": [(0.0, 0.0, 1.0)],
    }


def _thrusters(family: Family, seconds: float) -> dict[str, list[Orders]]:
    """Steps and coast-downs of a craft without a rudder: of all its thrusters, and of those on one side."""
    found: dict[str, list[Orders]] = {}
    sides = [[name for name, more in family.thrusters.items() if more * side > 0] for side in (1, -1)]
    for side, group in zip((0.0, 1.0, -1.0), (list(family.thrusters), *sides), strict=True):
        if not group:
            continue
        names = " and ".join(group)
        # One side at the share f of its revolutions: the mean falls by half of that, the rest is an angle.
        angle = family.revolutions / (2 * abs(family.thrusters[group[0]])) * side * family.craft.sense

        def at(f: float, side: float = side, angle: float = angle) -> tuple[float, float]:
            return (f - 1.0) * angle, f if side == 0.0 else 0.5 * (1.0 + f)

        found[f"steps of {names}"] = [(0.0, *at(1.0)), (seconds / 3, *at(SLOW)), (2 * seconds / 3, *at(1.0))]
        found[f"coast-down ({names} to zero)"] = [(0.0, *at(1.0)), (seconds / 4, *at(0.0))]
    return found


def sealed_family(truth: Mapping[str, Any]) -> Family:
    """The family of a sealed case; in those from before 2026-11-26 velocities are over ground."""
    return family_of(truth["family"], water_log=bool(truth.get("water_log", False)))


def read(family: Family, truth: Mapping[str, Any], public: Path) -> list[Record]:
    """The recorded inputs of a case again, with the true first states from the sealed part."""
    records = []
    for k, sealed in enumerate(truth["trials"]):
        with (public / f"trial_{k + 1}.csv").open(encoding="utf-8") as stream:
            rows = list(csv.reader(line for line in stream if not line.startswith("#")))
        table = np.array(rows[1:], dtype=np.float64)
        columns: dict[str, Array] = {name.split(" ")[0]: table[:, j] for j, name in enumerate(rows[0])}
        trial = Trial(sealed["name"], lambda: Fixed([]), sealed["heading"], sealed["seconds"])
        delta, n = family.orders(columns)
        outputs = {name: columns[shown] for name, shown in family.named_in_log.items() if shown in UNITS}
        records.append(Record(trial, columns["t"], delta, n, outputs, {}, tuple(sealed["first"])))
    return records
