"""Lines of keys: right for every text that tomllib accepts."""

from __future__ import annotations

import json
import tomllib
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from seatruth.study.toml_positions import Lines

STUDY = '''# a comment with [brackets] and key = 1
[study]
name = "a # b ] = [x]"   # comment
text = """
[not.a.table]
k = 1 \\"""
"""
other = \'\'\'
[[no]]
\'\'\'

[parameters]
Y_v = { vary = true, min = -1,
        max = 2 }
"quoted name" = 1
a.b.c = 3

[[trials]]
file = "a.csv"

[[trials]]
file = 'b.csv'
prepare = [
    # first
    { step = "cut" },
    { step = "hampel" },
]
[trials.channels.u]
column = "U"
[[trials.more]]
x = 1
[[trials.more]]
x = 2
'''


@pytest.mark.parametrize(
    ("path", "line"),
    [
        (("study",), 2),
        (("study", "name"), 3),
        (("study", "text"), 4),
        (("study", "other"), 8),
        (("parameters", "Y_v"), 13),
        (("parameters", "Y_v", "min"), 13),
        (("parameters", "quoted name"), 15),
        (("parameters", "a", "b", "c"), 16),
        (("trials", 0, "file"), 19),
        (("trials", 1), 21),
        (("trials", 1, "prepare", 0, "step"), 25),
        (("trials", 1, "prepare", 1, "step"), 26),
        (("trials", 1, "channels", "u", "column"), 29),
        (("trials", 1, "more", 1, "x"), 33),
        (("trials", 1, "prepare", 1, "unheard"), 26),
        (("unheard", "of"), None),
    ],
)
def test_line_of_a_key(path: tuple[str | int, ...], line: int | None) -> None:
    text = STUDY.replace("min = -1,\n        max = 2 }", "min = -1, max = 2 }\n")
    tomllib.loads(text)
    assert Lines(text).of(path) == line


def test_a_list_of_one_may_be_written_as_a_table() -> None:
    assert Lines('[optimizer]\n\nuse = "x"').of(("optimizer", 0, "use")) == 3


def _paths(value: Any, path: tuple[str | int, ...] = ()) -> set[tuple[str | int, ...]]:
    found: set[tuple[str | int, ...]] = set()
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, item in items:
        found |= {(*path, key)} | _paths(item, (*path, key))
    return found


KEYS = st.one_of(st.sampled_from(["a", "b-1", "Y_v"]), st.text(st.characters(exclude_categories=["Cs"]), max_size=6))
SCALARS = st.one_of(
    st.integers(-9, 9),
    st.booleans(),
    st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\x7f"), max_size=12),
    st.sampled_from(["[x]", "{", "}", "#", '"""', "'", "a = 1", "\\", "]]"]),
)
VALUES = st.recursive(
    SCALARS, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(KEYS, inner, max_size=3), max_leaves=8
)


def _inline(value: Any) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{_key(k)} = {_inline(v)}" for k, v in value.items()) + " }"
    if isinstance(value, list):
        return "[ # comment ] }\n " + ",\n ".join(_inline(v) for v in value) + "\n]"
    return json.dumps(value, ensure_ascii=True) if isinstance(value, str) else str(value).lower()


def _key(key: str) -> str:
    return json.dumps(key, ensure_ascii=True)


@st.composite
def documents(draw: st.DrawFn) -> str:
    parts = []
    for name, body in draw(st.dictionaries(KEYS, st.dictionaries(KEYS, VALUES, max_size=3), max_size=4)).items():
        times = draw(st.integers(0, 2))
        for _ in range(max(times, 1)):
            parts.append(f"[[ {_key(name)} ]]" if times else f"[{_key(name)}] # end")
            parts += [f"{_key(key)} = {_inline(value)}" for key, value in body.items()]
    return draw(st.sampled_from(["\n", "\r\n"])).join(parts)


@given(documents())
@settings(max_examples=150, deadline=None)
def test_every_key_that_tomllib_reads_has_a_line(text: str) -> None:
    # JSON spells astral characters as surrogate pairs, which TOML does not know.
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        return
    lines = Lines(text)
    top = text.replace("\r\n", "\n").split("\n")
    for path in _paths(data):
        assert path in lines.positions
        assert 1 <= lines.positions[path] <= len(top)


@given(st.text(st.sampled_from("[]{}=.,#\"' \n\tab1_\\"), max_size=60))
@settings(max_examples=300, deadline=None)
def test_any_accepted_text_is_walked_to_its_end(text: str) -> None:
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        return
    assert _paths(data) <= set(Lines(text).positions)
