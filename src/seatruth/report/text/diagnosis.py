"""What a diagnosis says about its verdict, in the sentences that its report and the terminal share.

The headline itself is `Verdict.sentence` (`seatruth.diagnosis.sentences`); the sentences here stand below it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

from seatruth.diagnosis.results import Diagnosis
from seatruth.diagnosis.sentences import (
    cause_in_words,
    chance,
    ends_in_words,
    meets_noise,
    no_share_in_words,
    shrinks_surely,
    strays,
    unproven_in_words,
    whole_percent,
)
from seatruth.diagnosis.settings import Settings
from seatruth.diagnosis.verdict import UNKNOWN, EffectParameter, EffectResult, NamedCause, answer
from seatruth.effects.base import NO_ENVIRONMENT, UNDECLARED
from seatruth.effects.causes import CAUSES
from seatruth.report.numbers import MINUS, estimate, interval, listed, number, percent, shown
from seatruth.report.readings import without_folders
from seatruth.report.text.gap import PROBABLE, WORTH_MENTION, ranked

SURE = 0.9
"""Probability from which a named cause is called named, below it likely. Chosen here [S]."""

NEAR = Settings().apart
"""Pairwise noncentrality below which two effects count as not distinguishable."""
_ROUNDED = 0.005
"""Difference of two probabilities that is seen in print. Chosen here [S]."""
_RATES = {"surge": "du/dt", "sway": "dv/dt", "heave": "dw/dt", "roll": "dp/dt", "pitch": "dq/dt", "yaw": "dr/dt"}

_EXPONENT = re.compile(r"(?<![\w.])(\d+(?:\.\d+)?e-0?[1-6])(?!\d)")


def readable(sentence: str) -> str:
    """A sentence of the diagnosis as it is printed: ± for +-, small numbers without exponents."""

    def plain(match: re.Match[str]) -> str:
        digits = len(match[1].partition("e")[0].partition(".")[2]) + int(match[1].partition("e-")[2])
        return f"{float(match[1]):.{digits}f}"

    return _EXPONENT.sub(plain, sentence.replace("+-", "±"))


def capitalized(sentence: str) -> str:
    """With its first letter as a capital; the others stay."""
    return sentence[:1].upper() + sentence[1:]


def node_in_words(node: str) -> str:
    """A node of the tree of causes: its title, or its path where a plug-in's node is not in the tree."""
    return CAUSES.get(node, node.rpartition(".")[2].replace("_", " "))


def titles(diagnosis: Diagnosis) -> dict[str, str]:
    """Title of every effect that took part, by name."""
    return {effect.name: effect.title for effect in diagnosis.effects}


def in_titles(diagnosis: Diagnosis, effects: Sequence[str]) -> str:
    """A set of effects in words."""
    known = titles(diagnosis)
    return answer(tuple(known.get(name, name) for name in effects))


def errors_of_data(diagnosis: Diagnosis) -> list[str]:
    """Errors in the data, which make the whole diagnosis unreliable."""
    return list(dict.fromkeys(f"{f.message} {f.do}".strip() for f in diagnosis.findings if f.severity == "error"))


def data_first(diagnosis: Diagnosis) -> str:
    """The warning that stands above any verdict on data with errors; empty where there are none."""
    wrong = errors_of_data(diagnosis)
    if not wrong:
        return ""
    more = " There is one more error." if len(wrong) == 2 else ""
    more = f" There are {len(wrong) - 1} more errors." if len(wrong) > 2 else more
    first = without_folders(next(f.where for f in diagnosis.findings if f.severity == "error"))
    return f"The data first: {first}: {wrong[0]}{more} Correct this before you believe what follows."


def predicts(diagnosis: Diagnosis) -> bool:
    """Whether the verdict's effects were shown to shrink the gap on trials left out."""
    return diagnosis.validation is not None and shrinks_surely(diagnosis.validation)


def large(diagnosis: Diagnosis) -> list[NamedCause]:
    """Named causes of practical size."""
    return [cause for cause in diagnosis.verdict.causes if not cause.small]


def is_sure(diagnosis: Diagnosis) -> bool:
    """Whether the verdict can be taken as it stands."""
    verdict = diagnosis.verdict
    if errors_of_data(diagnosis) or diagnosis.outcome.get("code") != "done":
        return False
    if verdict.kind == "no_gap":
        return True
    believable = not any(cause.implausible for cause in verdict.causes)
    named = verdict.kind in ("effects", "inseparable") and bool(large(diagnosis)) and verdict.probability >= SURE
    return named and believable and predicts(diagnosis) and not strays(diagnosis.shares)


def headline(diagnosis: Diagnosis) -> str:
    """The verdict in a few words, no surer than its evidence."""
    if errors_of_data(diagnosis):
        return "The data have errors"
    said = _said(diagnosis)
    return said if diagnosis.outcome.get("code") == "done" else f"So far: {said[0].lower()}{said[1:]}"


def _said(diagnosis: Diagnosis) -> str:
    verdict, causes = diagnosis.verdict, large(diagnosis)
    if verdict.kind == "no_gap":
        return "No gap beyond the noise"
    if verdict.kind == "underpowered":
        return "These trials cannot decide"
    if verdict.kind == "unknown":
        small = meets_noise(diagnosis.shares)
        return "A small rest without a known cause" if small else "No cause of the library"
    if not causes:
        return "No cause of practical size"
    if all(cause.implausible for cause in causes):
        return "It looks like a known cause, but of an implausible size"
    if verdict.kind == "inseparable":
        return "A kind of cause is named" if is_sure(diagnosis) else "A likely kind of cause"
    if is_sure(diagnosis):
        return "A cause is named" if len(causes) == 1 else "Causes are named"
    return "A likely cause" if len(causes) == 1 else "Likely causes"


def verdict_in_words(diagnosis: Diagnosis) -> str:
    """The headline sentence of the diagnosis."""
    return readable(diagnosis.verdict.sentence)


def cause_short(diagnosis: Diagnosis, cause: NamedCause) -> str:
    """A named cause with its members by title."""
    known = titles(diagnosis)
    if len(cause.effects) == 1:
        return readable(cause_in_words(cause))
    return f"{cause.title} ({' or '.join(known.get(name, name) for name in cause.effects)})"


def remark(cause: NamedCause) -> str:
    """What limits a named cause, for a column of a table."""
    parts = ["looks like it"] if cause.implausible else []
    parts += ["negligible part of the gap"] if cause.small else []
    parts += ["small for what it is"] if cause.over_typical < Settings.tiny else []
    return ", ".join([*parts, "share of what is explained, since runs stray"] if cause.of_evidence else parts)


def cause_size(diagnosis: Diagnosis, cause: NamedCause) -> str:
    """The size of a named cause; of each of its effects where several look alike and each has another one."""
    if len(cause.effects) > 1 and cause.sizes and all(cause.sizes):
        return readable(" or ".join(cause.sizes))
    first = next((effect for effect in diagnosis.effects if effect.name == cause.effects[0]), None)
    return readable(cause.in_words) or (parameters_in_words(first) if first else "")


def unnamed_in_words(diagnosis: Diagnosis) -> str:
    """Effects that are probable and that the headline does not speak of, with the reason; '' where there are none."""
    named = {name for cause in diagnosis.verdict.causes for name in cause.effects}
    told = diagnosis.verdict.sentence
    left = [
        one
        for one in diagnosis.effects
        if one.probability >= PROBABLE and one.name not in named and one.title not in told
    ]
    if not left:
        return ""
    shares = listed([f"{one.title} ({chance(one.probability)})" for one in left], 4)
    them = "it" if len(left) == 1 else "them"
    return f"Probable in these fits, and not named, since nothing beyond them bears {them} out: {shares}."


def parameters_in_words(effect: EffectResult) -> str:
    """An effect's parameters with their standard errors in the units of the page."""
    if effect.in_words:
        return readable(effect.in_words)
    return ", ".join(f"{q.name.replace('_', ' ')} {' '.join(value_and_unit(q))}".strip() for q in effect.parameters)


def value_and_unit(q: EffectParameter) -> tuple[str, str]:
    """ "1.15 ± 0.23" and "deg"."""
    scale = shown(q.name, q.unit)
    value, error = q.value * scale.factor, q.stderr * scale.factor
    if not (math.isfinite(error) and error > 0):
        return number(value, 3), scale.unit
    return f"{estimate(value, error)} ± {number(error, 2)}", scale.unit


def interval_in_words(q: EffectParameter) -> str:
    """The 95 % interval in the unit of the page."""
    factor = shown(q.name, q.unit).factor
    return interval(q.lower * factor, q.upper * factor, q.stderr * factor)


def which_in_words(diagnosis: Diagnosis) -> str:
    """The answer to "which", with how sure."""
    verdict = diagnosis.verdict
    sure = chance(verdict.probability)
    if verdict.causes:
        causes = [cause_short(diagnosis, cause) for cause in verdict.causes]
        text = f"{capitalized('; '.join(causes))}. Probability {sure}."
        text += " Beside it, the structure of the model lacks something." if verdict.discrepancy else ""
        return f"{text}{_runner_up(diagnosis)}"
    if verdict.kind == "unknown":
        return f"None of the {len(diagnosis.effects)} effects that took part explains it. Probability {sure}."
    if verdict.kind == "no_gap":
        return f"No effect is needed. Probability {sure}."
    likely = [f"{in_titles(diagnosis, key)} ({chance(p)})" for key, p in diagnosis.answers() if p >= WORTH_MENTION]
    return f"No answer stands out. The most probable are {listed(likely, 4)}." if likely else "No answer stands out."


def _runner_up(diagnosis: Diagnosis) -> str:
    """The next probable answer where it counts, and what the named effects are easily taken for."""
    named = {name for cause in diagnosis.verdict.causes for name in cause.effects}
    rest = [(key, p) for key, p in diagnosis.answers() if not key or not set(key) <= named]
    text = ""
    if rest and rest[0][1] >= WORTH_MENTION:
        key, probability = rest[0]
        beside = tuple(name for name in key if name not in named)
        if all({*cause.effects} & {*key} for cause in diagnosis.verdict.causes):
            text = f" The most probable answer holds {in_titles(diagnosis, beside)} as well ({chance(probability)}), "
            text += f"which {'is' if len(beside) == 1 else 'are'} not named."
        else:
            text = f" The next probable answer is {in_titles(diagnosis, key)} ({chance(probability)})."
    known = titles(diagnosis)
    near = [
        known.get(other, other)
        for effect in diagnosis.effects
        if effect.name in diagnosis.named
        for other, value in effect.confusable.items()
        if value < NEAR and other not in named
    ]
    if near:
        text += f" These trials hardly tell it from {listed(list(dict.fromkeys(near)), 4)}."
    return text


def validation_in_words(diagnosis: Diagnosis) -> str:
    """The gap explained on trials left out with its interval, beside the control."""
    validation = diagnosis.validation
    alone = len(diagnosis.trials) < 2
    if alone and (validation is None or not diagnosis.named):
        return "One trial alone: nothing can be left out."
    if not diagnosis.named:
        return "The verdict names no effect, so there is nothing to test on trials left out."
    if validation is None:
        return "This run left no trial out, so this is not known."
    if not math.isfinite(validation.gap_explained):
        return no_share_in_words(validation)
    ends = ends_in_words(validation)
    share = whole_percent(validation.gap_explained)
    own = ", the size that one has of its own in each fitted to that trial" if validation.own_sizes else ""
    text = (
        f"The effects explain {share} of the gap on trials left out{own} ({ends})."
        if shrinks_surely(validation)
        else f"{capitalized(unproven_in_words(validation))}."
    )
    # Exactly none is what a refit without free terms explains: of a simulator without ports there are none.
    if math.isfinite(validation.control) and validation.control != 0.0:
        nearer = f"explain {whole_percent(validation.control)}" if validation.control > 0.0 else "come no nearer"
        text += f" Free terms in the equations, fitted instead of effects, {nearer}."
    return f"{text} Left out were sections of the one trial, whose others are less of a check." if alone else text


def next_in_words(diagnosis: Diagnosis, *, detailed: bool = True) -> str:
    """The next trial and what it would bring; `detailed` says also what the crew does."""
    suggested = diagnosis.next_trial
    if suggested is None:
        return "This run did not look for one."
    if len(suggested.survivors) < 2:
        if diagnosis.verdict.kind in ("unknown", "underpowered"):
            return "None is suggested: a trial is chosen to separate effects in question, and no two of them are."
        return "No two effects of the library are left that a further trial would have to separate."
    causes = listed([survivor(diagnosis, name) for name in suggested.survivors], 4)
    if not suggested.manoeuvre:
        return f"No trial on the menu is likely to double what separates {causes}."
    now, then = (math.sqrt(max(x, 0.0)) for x in (suggested.noncentrality_now, suggested.noncentrality_then))
    about = f" ({suggested.text})" if suggested.text and detailed else ""
    size = f"from {number(now, 2)} to {number(then, 2)} standard deviations"
    grows = f"the distance of the most probable one from the nearest other grows {size}"
    trial = f"{capitalized(suggested.manoeuvre)}{about}"
    # Members of one cause are apart by their exact forms, which the verdict does not take for known.
    alike = any(len({*cause.effects} & {*suggested.survivors}) > 1 for cause in diagnosis.verdict.causes)
    if suggested.noncentrality_now >= NEAR and not alike:
        return f"These trials already distinguish {causes}. {trial} would separate them further: {grows}."
    still = "" if suggested.noncentrality_then >= NEAR else " That is still too little to distinguish them."
    return f"{trial}. It would best separate {causes}: {grows}.{still}"


def survivor(diagnosis: Diagnosis, name: str) -> str:
    """Title of a cause that is left."""
    return "a cause that is not in the library" if name == UNKNOWN else titles(diagnosis).get(name, name)


def beside_answers_in_words(diagnosis: Diagnosis) -> str:
    """Says that the answers' effects have something beside them that is not in the library; '' where they have not.

    With how probable it is in all, which is what the verdict says of it.
    """
    sets = [one for one in diagnosis.hypotheses if one.effects]
    whole = sum(one.probability for one in sets)
    beside = sum(one.probability for one in sets if one.discrepancy)
    unknown = sum(one.probability for one in diagnosis.hypotheses if one.discrepancy)
    refused = diagnosis.verdict.kind == "unknown" and diagnosis.verdict.probability > unknown + _ROUNDED
    if whole >= WORTH_MENTION and refused:
        return "The headline counts effects of these answers that it does not name as a cause that the library lacks."
    if whole < WORTH_MENTION or beside <= 0.5 * whole:
        return ""
    return (
        "Where effects are the answer, something most probably acts beside them that is not in the library: alone or "
        f"beside them {chance(min(unknown, 1.0))}."
    )


def undeclared_in_words(diagnosis: Diagnosis) -> str:
    """Effects that took no part for want of a function of the model; '' where there are none."""
    lacking: dict[str, list[str]] = {}
    for name, why in diagnosis.unavailable.items():
        if why.startswith(UNDECLARED):
            role = why.removeprefix(UNDECLARED).strip()
            lacking.setdefault(f"The model does not declare its {role}", []).append(name.replace("_", " "))
        elif why.startswith(NO_ENVIRONMENT):
            lacking.setdefault("No outside force can act on the model, as its rhs takes no e", []).append(
                name.replace("_", " ")
            )
    return " ".join(
        f"{reason}, so {listed(names, 4)} took no part. "
        f"If {'one' if len(names) > 1 else 'it'} acts, the cause is unknown, or passes for another."
        for reason, names in lacking.items()
    )


def undetectable(diagnosis: Diagnosis) -> list[EffectResult]:
    """Effects that these trials could not have shown at their typical magnitude.

    Not what they do show, nor a fault of one actuator beside that of all.
    """
    wholes = {effect.title for effect in diagnosis.effects}
    return [
        effect
        for effect in diagnosis.effects
        if effect.typical
        and effect.probability < PROBABLE
        and effect.title not in diagnosis.verdict.sentence
        and not any(effect.title.startswith(f"{whole}: ") for whole in wholes)
        and not any(effect.detectable.get(q, math.inf) <= size for q, size in effect.typical.items())
    ]


def undetectable_in_words(diagnosis: Diagnosis) -> str:
    """Names of the same; empty where there are none."""
    weak = [effect.title for effect in undetectable(diagnosis)]
    return f"At their typical magnitude these trials could not have shown: {listed(weak, 12)}." if weak else ""


def formula_in_words(diagnosis: Diagnosis) -> list[str]:
    """The missing accelerations as formulas over the motion, one per equation: "add to dr/dt: 0.25 v r − 0.02"."""
    if diagnosis.discrepancy is None:
        return []
    found = []
    for equation in dict.fromkeys(term.equation for term in diagnosis.discrepancy.terms):
        terms = [term for term in diagnosis.discrepancy.terms if term.equation == equation]
        texts = [number(q.coefficient, 3) + ("" if q.term == "1" else f" {q.term}") for q in terms]
        right = " + ".join(texts).replace(f"+ {MINUS}", f"{MINUS} ")
        unit = next((q.unit.replace("^2", "²") for q in terms if q.unit), "")
        found.append(f"add to {_RATES.get(equation, f'd{equation}/dt')}: {right}{f' ({unit})' if unit else ''}")
    return found


def lacks_in_words(diagnosis: Diagnosis) -> str:
    """How much the structure lacks, in one sentence."""
    missing = diagnosis.discrepancy
    if missing is None:
        return "For this model no missing forces can be estimated."
    sizes = [(name, size) for name, size in ranked(missing.sizes) if size >= 0.005]
    if not sizes:
        return "The trials show no missing forces beside the effects of the verdict."
    parts = [f"{percent(size)} of the usual acceleration in {name}" for name, size in sizes[:3]]
    text = f"Beside the effects of the verdict, missing forces have a size of {listed(parts)}"
    return f"{text} (log-evidence {number(missing.log_evidence, 3)} over none)."
