"""Results of a diagnosis: saved and loaded without loss, damaged files refused, every field documented."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import fake_diagnosis
import pandas as pd
import pytest
import results_table

from seatruth.diagnosis.results import FORMAT, NAME, TRACES, Diagnosis
from seatruth.diagnosis.verdict import UNKNOWN
from seatruth.errors import BadInput
from seatruth.estimate import encoded
from seatruth.storage.sealed import sealed, unsealed


def text(diagnosis: Diagnosis) -> str:
    """Everything but the traces as text, in which NaN equals NaN."""
    return json.dumps(encoded(diagnosis.content()), sort_keys=True)


@pytest.mark.parametrize("kind", fake_diagnosis.KINDS)
def test_saved_and_loaded_it_is_the_same(kind: str, tmp_path: Path) -> None:
    diagnosis = fake_diagnosis.diagnosis(kind)
    again = Diagnosis.load(diagnosis.save(tmp_path))
    assert text(again) == text(diagnosis)
    pd.testing.assert_frame_equal(again.traces, diagnosis.traces, check_exact=True)
    for name in ("gap", "time", "region"):
        pd.testing.assert_frame_equal(getattr(again, name), getattr(diagnosis, name), check_exact=True)
    assert again.verdict == diagnosis.verdict
    assert again.hypotheses == diagnosis.hypotheses
    assert again.next_trial == diagnosis.next_trial
    assert [type(effect) for effect in again.effects] == [type(effect) for effect in diagnosis.effects]


def test_the_same_diagnosis_gives_the_same_bytes(tmp_path: Path) -> None:
    for folder in ("a", "b"):
        fake_diagnosis.diagnosis().save(tmp_path / folder)
    assert (tmp_path / "a" / NAME).read_bytes() == (tmp_path / "b" / NAME).read_bytes()


def test_numbers_that_are_not_finite_are_kept(tmp_path: Path) -> None:
    diagnosis = fake_diagnosis.diagnosis()
    assert diagnosis.validation is not None
    folds = (replace(diagnosis.validation.folds[0], error_effects=math.inf, predictive_gain=-math.inf),)
    diagnosis.validation = replace(diagnosis.validation, folds=folds, gap_explained=math.nan)
    diagnosis.gap.loc[0, "rmse_before"] = math.inf
    again = Diagnosis.load(diagnosis.save(tmp_path))
    assert again.validation is not None
    assert again.validation.folds == folds
    assert math.isnan(again.validation.gap_explained)
    assert again.gap.loc[0, "rmse_before"] == math.inf


def test_tables_without_rows_are_kept(tmp_path: Path) -> None:
    diagnosis = fake_diagnosis.diagnosis("no_gap")
    diagnosis.time, diagnosis.region = diagnosis.time.iloc[:0], pd.DataFrame()
    again = Diagnosis.load(diagnosis.save(tmp_path))
    assert len(again.time) == len(again.region) == 0
    assert list(again.time.columns) == list(diagnosis.time.columns)


def changed(change: Callable[[dict[str, Any]], object]) -> Callable[[Path], object]:
    """Damage to the content of diagnosis.json."""

    def damage(place: Path) -> None:
        content = unsealed((place / NAME).read_text(), FORMAT)
        change(content)
        (place / NAME).write_text(sealed(content, FORMAT))

    return damage


@pytest.mark.parametrize(
    ("damage", "says"),
    [
        (lambda place: (place / NAME).unlink(), "there is no diagnosis"),
        (lambda place: (place / NAME).write_text("{"), "cannot be read"),
        (lambda place: (place / NAME).write_bytes(b"\xff\xfe\x00"), "cannot be read"),
        (lambda place: (place / NAME).write_text("[" * 100_000), "cannot be read"),
        (lambda place: (place / NAME).write_text("[]"), "no diagnosis of this version"),
        (lambda place: (place / NAME).write_text('{"format": 1}'), "no diagnosis of this version"),
        (lambda place: (place / TRACES).write_bytes(b"x"), "damaged"),
        (lambda place: (place / TRACES).unlink(), "damaged"),
        (lambda place: (place / TRACES).write_bytes((place / TRACES).read_bytes() + b"x"), "damaged"),
        (lambda place: (place / NAME).write_text((place / NAME).read_text().replace("0.9", "0.8", 1)), "changed it"),
        (changed(lambda content: content.pop("verdict")), "damaged"),
        (changed(lambda content: content["verdict"].pop("kind")), "damaged"),
        (changed(lambda content: content["verdict"].update(kind="sure")), "damaged"),
        (changed(lambda content: content["effects"][0].update(probability="likely")), "damaged"),
        (changed(lambda content: content.update(effects=7)), "damaged"),
        (changed(lambda content: content.update(gap=7)), "damaged"),
        (changed(lambda content: content.update(gap={"trial": ["a"], "n": []})), "damaged"),
        (changed(lambda content: content.update(findings=[{"severity": "error"}])), "damaged"),
        (changed(lambda content: content.update(findings=[7])), "damaged"),
        (changed(lambda content: content.update(hypotheses=[None])), "damaged"),
    ],
)
def test_a_damaged_diagnosis_is_refused(damage: Callable[[Path], object], says: str, tmp_path: Path) -> None:
    damage(fake_diagnosis.diagnosis().save(tmp_path))
    with pytest.raises(BadInput, match=says):
        Diagnosis.load(tmp_path)


def test_answers_are_sets_of_effects_with_their_probability() -> None:
    diagnosis = fake_diagnosis.diagnosis("inseparable")
    answers = diagnosis.answers()
    assert [key for key, _ in answers[:2]] == [("wind",), ("wave_drift",)]
    assert sum(p for _, p in answers) == pytest.approx(1.0)
    assert fake_diagnosis.diagnosis("unknown").answers()[0][0] == (UNKNOWN,)


def test_the_short_form_names_what_the_verdict_names() -> None:
    short = fake_diagnosis.diagnosis("inseparable").as_verdict("c001")
    assert short["case"] == "c001"
    assert short["set"] == ["wind", "wave_drift"]
    assert short["effects"] == []
    open_ = fake_diagnosis.diagnosis("underpowered")
    open_.verdict = replace(open_.verdict, possible=("tether", "drag_increase"))
    assert open_.as_verdict()["set"] == ["tether", "drag_increase"]
    named = fake_diagnosis.diagnosis("effects").as_verdict()
    assert named["effects"] == ["current"]
    assert set(named["parameters"]) == {"current_north", "current_east"}


def test_an_effect_that_took_no_part_is_bad_input() -> None:
    diagnosis = fake_diagnosis.diagnosis()
    assert diagnosis.effect("wind").title == "steady wind"
    with pytest.raises(BadInput, match="took no part"):
        diagnosis.effect("pitch_gyro_bias")


def test_it_shows_itself_in_a_terminal_and_a_notebook() -> None:
    diagnosis = fake_diagnosis.diagnosis()
    diagnosis.study = "<b>a study</b>"
    assert "SYNTHETIC" in str(diagnosis)
    assert "current" in str(diagnosis)
    shown = diagnosis._repr_html_()
    assert "<b>a study" not in shown
    assert "&lt;b&gt;a study" in shown


def test_the_page_holds_the_table_made_from_the_docstrings() -> None:
    text = results_table.PAGE.read_text(encoding="utf-8")
    assert results_table.page_with(results_table.table()) == text, "run: python tests/diagnosis/results_table.py"


def test_the_table_has_a_row_for_every_field_of_a_file(tmp_path: Path) -> None:
    rows = [line.split("`")[1] for line in results_table.table().splitlines() if line.startswith("| `")]
    free = ("trials", "outcome", "augmented", "provenance", "findings", "gap", "time", "region")
    for kind in fake_diagnosis.KINDS:
        content = json.loads((fake_diagnosis.diagnosis(kind).save(tmp_path) / NAME).read_text())
        for path in paths({key: value for key, value in content.items() if key not in free}, ""):
            assert any(same(path, row) for row in rows), path
        assert set(free) <= {row.partition("[")[0].partition(".")[0] for row in rows}


def paths(value: Any, path: str) -> set[str]:
    if isinstance(value, dict) and set(value) != {"number"}:
        return {found for key, part in value.items() for found in paths(part, f"{path}.{key}" if path else key)}
    if isinstance(value, list):
        return {found for part in value for found in paths(part, f"{path}[]")}
    return {path}


def same(path: str, row: str) -> bool:
    """Whether a path is that of a row, in which * stands for one name (names of nodes and equations have dots)."""
    before, star, after = row.partition("*")
    return path == row or (bool(star) and path.startswith(before) and path.endswith(after))
