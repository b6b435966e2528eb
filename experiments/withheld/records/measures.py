"""What is measured on real cases: of each what was said of its cause, and shares over cases with intervals.

A ship's model is never exact, so that something outside the library may well act in every real case, beside what was
put in. Nothing here asks that the cause put in be the only one. Three things are asked, from hard to lenient: is it
named; where does it stand among the named causes; and how did the evidence for it change against the control, the same
runs with nothing put in. The size that was fitted is compared with the one put in, less what the control itself shows.

Shares of probability among the named answers are those that would hold were an answer outside the library ruled out.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from seatruth.effects.causes import is_within
from withheld.levels import named as named_causes
from withheld.measures import Measure, reported_set, share
from withheld.names import UNKNOWN

Truth = Mapping[str, Any]
Verdict = Mapping[str, Any]
ENVIRONMENT = ("current", "varying_current", "wind", "wave_drift", "wave_forces", "shallow_water", "bank")
"""What cannot be in an indoor basin with calm, deep water."""
FORCE, WIND = "environment.force_fixed_to_earth", "environment.force_fixed_to_earth.wind"
"""Nodes of the tree of causes: what wind is on a pond, and wind itself."""
CALLED = (0.7, 1.4)
"""Speed of a wind that is named, over the anemometer's."""
TURNS = ("14-Sep", "14-Oct")
"""Days on the pond with turns: on the other all runs are on one course, where no direction can be told."""
ALARM = 0.5
"""Probability from which the environment counts as blamed."""
NEAR = 0.25
"""Part of the size put in by which an estimate may be off."""
NAMED_GOAL = 12 / 13
"""Share of the errors put into sensors that are to be named."""
MAIN = {"log_lever_arm": "forward", "position_lever_arm": "forward"}
"""The parameter that is compared where an effect has several."""
TOWARDS = math.radians(30.0)
SPEED = 0.5
"""Direction (rad) and part of the speed by which an estimated wind may be off."""


def included(verdict: Verdict, names: Sequence[str]) -> float:
    """Probability that any of these effects acts, alone or with others."""
    return float(sum(c["probability"] for c in verdict["candidates"] if set(names) & set(c["effects"])))


def among_named(verdict: Verdict) -> dict[str, float]:
    """Each effect's share of the probability that all named answers have together; {} where there are none."""
    named = [c for c in verdict["candidates"] if c["effects"] and c["effects"] != [UNKNOWN]]
    total = float(sum(c["probability"] for c in named))
    if total <= 0.0:
        return {}
    found: dict[str, float] = {}
    for c in named:
        for name in c["effects"]:
            found[name] = found.get(name, 0.0) + float(c["probability"]) / total
    return dict(sorted(found.items(), key=lambda one: -one[1]))


def rank(verdict: Verdict, names: Sequence[str]) -> int | None:
    """Place of the first of these among the named causes, 1 is first; None where none of them is among the answers."""
    return next((k for k, name in enumerate(among_named(verdict), 1) if name in names), None)


def evidence(verdict: Verdict) -> dict[str, float]:
    """Log-evidence of each effect alone over none; {} for programs that do not state it."""
    found = {row["name"]: float(row["log_evidence"]) for row in verdict.get("which", ())}
    return {name: value for name, value in found.items() if math.isfinite(value)}


def parameter(verdict: Verdict, effect: str, name: str) -> tuple[float, float] | None:
    """Value and standard error of an effect's parameter, where it was fitted."""
    for row in verdict.get("which", ()):
        for q in row["parameters"]:
            if (row["name"], q["name"]) == (effect, name):
                return float(q["value"]), float(q["stderr"])
    return None


def put_in(truth: Truth) -> dict[str, Any]:
    """What to look for in an injected case: the library's names, the parameter that is compared, the size put in."""
    cause = truth["causes"][0]
    names = truth["effects"]
    name = MAIN.get(names[0], next(iter(cause["values"])))
    return {
        "error": cause["key"], "times": cause["times_typical"], "names": names, "parameter": name,
        "size": cause["values"][name],
    }  # fmt: skip


def of_injected(truth: Truth, own: Verdict, control: Verdict | None) -> dict[str, Any]:
    """A row of the table of injected cases; None where a program or a case has nothing to say."""
    sought = put_in(truth)
    names, first = sought["names"], sought["names"][0]
    mine, theirs = evidence(own), evidence(control) if control else {}
    rises = {name: value - theirs[name] for name, value in mine.items() if name in theirs}
    ordered = sorted(rises, key=lambda name: -rises[name])
    estimate = parameter(own, first, sought["parameter"])
    before = parameter(control, first, sought["parameter"]) if control else None
    change = None
    if estimate:
        change = estimate[0] - (before[0] if before else 0.0)
    return {
        **sought,
        "case": truth["case"],
        "family": truth["family"],
        "verdict": own["verdict"],
        "said": sorted(reported_set(own)),
        "named": bool(set(names) & reported_set(own)),
        "environment": names_environment(own),
        "probability": included(own, names),
        "probability_control": included(control, names) if control else None,
        "share": sum(among_named(own).get(name, 0.0) for name in names),
        "share_control": sum(among_named(control).get(name, 0.0) for name in names) if control else None,
        "rank": rank(own, names),
        "rank_control": rank(control, names) if control else None,
        "evidence": mine.get(first),
        "evidence_control": theirs.get(first),
        "rise": rises.get(first),
        "rise_rank": ordered.index(first) + 1 if first in ordered else None,
        "rises_most": ordered[:3],
        "estimate": estimate,
        "estimate_control": before,
        "recovered": change / sought["size"] if change is not None else None,
    }


def of_calm(truth: Truth, own: Verdict) -> dict[str, Any]:
    """A row of the table of indoor cases without anything put in."""
    named = among_named(own)
    return {
        "case": truth["case"],
        "family": truth["family"],
        "kind": truth["kind"],
        "fitted_to": truth["fitted_to"],
        "verdict": own["verdict"],
        "said": sorted(reported_set(own)),
        "unknown": included(own, [UNKNOWN]),
        "environment": included(own, ENVIRONMENT),
        "first_named": next(iter(named), ""),
        "share_environment": _environment_share(own),
        "environment_named": names_environment(own),
        "alarm": included(own, ENVIRONMENT) >= ALARM or names_environment(own),
        "closure": (own["closure"] or {}).get("value"),
    }


def _environment_share(own: Verdict) -> float | None:
    """Share of the named answers' probability that those with something of the environment have."""
    named = [c for c in own["candidates"] if c["effects"] and c["effects"] != [UNKNOWN]]
    total = float(sum(c["probability"] for c in named))
    of_it = float(sum(c["probability"] for c in named if set(c["effects"]) & set(ENVIRONMENT)))
    return of_it / total if total > 0.0 else None


def of_wind(truth: Truth, own: Verdict) -> dict[str, Any]:
    """A row of the table of days on the pond: the wind that was said, and the measured one."""
    north, east = (parameter(own, "wind", name) for name in ("north", "east"))
    row: dict[str, Any] = {
        "case": truth["case"], "family": truth["family"], "day": truth["day"], "verdict": own["verdict"],
        "said": sorted(reported_set(own)), "named": "wind" in reported_set(own),
        "force": None, "called_wind": False, "turns": truth["day"] in TURNS,
        "probability": included(own, ["wind"]), "environment": included(own, ENVIRONMENT),
        "unknown": included(own, [UNKNOWN]), "share": among_named(own).get("wind", 0.0), "rank": rank(own, ["wind"]),
        "evidence": evidence(own).get("wind"), "measured": truth["wind"]["day"], "estimate": None, "off": None,
        "closure": (own["closure"] or {}).get("value"),
    }  # fmt: skip
    if north and east:
        wind = {
            "x": north[0], "y": east[0], "dx": north[1], "dy": east[1], "speed": math.hypot(north[0], east[0]),
            "towards": math.atan2(east[0], north[0]),
        }  # fmt: skip
        row |= {"estimate": wind, "off": difference(wind, truth["wind"]["day"])}
    force = [cause for cause in named_causes(own) if is_within(cause["cause"], FORCE) and "wind" in cause["effects"]]
    if force:
        row |= {"force": _direction_off(own, force[0], truth["wind"]["day"]["towards"])}
        row["called_wind"] = is_within(force[0]["cause"], WIND)
    return row


def names_environment(own: Verdict) -> bool:
    """Whether a verdict names something of the environment, at any level."""
    return any(is_within(cause["cause"], "environment") for cause in named_causes(own))


def _direction_off(own: Verdict, cause: Mapping[str, Any], towards: float) -> float:
    """rad from the measured direction to that of a cause's first effect that has one; NaN where none was fitted."""
    for name in cause["effects"]:
        north, east = (parameter(own, name, word) for word in ("north", "east"))
        if north and east:
            return math.remainder(math.atan2(east[0], north[0]) - towards, math.tau)
    return math.nan


def difference(estimated: Mapping[str, float], measured: Mapping[str, float]) -> dict[str, Any]:
    """Direction (rad, -pi to pi) and speed (ratio) of an estimated wind against a measured one; `near` if both fit."""
    turned = math.remainder(estimated["towards"] - measured["towards"], math.tau)
    ratio = estimated["speed"] / max(measured["speed"], 1e-9)
    return {"towards": turned, "speed": ratio, "near": abs(turned) <= TOWARDS and abs(ratio - 1.0) <= SPEED}


def summary(
    wind: Sequence[Mapping[str, Any]],
    by_run: Sequence[Mapping[str, Any]],
    put: Sequence[Mapping[str, Any]],
    calm: Sequence[Mapping[str, Any]],
) -> list[Measure]:
    """Shares over cases. `by_run` are rows of runs on the pond with what the others' wind predicts (see `left_out`)."""
    known = [row for row in put if row["rise"] is not None]
    turning = [row for row in wind if row["turns"]]
    basin = [row["environment"] for row in put if not row["family"].startswith("pond")]
    basin += [row["environment_named"] for row in calm]
    called = [row for row in wind if row["called_wind"] and row["off"]]
    return [
        share("error put in is named", put, lambda r: r["named"], NAMED_GOAL),
        share("environment named in a basin, whatever was put in", basin, lambda blamed: blamed, 0.0, most=True),
        share("force fixed to the earth, wind among it, within 30 deg, on days with turns", turning,
              lambda r: r["force"] is not None and abs(r["force"]) <= TOWARDS, 1.0),
        share("its speed is 0.7 to 1.4 of the measured, where it is called wind", called,
              lambda r: CALLED[0] <= r["off"]["speed"] <= CALLED[1], 1.0),
        share("error put in is the first named cause", put, lambda r: r["rank"] == 1, None),
        share("error put in is among the first three named causes", put, lambda r: (r["rank"] or 99) <= 3, None),
        share("evidence for it is higher than in the control", known, lambda r: r["rise"] > 0.0, None),
        share("no other effect's evidence rises as much", known, lambda r: r["rise_rank"] == 1, None),
        share(f"its size is recovered within {NEAR:.0%}", put,
              lambda r: r["recovered"] is not None and abs(r["recovered"] - 1.0) <= NEAR, None),
        share("wind named on a day with wind", wind, lambda r: r["named"], None),
        share("wind of the day within 30 deg and half its speed", wind,
              lambda r: r["off"] is not None and r["off"]["near"], None),
        share("wind of the other runs within 30 deg and half its speed", by_run,
              lambda r: r["off_others"]["near"], None),
        share("a run left out is met better with the wind of the others", by_run,
              lambda r: r["estimated"] < 1.0, None),
        share("a run left out is met better with the measured wind", by_run, lambda r: r["with_measured"] < 1.0, None),
        share("environment blamed in a calm basin", calm, lambda r: r["alarm"], 0.0, most=True),
    ]  # fmt: skip
