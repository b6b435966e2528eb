"""Every error and every finding has a code, and each code says its causes and remedies."""

from __future__ import annotations

import ast
import pickle
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import get_args

import pytest

from seatruth import BadInput, PluginError, cli, read_trial
from seatruth.codes import codes
from seatruth.diagnosis.verdict import Kind as VerdictKind
from seatruth.errors import code_of_module
from seatruth.storage.atomic import CannotWrite, DiskFull, write_file
from seatruth.trials.finding import Finding

ROOT = Path(__file__).parents[1]
SOURCES = ROOT / "src" / "seatruth"
sys.path.insert(0, str(ROOT / "tools" / "documentation"))
import codes_pages  # noqa: E402  (the folder of tools is no package)


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


def made_in_the_sources() -> Iterator[tuple[str, ast.Call]]:
    """Each place that makes an error or a finding, and each place that is given a code's name."""
    for path in sorted(SOURCES.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call):
                yield path.relative_to(SOURCES).as_posix(), node


def test_each_place_that_makes_a_finding_names_codes_that_have_a_page() -> None:
    """`Finding(...)` and `make_finding(...)`; a code with an angle and its rate in it stands for three."""
    found, seen = codes(), 0
    for path, call in made_in_the_sources():
        name = ast.unparse(call.func).rpartition(".")[2]
        if name not in ("Finding", "make_finding"):
            continue
        given = [*call.args, *(keyword.value for keyword in call.keywords if keyword.arg == "code")]
        at = 1 if name == "Finding" else 2
        if len(given) <= at or isinstance(given[at], ast.Name):  # passes on, or loads, what another place made
            assert path in ("trials/check/helpers.py", "diagnosis/results.py"), f"{path}, line {call.lineno}"
            continue
        text = ast.literal_eval(given[at]) if isinstance(given[at], ast.Constant) else ast.unparse(given[at])[2:-1]
        for angle, rate in (("psi", "r"), ("theta", "q"), ("phi", "p")):
            code = text.format(angle=angle, rate=rate)
            assert found[code].kind == "finding", f"{path}, line {call.lineno}"
            seen += 1
    assert seen > 150


def test_each_place_that_raises_an_error_has_its_cause_on_a_page() -> None:
    kinds = kinds_of_errors()
    assert {"BadInput", "DiskFull"} < kinds
    found, places = codes(), 0
    for path, call in made_in_the_sources():
        if isinstance(call.func, ast.Name) and call.func.id in kinds and call.args:
            code = code_of_module("seatruth." + path.removesuffix(".py").removesuffix("/__init__").replace("/", "."))
            assert found[code].kind == "error", f"{path}, line {call.lineno}"
            places += 1
    raised = [cause for code in found.values() if code.kind == "error" for cause in code.causes]
    assert len(raised) >= places > 400


def kinds_of_errors() -> set[str]:
    """Names of the classes of errors of seatruth, as the sources define them."""
    classes = [
        (node.name, {ast.unparse(base) for base in node.bases})
        for path in SOURCES.rglob("*.py")
        for node in ast.parse(path.read_text(encoding="utf-8")).body
        if isinstance(node, ast.ClassDef)
    ]
    kinds = {"SeatruthError"}
    while more := {name for name, bases in classes if bases & kinds} - kinds:
        kinds |= more
    return kinds


def test_each_code_has_a_page_with_every_cause_and_remedy(tmp_path: Path) -> None:
    codes_pages.write(tmp_path)
    index = (tmp_path / "index.md").read_text(encoding="utf-8")
    for code in codes().values():
        assert f"({code.name}.md)" in index
        lines = (tmp_path / f"{code.name}.md").read_text(encoding="utf-8").splitlines()
        assert lines[0] == f"# {code.name}"
        rows = [line for line in lines if line.startswith("| ")][1:]
        assert len(rows) == len(code.causes), code.name
        for row, cause in zip(rows, code.causes):
            message, remedy = re.split(r"(?<!\\) \| ", row.strip("| "))[-2:]
            assert message == codes_pages.cell(cause.message)
            assert remedy == (codes_pages.cell(cause.remedy) or "the message says it")


def test_remedies_stand_with_their_causes() -> None:
    (cause,) = codes()["outliers"].causes
    assert (cause.severity, cause.remedy) == ("warning", "Remove them with 'hampel' or 'mark_invalid'.")
    assert "Add trials." in [cause.remedy for cause in codes()["one-trial"].causes]
    assert not [cause for cause in codes()["one-course"].causes if "one course" not in cause.message], (
        "a variable's text is found"
    )


def test_no_name_of_a_variable_is_left_and_constants_are_numbers() -> None:
    """Three dots stand for what is filled in. Braces of study files stay, as in `ports = { force = [...] }`."""
    for code in codes().values():
        for text in (text for cause in code.causes for text in (cause.message, cause.remedy, cause.severity)):
            assert not re.search(r"[{}]", re.sub(r"\{[^{}]*[=:,][^{}]*\}", "", text)), f"{code.name}: {text}"
            assert not re.search("[\x00\x01]", text), code.name
    (jumps,) = codes()["input-jumps"].causes
    assert jumps.message.startswith("It crosses more than 35 % of its range between two samples in ... place(s)")
    assert codes()["quantised"].causes[0].message == "Its resolution, ..., is ... % of its range."


def test_each_code_has_a_remedy() -> None:
    """Some causes say in their own message what to do; a code of which all do would leave its page without advice."""
    assert [code.name for code in codes().values() if not any(cause.remedy for cause in code.causes)] == []


def test_a_finding_shows_its_code() -> None:
    assert str(Finding("note", "drift", "It drifts.", "log.csv")).endswith("It drifts. [drift]")


def test_explain_prints_a_code_and_refuses_an_unknown_one(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["explain", "outliers"]) == 0
    shown = capsys.readouterr().out
    assert "Remove them with 'hampel'" in shown
    assert cli.run(["explain", "outlier"]) == 2
    assert "Did you mean 'outliers'?" in capsys.readouterr().err


def test_explain_tells_kinds_of_verdicts_and_guesses_nothing_far(capsys: pytest.CaptureFixture[str]) -> None:
    for kind in get_args(VerdictKind):
        assert cli.run(["explain", kind]) == 0
        assert f"{kind} (verdict)" in capsys.readouterr().out
    assert cli.run(["explain", "psi"]) == 2
    assert "Did you mean" not in capsys.readouterr().err


def test_explain_prints_an_effect_by_its_name(capsys: pytest.CaptureFixture[str]) -> None:
    """Reports and `--effects` name them so."""
    assert cli.run(["explain", "rudder_rate_limit"]) == 0
    said = capsys.readouterr().out
    assert "rate limit of the rudder" in said
    assert "confused with: rudder_lag, rudder_delay" in said
    assert "slowness" in said
    assert cli.run(["explain", "rudder_rate_limits"]) == 2
    assert "'rudder_rate_limit'" in capsys.readouterr().err
