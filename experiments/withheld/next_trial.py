"""What a suggested trial would tell: the referee runs it in reality and measures the pairs anew.

The menu is the diagnosis' own, by name: [beam course: |reciprocal course: ] then zigzag, small zigzag or slow zigzag of
an input, turn by +input or -input, steps of or coast-down (of the revolutions), or a straight run.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from withheld.names import NAMES
from withheld.reality.families import Family, families
from withheld.reality.manoeuvres import Fixed, Trial
from withheld.reality.motion import Array
from withheld.reality.sensors import Noise
from withheld.reality.simulate import Present, Record, make
from withheld.refit import judged, pairs
from withheld.studies import UNITS

COURSES = {"beam course: ": math.pi / 2, "reciprocal course: ": math.pi}


def pairs_after(truth: Mapping[str, Any], public: Path, manoeuvre: str) -> dict[str, float]:
    """Pairwise lambda of the cause against every other effect with the suggested trial; {} if it is on no menu."""
    family = families()[truth["family"]]
    records = read(family, truth, public)
    trial = suggested(family, records, manoeuvre)
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
    found = judged(family, [*records, *added], truth["coefficients"], noise, acting, 0)
    after = pairs(found, others)
    return {names[key]: value for key, value in after.items()}


def suggested(family: Family, records: list[Record], words: str) -> Trial | None:
    """The trial of the diagnosis' menu: inputs by the clock within what the records did; None for other words."""
    turned = 0.0
    for course, angle in COURSES.items():
        if words.startswith(course):
            words, turned = words.removeprefix(course), angle
    longest = max(records, key=lambda record: record.t[-1])
    seconds = float(longest.t[-1])
    # Orders count from the trim, and so does the largest one.
    usual = float(np.median(np.concatenate([record.delta for record in records]))) if family.trimmed else 0.0
    full = max(float(np.abs(record.delta - usual).max()) for record in records) * family.craft.sense
    name, period = family.input, seconds / 4
    half = period / 2
    over = [(k * half, full * (-1.0) ** k, 1.0) for k in range(8)]
    small = [(k * half / 2.5, full / 4 * (-1.0) ** k, 1.0) for k in range(20)]
    plans: dict[str, list[tuple[float, float, float]]] = {
        f"zigzag of {name}": over,
        f"small zigzag of {name}": small,
        f"turn by +{name}": [(0.0, full, 1.0)],
        f"turn by -{name}": [(0.0, -full, 1.0)],
        "steps of n": [(0.0, 0.0, 1.0), (seconds / 3, 0.0, 0.6), (2 * seconds / 3, 0.0, 1.0)],
        "coast-down (n to zero)": [(0.0, 0.0, 1.0), (seconds / 4, 0.0, 0.0)],
        f"slow zigzag of {name}": [(t, delta, 0.6) for t, delta, _ in over],
        "straight run": [(0.0, 0.0, 1.0)],
    }
    if words not in plans:
        return None
    heading = (longest.trial.heading + turned) if family.vehicle.earth_current else 0.0
    return Trial(words, lambda: Fixed(plans[words]), heading, seconds)


def read(family: Family, truth: Mapping[str, Any], public: Path) -> list[Record]:
    """The recorded inputs of a case again, with the true first states from the sealed part."""
    records = []
    for k, sealed in enumerate(truth["trials"]):
        with (public / f"trial_{k + 1}.csv").open(encoding="utf-8") as stream:
            rows = list(csv.reader(line for line in stream if not line.startswith("#")))
        table = np.array(rows[1:], dtype=np.float64)
        columns: dict[str, Array] = {name.split(" ")[0]: table[:, j] for j, name in enumerate(rows[0])}
        trial = Trial(sealed["name"], lambda: Fixed([]), sealed["heading"], sealed["seconds"])
        none = np.zeros(len(table))
        outputs = {name: columns[name] for name in family.outputs if name in UNITS}
        records.append(
            Record(
                trial, columns["t"], columns[family.input], columns.get("n", none), outputs, {}, tuple(sealed["first"])
            )
        )
    return records
