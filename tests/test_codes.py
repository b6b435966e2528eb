"""Every error and every finding has a code, and each code says its causes and remedies."""

from __future__ import annotations

import pickle
import re
from pathlib import Path

import pytest

from seatruth import BadInput, PluginError, cli, read_trial
from seatruth.codes import codes
from seatruth.storage.atomic import CannotWrite, DiskFull, write_file
from seatruth.trials.finding import Finding


def test_an_error_has_the_code_of_the_part_that_raises_it(tmp_path: Path) -> None:
    (tmp_path / "empty.csv").write_text("a\n")
    with pytest.raises(BadInput) as caught:
        read_trial(tmp_path / "empty.csv", inputs=[], outputs=[])
    assert caught.value.code in codes()
    assert caught.value.code.startswith("readers-")
    (tmp_path / "file").write_text("")
    with pytest.raises(CannotWrite) as refused:
        write_file(tmp_path / "file" / "below", "text")
    assert refused.value.code == "storage-atomic"
    assert DiskFull("full").code == "plug-in"  # this test is no part of seatruth


def test_a_code_survives_the_way_to_another_process() -> None:
    sent = pickle.loads(pickle.dumps(PluginError("broken", where="here", code="units")))
    assert (sent.code, sent.message) == ("units", "here: broken.")


def test_each_code_has_causes_in_words() -> None:
    found = codes()
    assert {"readers-csv-dialect", "study-validation", "units", "outliers", "rudder-sign", "plug-in"} <= set(found)
    for code in found.values():
        assert re.fullmatch(r"[a-z0-9-]+", code.name)
        assert code.causes, code.name
        assert all(cause.message for cause in code.causes), code.name


def test_remedies_stand_with_their_causes() -> None:
    (cause,) = codes()["outliers"].causes
    assert (cause.severity, cause.remedy) == ("warning", "Remove them with 'hampel' or 'mark_invalid'.")
    assert "Add trials." in [cause.remedy for cause in codes()["one-trial"].causes]
    assert not [cause for cause in codes()["one-course"].causes if cause.message == "{text}"], (
        "a variable's text is found"
    )


def test_a_finding_shows_its_code() -> None:
    assert str(Finding("note", "drift", "It drifts.", "log.csv")).endswith("It drifts. [drift]")


def test_explain_prints_a_code_and_refuses_an_unknown_one(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["explain", "outliers"]) == 0
    shown = capsys.readouterr().out
    assert "Remove them with 'hampel'" in shown
    assert cli.run(["explain", "outlier"]) == 2
    assert "Did you mean 'outliers'?" in capsys.readouterr().err
