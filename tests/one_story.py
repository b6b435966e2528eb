"""Reads a report of a diagnosis and checks that all its parts tell the same story."""

from __future__ import annotations

import re
import tomllib
from html.parser import HTMLParser
from typing import Any

import pytest

from seatruth.diagnosis.results import Diagnosis
from seatruth.diagnosis.sentences import whole_percent
from seatruth.report.numbers import number
from seatruth.report.text.diagnosis import formula_in_words, readable
from seatruth.report.text.gap import place_in_words


class Page(HTMLParser):
    """The text of a page by section, and the cells of its tables by caption."""

    def __init__(self, html: str) -> None:
        super().__init__(convert_charrefs=True)
        self.sections: dict[str, str] = {}
        self.tables: dict[str, list[list[str]]] = {}
        self._section, self._caption, self._in = "", "", ""
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag == "section":
            self._section = str(dict(attrs)["id"])
        elif tag == "caption":
            self._in, self._caption = tag, ""
        elif tag == "tr":
            self.tables.setdefault(self._caption, []).append([])
        elif tag in ("td", "th"):
            self._in = tag
            self.tables[self._caption][-1].append("")

    def handle_endtag(self, tag: str) -> None:
        if tag == self._in:
            self._in = ""

    def handle_data(self, data: str) -> None:
        if self._section:
            self.sections[self._section] = f"{self.sections.get(self._section, '')} {data}"
        if self._in == "caption":
            self._caption += data
        elif self._in:
            self.tables[self._caption][-1][-1] += data

    def text(self, section: str) -> str:
        """Text of a section with single blanks."""
        return re.sub(r"\s+", " ", self.sections.get(section, ""))

    def rows(self, caption: str) -> list[list[str]]:
        """Rows below the head of the tables whose caption begins so."""
        return [row for name, rows in self.tables.items() if name.startswith(caption) for row in rows[1:]]


def check(html: str, diagnosis: Diagnosis, augmented: str) -> None:
    """Headline, where, effects, folds, formula and augmented.toml name the same effects, places and values."""
    page, verdict = Page(html), diagnosis.verdict
    summary = page.text("summary")
    assert readable(verdict.sentence) in summary

    # Each named cause: in the headline, in the table below it, and among the effects with the same size.
    named = page.rows("Causes that the verdict names") + page.rows("Probable, but a negligible part of the gap")
    assert sorted(row[0] for row in named) == sorted(cause.title for cause in verdict.causes)
    effects = {row[0]: row for row in page.rows("Effects that took part")}
    for cause in verdict.causes:
        row = next(row for row in named if row[0] == cause.title)
        assert cause.title in verdict.sentence
        assert readable(cause.in_words) in row
        for name in cause.effects:
            assert diagnosis.effect(name).title in row[1]
            assert diagnosis.effect(name).title in effects
        if len(cause.effects) == 1 and diagnosis.effect(cause.effects[0]).in_words:
            assert readable(cause.in_words) in effects[diagnosis.effect(cause.effects[0]).title]

    # Where: the places of the verdict are those on which its effects act, and they are marked in the table of places.
    acting = {place for name in diagnosis.named for place in diagnosis.effect(name).acts_on}
    assert set(verdict.places) == acting
    marked = {row[0] for row in page.rows("Places") if "named" in row}
    assert marked == {place_in_words(place) for place in acting}
    assert all(place_in_words(place) in page.text("where") for place in acting)

    # The augmented study: the named effects at the reported values, in the file and in the report.
    study = tomllib.loads(augmented)
    assert diagnosis.augmented["effects"] == list(diagnosis.named)
    assert study["model"].get("effects", []) == list(diagnosis.named)
    values = {f"{name}_{q.name}": q.value for name in diagnosis.named for q in diagnosis.effect(name).parameters}
    added = {name: _value(study["parameters"][name]) for name in values}
    assert added == pytest.approx(values, rel=1e-12)
    assert dict(page.rows("What augmented.toml adds")) == {name: number(value, 6) for name, value in values.items()}

    # Folds predict with the effects of the verdict; the headline gives the gap explained that they give.
    if diagnosis.validation is not None and verdict.causes:
        rows = {row[0]: row for row in page.rows("Trials left out")}
        assert set(rows) == {fold.trial for fold in diagnosis.validation.folds}
        if any(not cause.small for cause in verdict.causes):
            share = whole_percent(diagnosis.validation.gap_explained)
            assert share in verdict.sentence
            assert share in page.text("validation")

    # What cannot be told apart is not distinguished already.
    left = set(diagnosis.next_trial.survivors) if diagnosis.next_trial is not None else set[str]()
    if any(len(left & {*cause.effects}) > 1 for cause in verdict.causes):
        assert "already distinguish" not in summary

    # The formula is shown where the verdict says that the structure lacks something.
    for line in formula_in_words(diagnosis):
        assert line in page.text("discrepancy")
        assert not (verdict.discrepancy or verdict.kind == "unknown") or line in summary


def _value(parameter: Any) -> float:
    return float(parameter["value"] if isinstance(parameter, dict) else parameter)
