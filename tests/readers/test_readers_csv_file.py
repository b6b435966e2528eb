"""CSV in pieces: what is in one piece or many is the same, and no line with too few fields passes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from seatruth.errors import BadInput
from seatruth.readers import Table, csv_file, read_log


def table(folder: Path, content: str | bytes, **options: str) -> Table:
    (folder / "a.csv").write_bytes(content.encode() if isinstance(content, str) else content)
    return read_log(folder / "a.csv", **options).table()


@pytest.fixture
def small_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pieces of a few lines, so that a short file has many."""
    monkeypatch.setattr(csv_file._pieces, "__defaults__", (64,))


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "latin-1"])
def test_pieces_make_no_difference(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, encoding: str, end: str) -> None:
    lines = ["t,heading [°],note", *(f"{k},{k / 7},{'é' if k % 3 else ''}" for k in range(50)), "# the end", ",,"]
    content = end.join(lines).encode(encoding)
    whole = table(tmp_path, content)
    monkeypatch.setattr(csv_file._pieces, "__defaults__", (64,))
    pieces = table(tmp_path, content)
    assert whole.units == pieces.units == {"heading": "°"}
    assert whole.lines is not None
    assert pieces.lines is not None
    np.testing.assert_array_equal(whole.lines, np.arange(2, 52))
    np.testing.assert_array_equal(pieces.lines, whole.lines)
    for name in ("t", "heading"):
        np.testing.assert_array_equal(pieces.numbers(name), whole.numbers(name))
    assert pieces.column("note").fillna("").tolist() == whole.column("note").fillna("").tolist()


@pytest.mark.usefixtures("small_pieces")
def test_a_column_that_turns_to_text_is_text_from_its_first_line(tmp_path: Path) -> None:
    lines = [f"{k},0{k % 10},1.50,True" for k in range(40)] + ["40,x,1.50,1"]
    content = table(tmp_path, "t,code,u,flag\n" + "\n".join(lines))
    assert content.column("code").tolist()[:3] == ["00", "01", "02"]
    assert content.column("code").tolist()[-1] == "x"
    assert content.column("flag").tolist()[-2:] == ["True", "1"]
    assert content.numbers("u").tolist() == [1.5] * 41
    with pytest.raises(BadInput, match=r"line 42, column 'code': 'x' is not a number"):
        content.numbers("code")


@pytest.mark.usefixtures("small_pieces")
def test_integers_that_turn_to_fractions_are_numbers(tmp_path: Path) -> None:
    content = table(tmp_path, "t,u\n" + "\n".join(f"{k},{k}" for k in range(30)) + "\n30,1.5\n31,\n")
    assert content.numbers("u")[[0, 29, 30]].tolist() == [0, 29, 1.5]
    assert np.isnan(content.numbers("u")[31])


@pytest.mark.usefixtures("small_pieces")
def test_a_short_line_is_named_in_whatever_piece_it_is(tmp_path: Path) -> None:
    good = "\n".join(f"{k},1,2" for k in range(60))
    with pytest.raises(BadInput, match=r"line 62: it has 2 fields and the header has 3. Check the separator"):
        table(tmp_path, f"t,a,b\n{good}\n60,1\n{good}\n")
    with pytest.raises(BadInput, match=r"line 62: it has 4 fields and the header has 3. Check the separator"):
        table(tmp_path, f"t,a,b\n{good}\n60,1,2,3")
    # Cut off there.
    assert table(tmp_path, f"t,a,b\n{good}\n60,1").numbers("t").size == 60


@pytest.mark.parametrize(
    ("row", "says"),
    [
        ("1,2,3,4", "line 4: it has 4 fields and the header has 10"),
        ('"1",2,3,4', "line 4: it has 4 fields"),
        ('"1,2,3,4",2,3,4,5,6,7,8,9', "line 4: it has 9 fields"),
        ('1,"2,3,4,5,6,7,8,9,10', "line 4: its quotes do not match"),
        ('1,"2"x,3,4,5,6,7,8,9,10', "line 4: its quotes do not match"),
    ],
)
def test_a_quote_does_not_switch_off_the_count_of_fields(tmp_path: Path, row: str, says: str) -> None:
    names = ",".join(f"c{k}" for k in range(10))
    ten = ",".join("1" * 10)
    with pytest.raises(BadInput, match=says):
        table(tmp_path, f'{names}\n"1",1,1,1,1,1,1,1,1,1\n{ten}\n{row}\n{ten}\n')


@pytest.mark.parametrize("separator", [",", ";", "\t", "|", " "])
def test_separators_between_quotes_do_not_count(tmp_path: Path, separator: str) -> None:
    rows = [["t", "note", "u"], ["0", f'"calm{separator}clear"', "1"], ["1", '"said ""go"""', "2"], ["2", "5", "3"]]
    content = table(tmp_path, "\n".join(separator.join(row) for row in rows), separator=separator)
    assert content.column("note").tolist() == [f"calm{separator}clear", 'said "go"', "5"]
    assert content.numbers("u").tolist() == [1, 2, 3]


def test_lines_that_never_end_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(csv_file, "_LONGEST_LINE", 1000)
    monkeypatch.setattr(csv_file._pieces, "__defaults__", (64,))
    with pytest.raises(BadInput, match="line 3: it has over 1000 characters"):
        table(tmp_path, b"t,u\n0,1\n" + b"1" * 5000)


@pytest.mark.parametrize("encoding", ["no-such", "zlib", "rot13", "hex"])
def test_encodings_that_are_none(tmp_path: Path, encoding: str) -> None:
    with pytest.raises(BadInput, match="encoding"):
        table(tmp_path, "t,u\n0,1\n1,2\n", encoding=encoding)


def test_text_that_is_not_in_its_encoding(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="not ascii text"):
        table(tmp_path, "t,heading [°]\n0,1\n".encode(), encoding="ascii")
