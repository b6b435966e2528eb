"""The verdict as the sentences that stand above everything else: never surer than the evidence below them.

>>> from seatruth.diagnosis.parts import Shares
>>> from seatruth.diagnosis.verdict import NamedCause
>>> current = NamedCause(
...     cause="environment.moving_water.uniform_current",
...     title="a uniform current",
...     effects=("current",),
...     probability=0.97,
...     in_words="0.21 +- 0.03 m/s towards 40 +- 8 deg",
...     share=0.9,
...     small=False,
...     implausible=False,
... )
>>> shares = Shares(0.1, 0.2, 0.65, 0.05, 10.0, 8.0, 1.1)
>>> print(verdict_sentence("effects", [current], 0.97, False, shares, None, one_trial=False)[:95])
The gap comes from a uniform current of 0.21 +- 0.03 m/s towards 40 +- 8 deg (probability 97 %)
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from seatruth.diagnosis import look_alikes as like
from seatruth.diagnosis.parts import Shares, Validation
from seatruth.diagnosis.settings import Settings
from seatruth.diagnosis.verdict import Kind, NamedCause
from seatruth.text import listed

AT_NOISE = 1.2
"""Root mean square error over noise up to which a model is said to meet its noise. Chosen here [S]: what is left is
then at most 0.7 of the noise's standard deviation."""
_USUAL = 4.0
"""Root mean square error over noise up to which vehicles with nothing wrong often differ from their refitted models.
[S] On three benches where nothing acted it was 1.4 to 2.2; with a stern plane 1.5 deg off 5.8, a loose panel 12."""
_MOST = 0.5
"""Part of the gap that is surely explained from which it is most of it."""
_NO_BOUND = 2.0
"""Width of the interval of the part that is explained from which it is not said. [S] From nothing to twice the gap."""
_SIZED = 3
"""Effects that look alike of which each is told with its size. Chosen here [S]."""
_LACKS = "The model also lacks something that no effect of the library describes."
_STOPPED = "The search was stopped before all effects were compared: this is what it had reached."
_LOOKS = "It looks like"
_LITTLE_LEFT = "What is left is small, but more than noise: no effect of the library describes it."


def verdict_sentence(
    kind: Kind,
    causes: Sequence[NamedCause],
    probability: float,
    discrepancy: bool,
    shares: Shares,
    validation: Validation | None,
    one_trial: bool,
    form: Sequence[str] = (),
    curve: Sequence[str] = (),
    damping: bool = False,
    part: Sequence[str] = (),
    refused: Sequence[str] = (),
    along: Sequence[str] = (),
    small: Sequence[str] = (),
    outdone: Sequence[str] = (),
    untried: Sequence[str] = (),
    drift: Sequence[str] = (),
    turning: Sequence[str] = (),
    vague: Sequence[str] = (),
    own: Sequence[str] = (),
    acts: bool = False,
    stopped: bool = False,
) -> str:
    """The headline of a diagnosis in one to four sentences.

    Args:
        kind: of the verdict.
        causes: what the verdict names, each at its level of the tree of causes.
        probability: of the verdict.
        discrepancy: whether the model also lacks something that no effect describes.
        shares: the split of the misfit.
        validation: prediction of trials that were left out, or None.
        one_trial: whether there is one trial only, so that none can be left out.
        form: titles of effects that fit as a hull of another form does.
        curve: titles of forms of the model that fit where no such effect does.
        damping: whether all of these are damping or drag of another form.
        part: titles of terms of the model's forces that are probable, and not named since others are missing.
        refused: titles of effects that are probable, and not named since they do not surely predict trials left out.
        along: titles of effects that keep their direction on the earth, and are not named since all trials are on one
            course.
        small: titles of effects that are significant beside an unknown cause, but close next to none of the gap.
        outdone: titles of effects that explain the trials, but predict those left out worse than terms in the
            equations do.
        untried: titles of effects that may as well be something that cannot be tried on the model.
        drift: titles of errors of positions that a model with another drift in turns shows as well.
        turning: titles of equal delays of the heading and the rate of turn, which a later steering shows as well.
        own: what errors of sensors close in their own channels, where the gap does not shrink surely over all.
        vague: titles of effects of different kinds that look alike, too many to be one cause.
        acts: whether it is sure that something acts, where these trials cannot decide what.
        stopped: whether the search ended before all effects were compared.

    Returns:
        Plain text; "+-" stands before standard errors.
    """
    first = _STOPPED if stopped else ""
    tiny = f"but of no practical size: {listed(small)}." if small else ""
    if kind == "no_gap":
        text = "There is no gap beyond the noise and the uncertainty of the coefficients"
        return _joined(first, f"{text} (probability {chance(probability)}).", _small(causes))
    if kind == "underpowered":
        looks = like.part_of_it(part), like.unpredictive(refused), tiny and f"Significant {tiny}"
        return _joined(first, _undecided(causes, vague, probability, acts=acts), _lacks(discrepancy), *looks)
    beside = tiny and f"Significant beside it, {tiny}"
    if kind == "unknown":
        said = _unknown(causes, probability, shares)
        form_or_course = (
            like.of_another_form(form, curve, damping=damping and _is_usual(shares)),
            like.part_of_it(part),
            like.on_one_course(along),
            like.of_kinds(vague),
        )
        withdrawn = (
            like.outdone(outdone, beside=False),
            like.untried(untried, beside=False),
            like.drifting(drift, beside=False),
            like.turning(turning, beside=False),
        )
        return _joined(first, said, *form_or_course, like.unpredictive(refused), *withdrawn, beside)
    rest = (
        like.outdone(outdone, beside=True),
        like.untried(untried, beside=True),
        like.drifting(drift, beside=True),
        like.turning(turning, beside=True),
    )
    named = _named(causes, probability, discrepancy, shares, validation, one_trial)
    return _joined(first, named, *own, *rest, beside)


def chance(probability: float) -> str:
    """A probability in per cent; it is never "100 %" or "0 %", because no probability here is known that well."""
    if probability >= 0.9995:
        return "over 99.9 %"
    return f"{100.0 * probability:.3g} %" if probability >= 5e-4 else "under 0.05 %"


def whole_percent(part: float) -> str:
    """A part of the gap in whole per cent, "93 %"."""
    return f"{round(100.0 * part)} %" if math.isfinite(part) else "unknown"  # never "-0 %"


def cause_in_words(cause: NamedCause) -> str:
    """A cause at its level, with its size: "a uniform current of 0.21 +- 0.03 m/s towards 40 +- 8 deg".

    Effects that the trials cannot tell apart are listed; they have a direction in common, but not a size.
    """
    if len(cause.effects) == 1:
        if not cause.in_words:
            return cause.title
        number_first = cause.in_words[:1].isdigit()
        return f"{cause.title} of {cause.in_words}" if number_first else f"{cause.title} ({cause.in_words})"
    # Whether a wind was the same in all trials is no other cause.
    names = [name.removeprefix("trial_").replace("_", " ") for name in cause.effects]
    members = list(dict.fromkeys(names))
    if len(members) == len(cause.sizes) <= _SIZED and all(cause.sizes):
        # One of two engines gives 12 % less, or the other one 14 % more: each asks for another repair.
        members = [f"{name} ({size})" for name, size in zip(names, cause.sizes)]
    direction = cause.direction or cause.in_words.partition("towards ")[2]
    titled = f"{cause.title}{f', towards {direction}' if direction else ''}"
    if len(members) == 1:
        titled += f" ({cause.in_words})" if cause.in_words and not direction else ""
        return f"{titled}, which may differ from trial to trial"
    return f"{titled}: {', '.join(members[:-1])} or {members[-1]}, which these trials cannot tell apart"


_CHANCE = 0.025
"""Probability of as many trials in which an error falls, were it as likely to rise. Convention."""


def meets_noise(shares: Shares) -> bool:
    """Whether the refitted model leaves hardly more than noise."""
    return math.sqrt(max(shares.misfit_refit, 0.0)) <= AT_NOISE


def _is_usual(shares: Shares) -> bool:
    """Whether what the refitted model leaves is no more than vehicles with nothing wrong often have."""
    return math.sqrt(max(shares.misfit_refit, 0.0)) <= _USUAL


def strays(shares: Shares) -> bool:
    """Whether the model with the effects of the verdict strays from the trials, once missing forces do not hold it."""
    return shares.misfit_effects > Settings.stray


def no_share_in_words(validation: Validation) -> str:
    """Why no part of the gap can be given."""
    away = [fold.trial for fold in validation.folds if not math.isfinite(fold.error_refit + fold.error_effects)]
    if away:
        return f"Left out, {listed(away)} could not be predicted: the motion diverges."
    return "On trials left out the refitted model leaves no gap to explain."


def ends_in_words(validation: Validation) -> str:
    """The interval of the part of the gap that is explained; where that says nothing, in how many trials it shrinks."""
    if not validation.upper - validation.lower < _NO_BOUND:
        smaller = sum(fold.error_effects < fold.error_refit for fold in validation.folds)
        return f"with no useful bound; the error falls in {smaller} of {len(validation.folds)} trials"
    return f"95 % interval {whole_percent(validation.lower)} to {whole_percent(validation.upper)}"


def shrinks_surely(validation: Validation) -> bool:
    """Whether the effects shrink the gap on trials left out, with 97.5 % confidence: by its interval, or a sign test.

    One trial that the refitted model misses by far may leave the part of the gap without a bound.
    """
    falls = all(fold.error_effects < fold.error_refit for fold in validation.folds)
    return validation.lower > 0.0 or (falls and 0.5 ** len(validation.folds) < _CHANCE)


def unproven_in_words(validation: Validation) -> str:
    """What the gap does on trials left out where it does not surely shrink, with 97.5 % confidence: it may grow."""
    ends, share = ends_in_words(validation), whole_percent(abs(validation.gap_explained))
    if validation.gap_explained >= 0.0:
        return f"the gap does not shrink surely on trials left out: {share} of it is explained ({ends})"
    surely = "surely " if validation.upper < 0.0 else ""
    ends = ends.replace("interval", "interval of what is explained")
    return f"the gap {surely}grows by {share} on trials left out ({ends})"


def _named(
    causes: Sequence[NamedCause],
    probability: float,
    discrepancy: bool,
    shares: Shares,
    validation: Validation | None,
    one_trial: bool,
) -> str:
    little_left = math.sqrt(max(shares.misfit_effects, 0.0)) <= AT_NOISE
    large = [cause for cause in causes if not cause.small]
    sure = [cause for cause in large if not cause.implausible]
    doubtful = [cause for cause in large if cause.implausible]
    sentences = []
    unproven = validation is not None and not shrinks_surely(validation)
    if sure:
        most = validation is not None and validation.lower > _MOST
        part = "most of the gap" if most else "a part of the gap"
        whole = part if discrepancy and not little_left else "the gap"
        probable = f"{_listed(sure)} (probability {chance(probability)})."
        start = f"The most probable cause of {whole} is" if unproven else f"{whole.capitalize()} comes from"
        sentences.append(f"{start} {probable}")
    if doubtful:
        subject = "The rest looks" if sure else "The gap looks"
        sure_of = "" if sure else f" (probability {chance(probability)})"
        sentences.append(
            f"{subject} like {_listed(doubtful)}{sure_of}, but {_beyond(doubtful)} beyond what is believed of this "
            "vehicle, or stated of it: another cause may act in the same way."
        )
    if not large:
        sentences.append("No cause of practical size is seen.")
    sentences += [
        _tiny(large, shares),
        _small(causes),
        _LITTLE_LEFT if discrepancy and little_left else _lacks(discrepancy),
    ]
    if large and strays(shares):
        sentences.append(_stray(shares, len(large)))
    if large:
        sentences.append(_prediction(validation, one_trial))
    return _joined(*sentences)


def _unknown(causes: Sequence[NamedCause], probability: float, shares: Shares) -> str:
    sure = f"(probability {chance(probability)})"
    text = f"Something acts that is not in the library, or terms of the model have another form {sure}."
    if meets_noise(shares):
        text = (
            f"What the refitted model leaves is small: its error is {_of_noise(shares)}. It does not look like noise, "
            f"and its cause is not in the library {sure}."
        )
    return f"{text} Beside it acts {_listed(causes)}." if causes else text


def _undecided(causes: Sequence[NamedCause], vague: Sequence[str], probability: float, *, acts: bool) -> str:
    sure = f"(probability {chance(probability)})"
    if causes:
        return f"These trials cannot decide what causes the gap. The most probable cause is {_listed(causes)} {sure}."
    if not acts:
        return "These trials cannot decide whether an effect acts, nor which."
    which = f"tell what: {', '.join(vague[:-1])} or {vague[-1]} {sure}" if vague else "decide what"
    return f"Something acts, but these trials cannot {which}."


def _beyond(causes: Sequence[NamedCause]) -> str:
    """What of them is beyond belief, with its verb: "the size is"."""
    found = list(dict.fromkeys(f"the {cause.beyond or 'size'}" for cause in causes))
    return f"{listed(found)} {'is' if len(found) == 1 else 'are'}"


def _small(causes: Sequence[NamedCause]) -> str:
    small = [cause for cause in causes if cause.small]
    return f"Probable, but a negligible part of the gap: {_listed(small)}." if small else ""


def _tiny(causes: Sequence[NamedCause], shares: Shares) -> str:
    """What is named, though it is small for what it is: the gap that it makes is small as well."""
    found = [cause for cause in causes if cause.over_typical < Settings.tiny]
    if not found:
        return ""
    if len(causes) == 1:
        said = f"Its size is small, {_of_typical(found[0])}"
    else:
        said = f"Of small size: {listed([f'{cause.title} ({_of_typical(cause)})' for cause in found])}"
    return (
        f"{said}, and so is the gap: the refitted model's error is {_of_noise(shares)}."
        if meets_noise(shares)
        else f"{said}."
    )


def _of_typical(cause: NamedCause) -> str:
    return f"{100.0 * cause.over_typical:.2g} % of a typical one"


def _of_noise(shares: Shares) -> str:
    return f"{math.sqrt(max(shares.misfit_refit, 0.0)):.2f} times the noise"


def _lacks(discrepancy: bool) -> str:
    return _LACKS if discrepancy else ""


def _stray(shares: Shares, count: int) -> str:
    alone = f"Simulated with {'it' if count == 1 else 'them'} alone,"
    if not math.isfinite(shares.misfit_effects):
        return f"{alone} the motion still diverges."
    stray = f"runs still stray by {math.sqrt(shares.misfit_effects):.0f} times the noise"
    return f"{alone} {stray}: only forces of unknown cause hold them near the trials."


def _prediction(validation: Validation | None, one_trial: bool) -> str:
    if one_trial:
        return "With one trial, this cannot be tested on a trial left out."
    if validation is None:
        return "This was not tested on trials left out."
    if not math.isfinite(validation.gap_explained):
        return no_share_in_words(validation)
    ends = ends_in_words(validation)
    if shrinks_surely(validation):
        own = ", its size in each fitted to that one" if validation.own_sizes else ""
        return f"On trials left out{own}, it explains {whole_percent(validation.gap_explained)} of the gap ({ends})."
    if validation.gap_explained > _MOST:
        share = whole_percent(validation.gap_explained)
        return f"On trials left out it explains {share} of the gap, which is not sure ({ends})."
    return f"But {unproven_in_words(validation)}."


def _listed(causes: Sequence[NamedCause]) -> str:
    texts = [cause_in_words(cause) for cause in causes]
    between = "; " if any("," in text or ":" in text for text in texts) else ", "
    last = ", and " if len(texts) > 1 and "," in texts[-2] else " and "
    return texts[0] if len(texts) == 1 else f"{between.join(texts[:-1])}{last}{texts[-1]}"


def _joined(*sentences: str) -> str:
    """The sentences that say anything; what it looks like beside something that it looks like, it looks like also."""
    head, looks, rest = " ".join(sentence for sentence in sentences if sentence).partition(_LOOKS)
    return head + looks + rest.replace(_LOOKS, "It also looks like")
