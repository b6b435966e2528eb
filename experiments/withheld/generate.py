"""First step: cases, the public part and the sealed part written apart."""

from __future__ import annotations

import json
import re
import secrets
import time
from collections.abc import Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from seatruth.errors import BadInput
from withheld.cases import FORM_KINDS, KINDS, LOOKALIKES, STRATA, Case, NotDrawn, Plan, draw
from withheld.commits import told
from withheld.names import NAMES, UNKNOWN
from withheld.reality.families import Family, families
from withheld.reality.simulate import Record
from withheld.seal import digest_file, note, write
from withheld.studies import log_text, study_text

ASIDE = ("container", "frame")
"""Families that only the test set holds: the method is frozen before anybody sees how it does there."""
SETS: dict[str, tuple[str, ...]] = {
    "dev": ("ship", "auv", "twin", "mariner", "tanker", "torpedo"),
    "test": ("ship", "frame", "auv", "twin", "container", "tanker", "mariner", "frame", "torpedo"),
}
"""Families of each set, in turn: one that comes twice makes more of the cases."""
SHARES = {
    "single": 0.33, "double": 0.08, "none": 0.09, "outside": 0.09, "confounded": 0.08,
    "form": 0.14, "form+single": 0.19,
}  # fmt: skip
"""A third of the vehicles have another form than their models."""
CASES, QUICK = {"dev": 300, "test": 300}, 1
DEV_SEED = 20261122
SHEETS = Path(__file__).resolve().parent / "sheets"
"""Models as a user would write them from a data sheet."""


def plans(which: str, count: int, seed: int) -> list[Plan]:
    """The plans of a set, in an order that says nothing.

    Kinds in fixed shares, families in turn, causes and forms in a shuffled turn, so that none comes twice before all
    came once; strata in turn. Half of the studies state their noise. In a test set a third of those of vehicles that a
    current carries sideways have velocities through the water.
    """
    rng = np.random.default_rng(seed)
    known = families()
    kinds = [kind for kind in KINDS for _ in range(max(1, round(SHARES[kind] * count)))]
    kinds = (kinds + ["single"] * count)[:count]
    stated = rng.permutation(np.arange(count) % 2 == 0)
    # By numbers of their own: the other draws of a seed stay what they were, and with them the stored calibration.
    water_log = np.random.default_rng([seed, 1]).permutation(np.arange(count) % 3 == 0) & (which == "test")
    carried = {key for key, family in known.items() if family.vehicle.earth_current}
    turns: dict[tuple[str, str], Iterator[str]] = {}
    result = []
    for k, kind in enumerate(kinds):
        name = SETS[which][k % len(SETS[which])]
        causes: tuple[str, ...] = ()
        form = ""
        if kind in FORM_KINDS:
            shapes = [one.key for one in known[name].forms]
            form = next(turns.setdefault(("shape", name), _turn(shapes, rng)))
        if kind not in ("none", "form"):
            turn = turns.setdefault((kind, name), _turn(_offered(known[name], kind), rng))
            causes = (next(turn), next(turn)) if kind == "double" else (next(turn),)
        strong = kind in ("confounded", "double", *FORM_KINDS)
        stratum = 1 + k % (len(STRATA) - 1) if strong else (k // 2) % len(STRATA)
        through_water = name in carried and bool(water_log[k])
        result.append(Plan(name, kind, causes, stratum, int(rng.integers(2**62)), form, bool(stated[k]), through_water))
    return [result[k] for k in rng.permutation(len(result))]


def _offered(family: Family, kind: str) -> list[str]:
    if kind == "outside":
        return [one.key for one in family.unnamed]
    if kind == "confounded":
        return [key for key in LOOKALIKES[family.name] if key in NAMES[family.name]]
    usable = NAMES[family.name]
    return [one.key for one in family.named if one.key in usable]


def _turn(keys: list[str], rng: np.random.Generator) -> Iterator[str]:
    while True:
        yield from (keys[k] for k in rng.permutation(len(keys)))


def sealed(case: Case, name: str) -> dict[str, Any]:
    """What is sealed of a case."""
    outside = case.plan.kind == "outside"
    unknown = case.plan.kind in ("outside", "form")
    causes: list[dict[str, Any]] = [
        {
            "name": UNKNOWN if outside else NAMES[case.family.name][p.mechanism.key],
            "key": p.mechanism.key,
            "number": p.mechanism.number,
            "place": _place(p.mechanism.place, case.family),
            "values": dict(p.values),
            "units": dict(p.mechanism.units),
        }
        for p in case.causes
    ]
    strengths = list(case.truth["lambda"].values())
    return {
        "case": name,
        "synthetic": True,
        "family": case.family.name,
        "kind": case.plan.kind,
        "effects": [UNKNOWN] if unknown else sorted(cause["name"] for cause in causes),
        "causes": causes,
        "set": sorted({cause["name"] for cause in causes} | set(case.truth["lookalikes"])),
        "places": sorted({place for cause in causes for place in cause["place"].split(",")}),
        "stratum": stratum(min(strengths)) if strengths else "none",
        **case.truth,
        "ordered": case.ordered,
        "stated": case.plan.stated,
        "water_log": case.plan.water_log,
        "distractors": [
            {"key": p.mechanism.key, "values": dict(p.values), "lambda": size} for p, size in case.distractors
        ],
        "coefficients": case.coefficients,
        "noise": {key: [one.white, one.slow, one.tau] for key, one in case.noise.items()},
        "trials": [_trial(record) for record in case.records],
        "seed": case.plan.seed,
    }


def _place(word: str, family: Family) -> str:
    """A mechanism's place in the library's words: its names of input and turning rate."""
    word = word.replace("actuator:delta", f"actuator:{family.input}")
    word = word.replace("sensor:turning", "sensor:r" if "r" in family.outputs else "sensor:q")
    second = "v" if "v" in family.outputs else "w"
    word = word.replace("sensor:across", f"sensor:{second}")
    for name, shown in family.named_in_log.items():
        word = re.sub(rf"sensor:{name}(?!\w)", f"sensor:{shown}", word)
    return word


def stratum(size: float) -> str:
    """The name of the stratum of a lambda."""
    for low, high in STRATA[:-1]:
        if size < low:
            return f"<{low:g}"
        if size < high:
            return f"{low:g}-{high:g}"
    return f">{STRATA[-1][0]:g}"


def _trial(record: Record) -> dict[str, Any]:
    trial = record.trial
    return {
        "name": trial.name, "heading": trial.heading, "seconds": trial.seconds, "closed": trial.closed,
        "first": list(record.first),
    }  # fmt: skip


def one_case(plan: Plan, name: str, out: str) -> float:
    """Draws one case and writes it; the public part first, so that a sealed file says that all is there."""
    begin = time.perf_counter()
    # Its matrices are small: threads of the linear algebra in every worker only stand in each other's way.
    with threadpool_limits(limits=1, user_api="blas"):
        case = draw(plan)
    folder = Path(out) / "public" / name
    folder.mkdir(parents=True, exist_ok=True)
    for k, record in enumerate(case.records):
        write(folder / f"trial_{k + 1}.csv", log_text(case.family, record))
    if case.family.sheet:
        write(folder / case.family.sheet, (SHEETS / case.family.sheet).read_text(encoding="utf-8"))
    write(folder / "study.toml", study_text(case, name))
    write(Path(out) / "sealed" / f"{name}.json", json.dumps(sealed(case, name), indent=1) + "\n")
    return time.perf_counter() - begin


def generate(
    which: str, out: Path, count: int | None, seed: int | None, quick: bool, workers: int, *, as_is: bool = False
) -> None:
    """Makes a set, or what is missing of it; the seed of a test set is drawn and sealed unless it is given.

    `as_is` seals what is there: for cases that cannot be drawn in any bearable time. The log names them.
    """
    settings_file = out / "sealed" / "_set.json"
    many = count or (QUICK if quick else CASES[which])
    if settings_file.exists():
        old: Mapping[str, Any] = json.loads(settings_file.read_text(encoding="utf-8"))
        if (old["set"], old["cases"]) != (which, many) or (seed is not None and seed != old["seed"]):
            raise BadInput("another set is there already", where=str(out), do="Give another --out.")
        seed = int(old["seed"])
    else:
        for part in ("public", "sealed"):
            (out / part).mkdir(parents=True, exist_ok=True)
        seed = seed if seed is not None else DEV_SEED if which == "dev" else secrets.randbits(62)
        write(settings_file, json.dumps({"set": which, "cases": many, "seed": seed}) + "\n")
    todo = plans(which, many, seed)
    names = [f"c{k + 1:03d}" for k in range(many)]
    missing = [k for k in range(many) if not (out / "sealed" / f"{names[k]}.json").exists()]
    print(f"{many - len(missing)} of {many} cases are there; {len(missing)} to make, about "
          f"{25 * len(missing) / max(1, workers) / 60:.0f} min", flush=True)  # fmt: skip
    if as_is and missing:
        if len(missing) == many:
            raise BadInput("no case is there to seal", where=str(out), do="Run it without --as-is first.")
        note(out, "generate", "given up", {"set": which, "cases": [names[k] for k in missing]})
        names, missing = [name for k, name in enumerate(names) if k not in missing], []
    if missing:
        note(out, "generate", "begin", {"set": which, "cases": many, **told(out, "generate")})
    with ProcessPoolExecutor(max_workers=max(1, workers)) as pool:
        jobs = {pool.submit(one_case, todo[k], names[k], str(out)): k for k in missing}
        failed = []
        for done, job in enumerate(as_completed(jobs), 1):
            try:
                took = f"{job.result():.1f} s"
            except NotDrawn:
                # Why would tell of the seal.
                took = "could not be drawn"
                failed.append(names[jobs[job]])
            print(f"[{done}/{len(missing)}] {names[jobs[job]]}: {took}", flush=True)
    if failed:
        raise BadInput(f"could not be drawn: {', '.join(sorted(failed))}", where=str(out),
                       do="Seal the others with --as-is, with the same commit; the log will name these.")  # fmt: skip
    seal = {name: digest_file(out / "sealed" / f"{name}.json") for name in names}
    write(out / "public" / "seal.json", json.dumps({"set": which, "sealed": seal}, indent=1) + "\n")
    if missing or as_is:
        note(out, "generate", "end", {"sealed": digest_file(out / "public" / "seal.json")})
