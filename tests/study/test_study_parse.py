"""The study parser: every text gives a study file or one BadInput that names the line and the nearest name."""

from __future__ import annotations

import contextlib
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from seatruth.errors import BadInput
from seatruth.study import parse, read_text
from seatruth.study.reference import markdown

DOCS = Path(__file__).parents[2] / "docs" / "study-file.md"
EXAMPLE = DOCS.read_text().split("```toml\n")[1].split("```")[0]


def refused(text: str) -> str:
    with pytest.raises(BadInput) as caught:
        parse(text, "study.toml")
    return caught.value.message


def test_the_documented_examples_parse() -> None:
    blocks = [part.split("```")[0] for part in DOCS.read_text().split("```toml\n")[1:]]
    assert len(blocks) >= 3
    for block in blocks:
        parse(block)


def test_the_reference_is_the_schema() -> None:
    assert DOCS.read_text().endswith(markdown()), "write docs/study-file.md again from seatruth.study.reference"


def test_values_are_what_the_example_says() -> None:
    file, _ = parse(EXAMPLE)
    assert file.parameters["m"].value == 3270.0
    assert file.channels["delta"].sign == -1
    assert file.trials[1].prepare[0].options == {"start": 20.0, "end": 180.0}
    assert [stage.use for stage in file.optimizer] == ["least_squares"]
    assert file.noise["psi"] == "estimate"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[study\nname = 1", ["line 1", "not valid TOML"]),
        ("[study]\nname = unquoted", ["line 2", "column", "quotes"]),
        (
            "[channels]\ndelta = 'a'\n# [actuators]\ndelta = 'order'",
            [
                "line 4",
                "the key 'delta' stands twice in [channels] (line 2 is the other)",
                "write that [name] above it",
            ],
        ),
        ("seed = 1\n[a]\nseed = 1\nb = 2\nseed = { c = 1 }", ["line 5", "twice in [a] (line 3 is the other)"]),
        (
            "[noise]\nu = 1\n[study]\n[noise]\nr = 1",
            ["line 4", "a table stands twice (line 1 begins it)", "one [name]"],
        ),
        ("a = 1\na.b = 2", ["line 2", "the key 'a.b' stands twice"]),
        ("[study]\nnam = 'x'", ["line 2", "[study]", "'nam'", "Did you mean 'name'"]),
        ("\n\n[modle]\nuse = 'mmg'", ["line 3", "'modle'", "Did you mean 'model'"]),
        ("[study]\nseed = '1'", ["line 2", 'the text "1"', "a whole number"]),
        ("[study]\nseed = -1", ["0 or more"]),
        ("[study]\nseed = true", ["is true", "a whole number"]),
        ("[parameters]\nY_v = { vary = 1 }", ["line 2", "vary", "true or false"]),
        ("[parameters]\nY_v = { mn = 1 }", ["'mn'", "Did you mean 'min'"]),
        ("[parameters.Y_v.prior]\nmean = 1\nsd = 0", ["line 3", "greater than 0"]),
        ("[parameters]\nY_v = nan", ["finite number"]),
        ("[parameters]\nY_v = { start = [2, 1] }", ["line 2", "start", "[low, high]"]),
        ("[parameters]\nY_v = { start = ['a', 1] }", ["item 1", "a number"]),
        ("[[trials]]\nfil = 'a.csv'", ["'file' is missing"]),
        (
            "[[trials]]\nfile = 'a'\n[[trials]]\nfile = 'b'\nrole = 'test'",
            ["line 5", "[trials] 2", "'fit' or 'holdout'"],
        ),
        ("[trials]\nfile = 'a'", ["Write [[trials]]"]),
        ("[channels]\nu = { sgn = 1 }", ["'sgn'", "Did you mean 'sign'"]),
        ("[channels]\nu = { sign = 2 }", ["-1 or 1"]),
        ("[noise]\nu = true", ["a number, a text with a unit"]),
        ("[cost]\nkind = 'trajectry'", ["Did you mean 'trajectory'"]),
        ("[cost]\nmax_step = 0", ["greater than 0"]),
        ("[budget]\nevaluations = 10.5", ["a whole number"]),
        ("optimizer = 3", ["'optimizer' is 3"]),
        ("[study]\nname = 1\nname = 2", ["line 3"]),
        ("[study]\nname = 1979-05-27", ["text in quotes"]),
    ],
)
def test_bad_files_are_refused_in_plain_words(text: str, words: list[str]) -> None:
    message = refused(text)
    for word in words:
        assert word in message
    assert "pydantic" not in message
    assert "Input should" not in message


def test_all_problems_come_in_one_message_in_the_order_of_the_file() -> None:
    message = refused("[study]\nseed = 'a'\nnam = 1\n[cost]\nknd = 2\n[budget]\nseconds = -1\n")
    assert "4 problems" in message
    lines = [int(part.split(",")[0]) for part in message.split("line ")[1:]]
    assert lines == [2, 3, 5, 7]


def test_a_flood_of_problems_is_cut() -> None:
    message = refused("[study]\n" + "\n".join(f"key{k} = {k}" for k in range(100)))
    assert "100 problems" in message
    assert "88 more" in message


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (f"[study]\nseed = {'9' * 5000}", "too many digits"),
        ("a = 1\n" + ".".join(["a"] * 40_000) + " = 1", r"line 2: a key has too many parts"),
        ("[" + " . ".join(["a"] * 40_000) + "]", "too many parts"),
        ("x = {" + ".".join(['"a b"'] * 40_000) + " = 1}", "too many parts"),
        (f"x = {'[' * 490}{']' * 490}", "nested too deeply|unknown key"),
        ("a" * 3_000_000, "not valid TOML"),
        ('"' * 1_000_000, "not valid TOML"),
    ],
    ids=lambda text: text[:12],
)
def test_what_would_take_the_memory_of_the_machine_is_refused(text: str, says: str) -> None:
    with pytest.raises(BadInput, match=says):
        parse(text)


def test_numbers_and_texts_with_many_points_are_no_keys() -> None:
    text = f'[study]\ndescription = "{"see 1.2.3, a.b.c ... " * 50}"\n[noise]\nr = [{", ".join(["0.1"] * 500)}]\n'
    with pytest.raises(BadInput, match=r"line 4, \[noise\] r"):
        parse(text)


@pytest.mark.parametrize(
    ("content", "word"),
    [(b"", "empty"), (b" \n ", "empty"), (b"\xff\xfe\x00", "UTF-8"), (b"a" * 5_000_000, "too many")],
)
def test_files_that_are_no_study(tmp_path: Path, content: bytes, word: str) -> None:
    path = tmp_path / "study.toml"
    path.write_bytes(content)
    with pytest.raises(BadInput, match=word):
        read_text(path)


def test_a_missing_study_names_those_that_are_there(tmp_path: Path) -> None:
    (tmp_path / "other.toml").write_text("")
    with pytest.raises(BadInput, match=r"other\.toml"):
        read_text(tmp_path / "study.toml")
    with pytest.raises(BadInput, match="folder"):
        read_text(tmp_path)


@given(st.text(max_size=200))
@settings(max_examples=200, deadline=None)
def test_any_text_is_a_study_or_bad_input(text: str) -> None:
    with contextlib.suppress(BadInput):
        parse(text)


VALUES = st.sampled_from(
    ["1", "-1", "1.5", "nan", "inf", '"x"', "true", "[]", "{}", "[1]", "[[1]]", "{ a = 1 }", "1979-05-27", '"\\u0000"']
)


@given(st.data())
@settings(max_examples=300, deadline=None)
def test_any_mutation_of_a_study_is_a_study_or_bad_input(data: st.DataObject) -> None:
    lines = EXAMPLE.splitlines()
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(lines) - 1))
        how = data.draw(st.sampled_from(["value", "key", "drop", "double", "table", "cut"]))
        key, equals, _rest = lines[at].partition("=")
        if how == "value" and equals:
            lines[at] = f"{key}= {data.draw(VALUES)}"
        elif how == "key" and equals:
            lines[at] = lines[at][1:]
        elif how == "drop":
            lines[at] = ""
        elif how == "double":
            lines.insert(at, lines[at])
        elif how == "table":
            lines[at] = data.draw(st.sampled_from(["[trials]", "[[study]]", "[cost.kind]", "[[prepare.x]]", "[noise]"]))
        else:
            lines[at] = lines[at][: data.draw(st.integers(0, len(lines[at])))]
    message = _problem("\n".join(lines))
    assert not message or "line " in message


def _problem(text: str) -> str:
    try:
        parse(text)
    except BadInput as problem:
        return problem.message
    return ""
