"""What a diagnosis says, in the sentences that its report and the terminal share."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from seatruth.diagnosis.posterior import UNKNOWN
from seatruth.diagnosis.results import Diagnosis, answer
from seatruth.report.numbers import MINUS, Shown, listed, number, percent, shown

SURE = 0.9
"""Probability from which a named cause counts as found rather than as likely."""
HEADLINES = {
    "effects": "A cause is named",
    "no_gap": "No gap beyond the noise",
    "underpowered": "These trials do not say enough",
    "inseparable": "Causes that these trials cannot tell apart",
    "unknown": "Something that is not in the library",
}
"""Each kind of verdict in a few words."""

PLACES = {
    "surge": "the surge equation",
    "sway": "the sway equation",
    "heave": "the heave equation",
    "roll": "the roll equation",
    "pitch": "the pitch equation",
    "yaw": "the yaw equation",
    "kinematics": "the kinematics (motion over ground against motion through the water)",
}
"""Equations in words."""


_HARDLY = 1.2
"""RMSE over noise up to which nothing is missed; ratio of distances up to which a further trial brings nothing."""
NEAR = 11.0
"""Pairwise lambda below which two effects count as not told apart."""
_WORTH = 0.05
"""Probability from which the next likeliest answer is mentioned."""
_BESIDE = " Beside that acts something that is not in the library."
_CLOSES = 0.02
"""Closure below which nothing closes."""
_EXPONENT = re.compile(r"(?<![\w.])(\d+(?:\.\d+)?e-0?[1-6])(?!\d)")


def readable(sentence: str) -> str:
    """A sentence of the diagnosis as it is printed: ± for +-, small numbers without exponents."""

    def plain(match: re.Match[str]) -> str:
        digits = len(match[1].partition("e")[0].partition(".")[2]) + int(match[1].partition("e-")[2])
        return f"{float(match[1]):.{digits}f}"

    return _EXPONENT.sub(plain, sentence.replace("+-", "±").replace("%", " %").replace("  %", " %"))


def chance(probability: float) -> str:
    """A probability: never "100 %" or "0 %", which nothing is."""
    if probability >= 0.9995:
        return "over 99.9 %"
    return percent(probability, 3) if probability >= 5e-4 else "under 0.05 %"


def place_in_words(place: str) -> str:
    """ "sensor:u" as "the sensor of u"."""
    kind, _, channel = place.partition(":")
    if channel:
        return f"the {'sensor' if kind == 'sensor' else 'actuator'} of {channel}"
    return PLACES.get(place, f"the equation of {place}")


def titles(diagnosis: Diagnosis) -> dict[str, str]:
    """Title of every effect that took part, by name."""
    return {str(row["name"]): str(row["title"]) for row in diagnosis.effects}


def in_titles(diagnosis: Diagnosis, effects: Sequence[str]) -> str:
    """A candidate answer in words."""
    known = titles(diagnosis)
    return answer([known.get(name, name) for name in effects])


def channels(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    """The gap by channel over all trials: channel, how it is `shown`, noise, rmse_* and multiple_* of before, refit,
    effect; the rmse pooled over samples."""
    found = []
    for name in dict.fromkeys(str(row["channel"]) for row in diagnosis.gap):
        rows = [row for row in diagnosis.gap if row["channel"] == name]
        weight = np.array([row["n"] for row in rows], dtype=float)
        one: dict[str, Any] = {"channel": name, "shown": shown(name, rows[0]["unit"]), "noise": rows[0]["noise"]}
        for fit in ("before", "refit", "effect"):
            squares = np.array([row[f"rmse_{fit}"] for row in rows], dtype=float) ** 2
            one[f"rmse_{fit}"] = float(np.sqrt((weight * squares).sum() / weight.sum()))
            one[f"multiple_{fit}"] = one[f"rmse_{fit}"] / one["noise"] if one["noise"] > 0 else math.nan
        found.append(one)
    return found


def errors_of_data(diagnosis: Diagnosis) -> list[str]:
    """What is wrong with the data so that nothing can be believed until it is put right."""
    return [f"{f.message} {f.do}".strip() for f in diagnosis.findings if f.severity == "error"]


def headline(diagnosis: Diagnosis) -> str:
    """The verdict in a few words."""
    said = diagnosis.verdict
    if errors_of_data(diagnosis):
        return "What the data say as they are"
    if said["kind"] == "effects" and said["probability"] < SURE:
        return "A likely cause"
    return HEADLINES[said["kind"]]


def data_first(diagnosis: Diagnosis) -> str:
    """The warning that stands above any verdict on data that are wrong; empty where they are not."""
    wrong = list(dict.fromkeys(errors_of_data(diagnosis)))
    if not wrong:
        return ""
    more = " There is one more error." if len(wrong) == 2 else ""
    more = f" There are {len(wrong) - 1} more errors." if len(wrong) > 2 else more
    return f"The data first: {wrong[0]}{more} Until this is put right, what follows is not to be believed."


def gap_in_words(diagnosis: Diagnosis) -> str:
    """How large the gap is before and after refitting, and its split."""
    rows = channels(diagnosis)
    if not rows:
        return ""
    worst = max(rows, key=lambda row: _or_zero(row["multiple_refit"]))
    if worst["multiple_refit"] < _HARDLY:
        before = max(_or_zero(row["multiple_before"]) for row in rows)
        text = (
            f"Refitted under its priors, the model meets every channel to its noise ({number(before, 2)} times before)."
        )
        text += " What it leaves is small, but of a shape that noise does not have." if diagnosis.named else ""
    else:
        sizes = [number(worst[key], 2) for key in ("multiple_refit", "multiple_before")]
        text = (
            f"Refitted under its priors, the model misses {worst['channel']} most: by {sizes[0]} times the noise "
            f"({sizes[1]} times before)."
        )
    split = diagnosis.shares
    parts = [
        f"{percent(split[key])} {words}"
        for key, words in (
            ("noise", "noise"),
            ("parameters", "wrong coefficients, which refitting removes"),
            ("effects", "the named effects" if diagnosis.named else "effects"),
            ("left", "not explained"),
        )
        if split[key] >= 0.005
    ]
    return f"{text} Of the misfit of the model as it was believed: {listed(parts)}."


def where_in_words(diagnosis: Diagnosis) -> str:
    """Equation or sensor, time, and region."""
    sentences = []
    named = list(
        dict.fromkeys(place for row in diagnosis.which if row["name"] in diagnosis.named for place in row["acts_on"])
    )
    places = [row for row in diagnosis.where["places"] if math.isfinite(row["log_evidence"])]
    if named:
        sentences.append(f"It acts in {listed([place_in_words(place) for place in named])}.")
    elif places and places[0]["log_evidence"] > 0:
        likely = [row for row in places if row["probability"] >= 0.05][:3]
        shares = [f"{place_in_words(row['place'])} ({chance(row['probability'])})" for row in likely]
        sentences.append(f"An unnamed cause would act most likely in {listed(shares)}.")
    elif places:
        sentences.append("Nothing speaks for a further force, actuator or sensor error anywhere.")
    rows = channels(diagnosis)
    seen = sorted((row for row in rows if row["multiple_refit"] > 1.5), key=lambda row: -row["multiple_refit"])
    if seen:
        multiples = [f"{row['channel']} ({number(row['multiple_refit'], 2)} × noise)" for row in seen[:4]]
        sentences.append(f"It shows in {listed(multiples)}.")
    time, region = stand_out(diagnosis, "time"), stand_out(diagnosis, "region")
    if time and len(time) == len(diagnosis.where["time"]):
        sentences.append("It shows at all times.")
    elif time:
        first = max(time, key=lambda row: row["misfit"])
        span = f"{first['trial']}, {number(first['from_s'])} to {number(first['to_s'])} s"
        sentences.append(f"In time it shows in {len(time)} of {len(diagnosis.where['time'])} parts, most in {span}.")
    if region:
        first = max(region, key=lambda row: row["misfit"])
        sentences.append(f"It is worst at {cell_in_words(first)}.")
    return " ".join(sentences)


def stand_out(diagnosis: Diagnosis, kind: str) -> list[dict[str, Any]]:
    """Cells of time or region that stand out with the false discovery rate held at 5 %."""
    return [row for row in diagnosis.where[kind] if row["stands_out"]]


def cell_in_words(row: Mapping[str, Any]) -> str:
    """ "speed 0.5 to 0.8 m/s", "heading north-east"."""
    if row["variable"] == "heading":
        return f"heading {row['cell']}"
    channel = shown(str(row["variable"]), str(row["unit"]))
    ends = " to ".join(number(row[key] * channel.factor, 3) for key in ("from", "to"))
    return f"{channel.name} {ends} {channel.unit}".strip()


def magnitude(q: Mapping[str, Any], key: str = "value") -> tuple[Shown, float]:
    """How a parameter of an effect is shown, and its value there."""
    scale = shown(str(q["name"]), str(q["unit"]))
    return scale, float(q[key]) * scale.factor


def parameters_in_words(row: Mapping[str, Any]) -> str:
    """An effect's parameters with their errors in units that are read."""
    if row["in_words"]:
        return readable(str(row["in_words"]))
    parts = []
    for q in row["parameters"]:
        scale, value = magnitude(q)
        error = float(q["stderr"]) * scale.factor
        plus = f" ± {number(error, 2)}" if error > 0 and math.isfinite(error) else ""
        parts.append(f"{q['name'].replace('_', ' ')} {number(value, 3)}{plus} {scale.unit}".rstrip())
    return ", ".join(parts)


def verdict_in_words(diagnosis: Diagnosis) -> str:
    """The verdict in one to three sentences, in the units of the page."""
    said = diagnosis.verdict
    if said["kind"] != "effects":
        return readable(str(said["sentence"]))
    by_name, known = {row["name"]: row for row in diagnosis.which}, titles(diagnosis)
    causes = [f"{known[name]} ({parameters_in_words(by_name[name])})" for name in said["effects"]]
    whole, rest = ("A part of the gap", _BESIDE) if said["beside"] else ("The gap", "")
    text = f"{whole} comes from {listed(causes)}, with probability {chance(said['probability'])}.{rest}"
    closure = (diagnosis.how_far or {}).get("closure")
    if not closure or not closure["value"] > _CLOSES:
        return text
    ends = f"{percent(closure['lower'])} to {percent(closure['upper'])}"
    return f"{text} On trials left out it closes {percent(closure['value'])} of what refitting leaves (95 %: {ends})."


def which_in_words(diagnosis: Diagnosis) -> str:
    """The answer to "which", with how sure."""
    said = diagnosis.verdict
    sure = chance(said["probability"])
    by_name = {row["name"]: row for row in diagnosis.which}
    known = titles(diagnosis)
    if said["kind"] == "effects":
        causes = [f"{known[name]}: {parameters_in_words(by_name[name])}" for name in said["effects"]]
        rest = _BESIDE if said["beside"] else ""
        return f"{'; '.join(causes)}. Probability {sure}.{rest}{_runner_up(diagnosis)}"
    if said["kind"] == "inseparable":
        return f"One of {listed([known[name] for name in said['set']], 8)}. Together: probability {sure}."
    if said["kind"] == "unknown":
        return f"None of the {len(diagnosis.effects)} effects that took part explains it. Probability {sure}."
    if said["kind"] == "no_gap":
        return f"No cause is needed. Probability {sure}."
    if said["set"]:
        return f"No cause stands out; the likeliest are {listed([known[n] for n in said['set'] if n in known])}."
    return f"No cause shows (probability {sure}), but too many could not have shown on these trials."


def _runner_up(diagnosis: Diagnosis) -> str:
    """The next likeliest answer where it is worth a thought, and what the named effects are easily taken for."""
    rest = [c for c in diagnosis.candidates if tuple(c["effects"]) != diagnosis.named]
    text = ""
    if rest and rest[0]["probability"] >= _WORTH:
        text = f" Next likeliest: {in_titles(diagnosis, rest[0]['effects'])} ({chance(rest[0]['probability'])})."
    known = titles(diagnosis)
    near = [
        known.get(other, other)
        for row in diagnosis.which
        if row["name"] in diagnosis.named
        for other, value in row["apart"].items()
        if value < NEAR and other not in diagnosis.named
    ]
    if near:
        text += f" These trials hardly tell it from {listed(list(dict.fromkeys(near)), 4)}."
    return text


def how_far_in_words(diagnosis: Diagnosis) -> str:
    """The closure with its interval, beside refitting alone and the flexible control."""
    far = diagnosis.how_far
    if far is None:
        return "Not asked: no trial was left out."
    if not far["folds"]:
        return str(far["why"])
    errors, closure = far["errors"], far["closure"]
    text = (
        f"A trial that took no part is missed by {number(errors['refit'], 3)} times the noise after refitting alone, "
        f"by {number(errors['effect'], 3)} with the effects that the other trials choose"
    )
    flexible = errors["flexible"]
    text += f", by {number(flexible, 3)} with flexible terms instead." if math.isfinite(flexible) else "."
    if closure is None or not math.isfinite(closure["value"]):
        return f"{text} Refitting leaves hardly any gap to close."
    if errors["refit"] < _HARDLY:
        return f"There is hardly any gap to close. {text}"
    if closure["value"] < _CLOSES:
        return f"No effect closes the gap on trials left out. {text}"
    ends = f"{percent(closure['value'])} of the gap (95 %: {percent(closure['lower'])} to {percent(closure['upper'])})"
    if diagnosis.named:
        return f"It closes {ends}. {text}"
    return f"No effect is named; the likeliest one would close {ends}. {text}"


def next_in_words(diagnosis: Diagnosis) -> str:
    """The next trial and what it would bring."""
    new = diagnosis.next_trial
    if new is None:
        return "No two causes survive that a further trial would have to tell apart."
    pair = listed([surviving(diagnosis, name) for name in new["menu"][0]["weakest"]])
    text = f"{new['manoeuvre']} ({new['text']})"
    now, then = math.sqrt(max(new["lambda_now"], 0.0)), math.sqrt(max(new["lambda_then"], 0.0))
    if not (new["gain"] > _HARDLY**2 or then > max(0.1, _HARDLY * now)):
        return f"None on the menu would tell {pair} apart noticeably better than these trials; the best is {text}."
    return (
        f"{text}. The true cause's distance to the nearest other one would grow about "
        f"{number(math.sqrt(max(new['gain'], 1.0)), 2)}-fold, in the mean over the survivors; the least of any two "
        f"({pair}) would go from {number(now, 2)} to {number(then, 2)} standard deviations."
    )


def surviving(diagnosis: Diagnosis, name: str) -> str:
    """A survivor's title."""
    return "something without a name" if name == UNKNOWN else titles(diagnosis).get(name, name)


def weak_in_words(diagnosis: Diagnosis) -> str:
    """Effects that these trials could not have shown."""
    weak = [titles(diagnosis).get(name, name) for name in diagnosis.verdict["powerless"]]
    if not weak:
        return ""
    return f"At their typical magnitude these trials could not have shown: {listed(weak, 12)}."


def formula_in_words(unnamed: Mapping[str, Any]) -> str:
    """The missing acceleration as a formula over the motion in SI units."""
    factors = [(number(row["factor"], 3), str(row["term"])) for row in unnamed["formula"]]
    terms = [factor if term == "1" else f"{factor} {term}" for factor, term in factors]
    left = {"surge": "du/dt", "sway": "dv/dt", "heave": "dw/dt", "roll": "dp/dt", "pitch": "dq/dt", "yaw": "dr/dt"}
    equation = str(unnamed["equation"])
    sides = " + ".join(terms).replace(f"+ {MINUS}", f"{MINUS} ")
    return f"add to {left.get(equation, f'd{equation}/dt')}: {sides} (SI units)"


def _or_zero(value: float) -> float:
    return value if math.isfinite(value) else 0.0
