"""All sections of a diagnosis's report, in their order; each is left out where there is nothing to show."""

from __future__ import annotations

from collections.abc import Callable

from seatruth.diagnosis.results import Diagnosis
from seatruth.diagnosis.sentences import chance
from seatruth.diagnosis.verdict import NamedCause
from seatruth.report.blocks import Answer, Answers, Block, Column, Notes, Section, Statement, Table, Text, table
from seatruth.report.diagnosis import lacks, prediction
from seatruth.report.diagnosis.where import where
from seatruth.report.diagnosis.which import which
from seatruth.report.numbers import count, moment, number, percent, seconds
from seatruth.report.sections.pictures import Album
from seatruth.report.sections.run import of_findings, of_provenance
from seatruth.report.text import diagnosis as text
from seatruth.report.text import gap

ORDER: tuple[Callable[[Diagnosis, Album], Section | None], ...] = (
    where,
    which,
    lacks.discrepancy,
    lacks.noise,
    lacks.coefficients,
    prediction.validation,
    prediction.next_trial,
)


def diagnosis_sections(diagnosis: Diagnosis) -> list[Section]:
    """The sections of the page."""
    album = Album()
    evidence = [build(diagnosis, album) for build in ORDER]
    last = [_steps(diagnosis), of_findings(diagnosis.findings), of_provenance(diagnosis.provenance)]
    return [_summary(diagnosis), *(section for section in [*evidence, *last] if section is not None)]


def diagnosis_facts(diagnosis: Diagnosis) -> list[tuple[str, str]]:
    """What stands under the title."""
    outcome = diagnosis.outcome
    facts = [
        ("Model", diagnosis.model),
        ("Trials", str(len(diagnosis.trials))),
        ("Effects that took part", str(len(diagnosis.effects))),
        ("Computed in", seconds(outcome.get("wall_s"))),
        ("Time", moment(diagnosis.provenance)),
    ]
    return [(name, value) for name, value in facts if value]


def _summary(diagnosis: Diagnosis) -> Section:
    """The verdict, its causes, and the four answers on the first screen."""
    blocks: list[Block] = []
    first = text.data_first(diagnosis)
    if first:
        blocks.append(Statement("Wrong data", first, "wrong"))
    tone = "sure" if text.is_sure(diagnosis) else "unsure"
    blocks.append(Statement(text.headline(diagnosis), text.verdict_in_words(diagnosis), tone))
    causes = text.large(diagnosis)
    small = [cause for cause in diagnosis.verdict.causes if cause.small]
    if causes:
        blocks.append(_causes(diagnosis, causes, "Causes that the verdict names"))
    if small:
        blocks.append(_causes(diagnosis, small, "Probable, but a negligible part of the gap"))
    blocks.append(
        Answers(
            [
                Answer("Where?", gap.where_in_words(diagnosis), [("where", "Places, trials, time, region")]),
                Answer(
                    "Which?",
                    text.which_in_words(diagnosis),
                    [("which", "Effects and hypotheses"), ("discrepancy", "What the structure lacks")],
                ),
                Answer("How far?", text.validation_in_words(diagnosis), [("validation", "Trials left out")]),
                Answer("What next?", text.next_in_words(diagnosis, detailed=False), [("next-trial", "The next trial")]),
            ]
        )
    )
    notes = _notes(diagnosis)
    if notes:
        blocks += [Text("Also:"), Notes(notes)]
    return Section("summary", "In short", blocks)


def _causes(diagnosis: Diagnosis, causes: list[NamedCause], caption: str) -> Table:
    """Named causes at their level with size, share, probability and what limits them."""
    known = text.titles(diagnosis)
    results = {effect.name: effect for effect in diagnosis.effects}
    rows = []
    for cause in causes:
        first = results.get(cause.effects[0])
        rows.append(
            [
                cause.title,
                " or ".join(known.get(name, name) for name in cause.effects),
                text.cause_size(diagnosis, cause),
                percent(cause.share),
                chance(cause.probability),
                number(first.predictive_gain_lower, 3) if first else "",
                text.remark(cause),
            ]
        )
    columns = [
        Column("cause", "long", "the finest node of the tree of causes that reaches its probability"),
        Column("effect", "long", "effects that these trials cannot tell apart, the most probable first"),
        Column("size", "long", "of each of these effects, were it the one that acts"),
        Column("share of the gap", "number", "of the misfit above the noise after the refit"),
        Column("probability", "number", "of the cause at this level"),
        Column("predictive gain, at least", "number", "on trials left out (nats); it is named only where positive"),
        Column("remark", "verdict"),
    ]
    return table(caption, columns, rows)


def _notes(diagnosis: Diagnosis) -> list[tuple[str, str, bool]]:
    notes: list[tuple[str, str, bool]] = [(gap.gap_in_words(diagnosis), "where", False)]
    kind = diagnosis.verdict.kind
    if kind == "unknown" or diagnosis.verdict.discrepancy:
        notes += [
            (f"What is missing, as a formula: {line}.", "discrepancy", False)
            for line in text.formula_in_words(diagnosis)
        ]
    notes.append((text.undetectable_in_words(diagnosis), "which", kind == "underpowered"))
    notes.append((text.undeclared_in_words(diagnosis), "which", False))
    wrong = len([finding for finding in diagnosis.findings if finding.severity in ("error", "warning")])
    if wrong:
        grave = bool(text.errors_of_data(diagnosis))
        notes.append((f"{count(wrong, 'error or warning', 'errors and warnings')} about the data.", "findings", grave))
    if diagnosis.outcome.get("code") != "done":
        notes.append((f"This diagnosis is not complete: {diagnosis.outcome.get('reason', '')}.", "", True))
    return [note for note in notes if note[0]]


def _steps(diagnosis: Diagnosis) -> Section | None:
    """How each trial was prepared."""
    rows = []
    for trial in diagnosis.trials:
        facts = [str(trial.get("name", "")), str(trial.get("samples", "")), number(trial.get("duration_s"), 4)]
        conditions = ", ".join(f"{key} {value}" for key, value in (trial.get("conditions") or {}).items())
        steps = [f"{step['name']}: {step['effect']}" for step in trial.get("steps") or []]
        rows.append([*facts, conditions, "; ".join(steps) or "as recorded"])
    if not rows:
        return None
    columns = [
        Column("trial"),
        Column("samples", "number"),
        Column("duration (s)", "number"),
        Column("conditions", "long"),
        Column("what was done to its data, in this order", "long"),
    ]
    return Section("steps", "How each trial was prepared", [table(f"Trials ({len(rows)})", columns, rows)])
