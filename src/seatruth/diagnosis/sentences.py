"""The verdict in plain words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any


def sentence(
    verdict: Mapping[str, Any],
    which: Sequence[Mapping[str, Any]],
    shares: Mapping[str, float],
    how_far: Mapping[str, Any] | None,
    unnamed: Mapping[str, Any] | None,
) -> str:
    """One to three sentences: what, how sure, how far."""
    by_name = {row["name"]: row for row in which}
    kind, chance = verdict["kind"], f"probability {verdict['probability']:.0%}"
    if kind == "effects":
        causes = " and ".join(_cause(by_name[name]) for name in verdict["effects"])
        gap = "A part of the gap" if verdict["beside"] else "The gap"
        return f"{gap} comes from {causes} ({chance}).{_beside(verdict, unnamed)}{_shrinks(how_far)}"
    if kind == "inseparable":
        titles = ", ".join(by_name[name]["title"] for name in verdict["set"])
        rest = _beside(verdict, unnamed)
        return f"One of these causes the gap, and these trials cannot tell which: {titles} (together {chance}).{rest}"
    if kind == "unknown":
        where = f" It acts most like {_acting(str(unnamed['equation']))}." if unnamed else ""
        return f"Something acts that is not in the library ({chance}).{where}"
    weak = verdict["powerless"]
    if kind == "no_gap":
        rest = f" These trials could not have shown {_listing(weak, by_name)}." if weak else ""
        most = max((row["probability"] for row in which), default=0.0)
        others = f"; no cause is likelier than {most:.0%}, what remains is too weak to show"
        return f"No gap beyond the noise and the coefficients' own uncertainty ({chance}{others}).{rest}"
    if verdict["set"]:
        return (
            f"No cause stands out. The likeliest are {_listing(verdict['set'], by_name)}, together {chance}; "
            "the trials do not say enough."
        )
    return (
        f"No gap is seen ({chance}), but these trials could not have shown {_listing(weak, by_name)} "
        "at a typical magnitude."
    )


def _beside(verdict: Mapping[str, Any], unnamed: Mapping[str, Any] | None) -> str:
    if not verdict["beside"]:
        return ""
    like = f", most like {_acting(str(unnamed['equation']))}" if unnamed else ""
    return f" Beside that acts something that is not in the library{like}."


def _acting(equation: str) -> str:
    motion = equation in ("surge", "sway", "heave", "roll", "pitch", "yaw")
    return f"a force in {equation}" if motion else f"a term in the equation of {equation}"


def _cause(row: Mapping[str, Any]) -> str:
    if row["in_words"]:
        return f"{row['title']} of {row['in_words']}"
    values = ", ".join(
        f"{v['name']} {v['value']:.3g} +- {v['stderr']:.2g}{'' if v['unit'] == '1' else ' ' + v['unit']}"
        for v in row["parameters"]
    )
    return f"{row['title']} ({values})"


def _shrinks(how_far: Mapping[str, Any] | None) -> str:
    closure = (how_far or {}).get("closure")
    if not closure or not isinstance(closure["value"], float) or closure["value"] != closure["value"]:
        return ""
    return (
        f" On trials left out it closes {closure['value']:.0%} of the gap that refitting leaves "
        f"({closure['lower']:.0%} to {closure['upper']:.0%})."
    )


def _listing(names: Sequence[str], by_name: Mapping[str, Mapping[str, Any]]) -> str:
    titles = [str(by_name[name]["title"]) for name in names if name in by_name]
    head = ", ".join(titles[:5])
    return f"{head} and {len(titles) - 5} more" if len(titles) > 5 else head
