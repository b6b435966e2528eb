"""Section with the evidence for which effect causes the gap: answers, hypotheses, effects, signatures."""

from __future__ import annotations

import math

from seatruth.diagnosis.results import Diagnosis
from seatruth.diagnosis.sentences import chance
from seatruth.diagnosis.verdict import EffectResult, Hypothesis
from seatruth.report.blocks import Block, Column, Heading, Pictures, Section, Text, table
from seatruth.report.diagnosis import figures_which as figures
from seatruth.report.numbers import count, listed, number, shown
from seatruth.report.sections.pictures import Album
from seatruth.report.text import diagnosis as text
from seatruth.report.text.gap import place_in_words

_MOST_HYPOTHESES = 40
_SIZED = 8
"""Effects whose fitted parameters are listed."""
_NEVER = 100.0
"""Multiple of the typical magnitude from which the smallest one shown is written as "none"."""
_LEGEND = (
    ("measured", "residual after the refit"),
    ("explained", "the part that the effects explain"),
    ("residual", "what remains; the band is twice the noise"),
)


def which(diagnosis: Diagnosis, album: Album) -> Section:
    """The answers with their evidence, and every effect."""
    blocks: list[Block] = [Text(text.which_in_words(diagnosis))]
    answers = diagnosis.answers()
    if answers:
        alt = f"Most probable answer: {text.in_titles(diagnosis, answers[0][0])}, {chance(answers[0][1])}."
        said = text.beside_answers_in_words(diagnosis), text.unnamed_in_words(diagnosis)
        caption = " ".join(one for one in ("Probabilities of all answers add up to 1.", *said) if one)
        blocks.append(Pictures([album.picture(figures.answers(diagnosis), alt, caption)]))
    blocks += [
        _hypotheses(diagnosis),
        _effects(diagnosis),
        *_sizes(diagnosis),
        *_named(diagnosis),
        *_signatures(diagnosis, album),
        *_confusion(diagnosis, album),
        *_detectable(diagnosis),
        *_unavailable(diagnosis),
    ]
    return Section("which", "Which", blocks)


def _hypotheses(diagnosis: Diagnosis) -> Block:
    """Evidence, prior and probability of each hypothesis in one table."""
    found = diagnosis.hypotheses[:_MOST_HYPOTHESES]
    rows = [
        [
            text.in_titles(diagnosis, h.effects),
            f"yes, as {text.in_titles(diagnosis, h.like)}" if h.like else "yes" if h.discrepancy else "no",
            number(h.log_evidence, 4),
            _counted(h, found[0]),
            number(h.log_prior, 3),
            chance(h.probability),
            "" if h.settled else "not converged" if h.fitted else "linearized",
        ]
        for h in found
    ]
    columns = [
        Column("effects", "long"),
        Column(
            "discrepancy",
            "long",
            "whether forces that the model's structure lacks act as well; as a term that damping of another form shows",
        ),
        Column("log evidence", "number", "over that of the model without effects, with discrepancy or without (nats)"),
        Column(
            "counts",
            "number",
            "what is left of the evidence once models are never of the exact form (nats); 0: the first",
        ),
        Column("log prior", "number"),
        Column("probability", "number", "from what counts and the prior; all hypotheses sum to 1"),
        Column("fit", "verdict", "linearized: too far behind to be fitted in full"),
    ]
    return table(f"Hypotheses ({len(rows)} of {len(diagnosis.hypotheses)})", columns, rows)


def _counted(one: Hypothesis, first: Hypothesis) -> str:
    """nats by which the evidence of a hypothesis counts more than that of the first; empty at a probability of zero."""
    if not one.probability > 0.0:
        return ""
    return number(math.log(one.probability / first.probability) - (one.log_prior - first.log_prior) + 0.0, 3)


def _effects(diagnosis: Diagnosis) -> Block:
    """Every effect that took part."""
    known = text.titles(diagnosis)
    rows = []
    for effect in diagnosis.effects:
        near = [known.get(name, name) for name, value in effect.confusable.items() if value < text.NEAR]
        gain = [number(x, 3) for x in (effect.predictive_gain, effect.predictive_gain_lower)]
        rows.append(
            [effect.title, chance(effect.probability), number(effect.log_evidence, 4), number(effect.noncentrality, 3),
             text.parameters_in_words(effect), *gain, ", ".join(near)]
        )  # fmt: skip
    columns = [
        Column("effect"),
        Column("probability", "number", "that it acts, alone or with others"),
        Column(
            "log evidence", "number", "of the effect alone over no effect (nats); linearized where it was not fitted"
        ),
        Column(
            "noncentrality", "number", "squared size of its signature in standard deviations, once all else is refitted"
        ),
        Column("size", "long"),
        Column(
            "predictive gain", "number", "log predictive density of trials left out, with it less without it (nats)"
        ),
        Column(
            "lower bound", "number", "one-sided 95 % bound of the gain: an effect is named only where it is positive"
        ),
        Column("hardly distinguishable from", "long"),
    ]
    return table(f"Effects that took part ({len(rows)})", columns, rows, folded=len(rows) > 12)


def _sizes(diagnosis: Diagnosis) -> list[Block]:
    """Fitted parameters of the leading effects with their intervals."""
    rows = []
    for effect in [effect for effect in diagnosis.effects if effect.parameters][:_SIZED]:
        for q in effect.parameters:
            value, unit = text.value_and_unit(q)
            factor = shown(q.name, q.unit).factor
            rows.append(
                [effect.title, q.name.replace("_", " "), value, unit, text.interval_in_words(q),
                 number(q.null * factor, 3), number(q.prior_sd * factor, 2)]
            )  # fmt: skip
    columns = [
        Column("effect"),
        Column("parameter"),
        Column("value ± std. error", "number", "fitted alone; effects of the verdict together"),
        Column("unit"),
        Column("95 % interval", "number"),
        Column("null", "number", "value at which the effect vanishes"),
        Column("prior sd", "number", "standard deviation of what is believed of it before the trials"),
    ]
    return [table("Sizes of the leading effects", columns, rows)] if rows else []


def _named(diagnosis: Diagnosis) -> list[Block]:
    blocks: list[Block] = []
    known = text.titles(diagnosis)
    for effect in _of_verdict(diagnosis):
        blocks.append(Heading(effect.title, f"effect {effect.name}"))
        places = listed([place_in_words(place) for place in effect.acts_on])
        texts = [effect.equation.rstrip("."), f"It acts in {places}" if places else ""]
        blocks.append(Text(". ".join(part for part in texts if part) + "."))
        if effect.equivalent:
            equivalent = listed([known.get(name, name) for name in effect.equivalent])
            blocks.append(Text(f"No trial can distinguish it from: {equivalent}."))
    return blocks


def _of_verdict(diagnosis: Diagnosis) -> list[EffectResult]:
    named = {name for cause in diagnosis.verdict.causes for name in cause.effects}
    return [effect for effect in diagnosis.effects if effect.name in named]


def _signatures(diagnosis: Diagnosis, album: Album) -> list[Block]:
    """Residuals, the part that the effects explain, and what remains."""
    chosen = figures.clearest(diagnosis) if len(diagnosis.gap) else []
    if not chosen or not len(diagnosis.traces):
        return []
    pictures = [
        album.picture(
            figures.signature(diagnosis, trial, channel),
            f"Residual of {channel} in trial {trial} after the refit, the part explained, and what remains.",
        )
        for trial, channel in chosen
    ]
    effects = tuple(diagnosis.augmented.get("effects") or ())
    about = (
        f"The trials and channels in which {text.in_titles(diagnosis, effects)} explains most."
        if effects
        else "No effect is in the model here: the trials and channels in which the refitted model misses most."
    )
    legend = _LEGEND if effects else (("residual", "residual after the refit; the band is twice the noise"),)
    return [Heading("Signatures"), Text(about), Pictures(pictures, legend)]


def _confusion(diagnosis: Diagnosis, album: Album) -> list[Block]:
    """How well the leading effects can be distinguished on these trials."""
    names, found = figures.pairs(diagnosis)
    if len(names) < 2:
        return []
    close = sum(value < text.NEAR for value in found.values())
    known = text.titles(diagnosis)
    about = (
        "Pairwise noncentrality: what is left of the effect of the row, at its fitted size, when that of the column "
        "and all coefficients are refitted in its place. Below 11 (marked) these trials do not distinguish the two."
    )
    picture = album.picture(
        figures.confusion(diagnosis),
        f"Pairwise noncentrality of {count(len(names), 'effect')}; {count(close, 'pair')} below 11.",
        "Squared distance in standard deviations. Columns carry the numbers of the rows"
        + "".join(f"; {k + 1}: {known.get(name, name)}" for k, name in enumerate(names))
        + ".",
    )
    return [Heading("Effects that are taken for each other"), Text(about), Pictures([picture])]


def _detectable(diagnosis: Diagnosis) -> list[Block]:
    """The smallest magnitude of each effect that these trials would show."""
    rows: list[list[str]] = []
    for effect in diagnosis.effects:
        for name, size in effect.typical.items():
            scale = shown(name, effect.units[name])
            typical, least = size * scale.factor, effect.detectable.get(name, math.inf) * scale.factor
            smallest = number(least, 2) if math.isfinite(least) and least < _NEVER * typical else "none"
            could = "could show" if least <= typical else "could not"
            rows.append([effect.title, name.replace("_", " "), smallest, number(typical, 2), scale.unit, could])
    if not rows:
        return []
    columns = [
        Column("effect"),
        Column("parameter"),
        Column("smallest shown", "number", "found with probability 0.8 in a test at 0.05"),
        Column("typical", "number", "distance from its null that is usual on such a vehicle"),
        Column("unit"),
        Column("at typical size", "verdict"),
    ]
    about = "An effect that these trials could not show at its typical size is not excluded by the verdict."
    weak = text.undetectable_in_words(diagnosis)
    caption = f"Smallest detectable magnitudes ({count(len(rows), 'parameter')})"
    open_table = diagnosis.verdict.kind == "underpowered"
    return [
        Heading("What these trials can show"),
        Text(f"{about} {weak}".strip()),
        table(caption, columns, rows, folded=not open_table),
    ]


def _unavailable(diagnosis: Diagnosis) -> list[Block]:
    if not diagnosis.unavailable:
        return []
    rows = [[name, why] for name, why in diagnosis.unavailable.items()]
    heads = [Column("effect"), Column("took no part because", "long")]
    return [table(f"Effects that took no part ({len(rows)})", heads, rows, folded=True)]
