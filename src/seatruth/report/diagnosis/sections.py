"""All sections of a diagnosis's report, in their order; each is left out where there is nothing to show."""

from __future__ import annotations

from seatruth.diagnosis.results import Diagnosis
from seatruth.report.blocks import Answer, Answers, Block, Notes, Section, Statement, Text
from seatruth.report.diagnosis import causes, evidence, words
from seatruth.report.numbers import count, moment, seconds
from seatruth.report.sections.pictures import Album
from seatruth.report.sections.run import of_findings, of_provenance

_SURE = ("effects", "no_gap")
"""Kinds of verdict that can be taken as they stand."""


def diagnosis_sections(diagnosis: Diagnosis) -> list[Section]:
    """The sections of the page."""
    album = Album()
    makers = (
        *(evidence.gap, evidence.where, causes.which, causes.signatures, causes.confusion, causes.unnamed),
        *(
            evidence.how_far,
            evidence.next_trial,
            causes.detectable,
            evidence.noise,
            causes.model,
            causes.not_asked,
            causes.steps,
        ),
    )
    found = [section for make in makers if (section := make(diagnosis, album)) is not None]
    last = (of_findings(diagnosis.findings), of_provenance(diagnosis.provenance))
    found.extend(section for section in last if section is not None)
    return [_summary(diagnosis), *found]


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
    """The three answers on the first screen."""
    said = diagnosis.verdict
    blocks: list[Block] = []
    first = words.data_first(diagnosis)
    if first:
        blocks.append(Statement("Wrong data", first, "wrong"))
    sentence = words.verdict_in_words(diagnosis)
    sure = not first and said["kind"] in _SURE and said["probability"] >= (words.SURE if diagnosis.named else 0.0)
    blocks.append(Statement(words.headline(diagnosis), sentence, "sure" if sure else "unsure"))
    blocks.append(
        Answers(
            [
                Answer(
                    "Where?",
                    words.where_in_words(diagnosis),
                    [("gap", "The gap by channel"), ("where", "Places, time, region")],
                ),
                Answer(
                    "Which?",
                    words.which_in_words(diagnosis),
                    [
                        ("which", "Answers with probabilities"),
                        ("signatures", "Signatures"),
                        ("confusion", "What it is confused with"),
                        ("unnamed", "What has no name"),
                    ],
                ),
                Answer("How far?", words.how_far_in_words(diagnosis), [("how-far", "Trials left out")]),
            ]
        )
    )
    notes: list[tuple[str, str, bool]] = [(words.gap_in_words(diagnosis), "gap", False)]
    weak = words.weak_in_words(diagnosis)
    if weak:
        notes.append((weak, "detectable", said["kind"] == "underpowered"))
    if diagnosis.next_trial is not None and said["kind"] != "no_gap":
        notes.append((f"Next trial: {words.next_in_words(diagnosis)}", "next-trial", False))
    wrong = len([f for f in diagnosis.findings if f.severity in ("error", "warning")])
    if wrong:
        notes.append(
            (f"{count(wrong, 'error or warning', 'errors and warnings')} about the data.", "findings", bool(first))
        )
    if diagnosis.outcome["code"] != "done":
        notes.append((f"This diagnosis is not whole: {diagnosis.outcome['reason']}.", "", True))
    blocks += [Text("Also:"), Notes([note for note in notes if note[0]])]
    return Section("summary", "In short", blocks)
