"""Files are read right, and every bad one ends in one message that names file, line, column and what to do."""

from __future__ import annotations

import sys
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
import pandas as pd
import pytest
import scipy.io

from seatruth.errors import BadInput
from seatruth.readers import read_log
from seatruth.readers.listing import listing
from seatruth.trials import Channel, Clock, ColumnSpec, Trial, check_trials, read_trial

GOOD = "t,delta,psi\n0,1,2\n1,1,2\n2,1,3\n"
DEG = np.pi / 180


def read(folder: Path, content: str | bytes, name: str = "run.csv", **options: Any) -> Trial:
    file = folder / name
    file.write_bytes(content.encode() if isinstance(content, str) else content)
    arguments: dict[str, Any] = {"inputs": {"delta": ColumnSpec("delta")}, "outputs": {"psi": ColumnSpec("psi")}}
    return read_trial(file, **{**arguments, **options})


def refusal(folder: Path, content: str | bytes, name: str = "run.csv", **options: Any) -> str:
    with pytest.raises(BadInput) as caught:
        read(folder, content, name, **options)
    assert caught.value.do, str(caught.value)
    assert name in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize(
    "text",
    [
        GOOD,
        GOOD.replace(",", ";"),
        GOOD.replace(",", "\t"),
        GOOD.replace(",", "|"),
        GOOD.replace(",", "  "),
        GOOD.replace(",", " , "),
        GOOD.replace("\n", "\r\n"),
        GOOD.replace("\n", "\r"),
        GOOD.replace("\n", ",\n"),
        GOOD.rstrip("\n"),
        "\ufeff" + GOOD,
        "# a logger\n\n" + GOOD + "# the end\n\n",
        "t;delta;psi\n0,0;1,0;2,0\n1,0;1,0;2,0\n2,0;1,0;3,0\n",
        "# t delta psi\n0 1 2\n1 1 2\n2 1 3\n",
        't,"delta",psi\n"0",1,2\n1,1,2\n2,1,3\n',
        "note,t,delta,psi\nstart,0,1,2\n,1,1,2\nend,2,1,3\n",
    ],
)
def test_dialects_of_csv(tmp_path: Path, text: str) -> None:
    trial = read(tmp_path, text)
    np.testing.assert_array_equal(trial.t, [0, 1, 2])
    np.testing.assert_array_equal(trial.inputs["delta"], [1, 1, 1])
    np.testing.assert_array_equal(trial.outputs["psi"], [2, 2, 3])
    assert trial.name == "run"


def test_encodings(tmp_path: Path) -> None:
    text = "t;delta [°];psi [°]\n0;1;2\n1;2;3\n"
    for encoding in ("utf-8", "utf-16", "latin-1"):
        np.testing.assert_allclose(read(tmp_path, text.encode(encoding)).inputs["delta"], [DEG, 2 * DEG])
    assert "no-such" in refusal(tmp_path, text, encoding="no-such")


def test_lines_are_those_of_the_file(tmp_path: Path) -> None:
    trial = read(tmp_path, "# made by X\n\nt,delta,psi\n0,1,2\n\n# pause\n1,1,\n,,\n2,1,3\n")
    assert trial.lines is not None
    assert trial.lines.tolist() == [4, 7, 9]
    assert np.isnan(trial.outputs["psi"]).tolist() == [False, True, False]


@pytest.mark.parametrize(
    "text", ["t [s],delta [deg],psi (deg)\n0,10,2\n1,10,3\n", "t,delta,psi\ns,deg,deg\n0,10,2\n1,10,3\n"]
)
def test_units_in_the_header(tmp_path: Path, text: str) -> None:
    trial = read(tmp_path, text)
    np.testing.assert_allclose(trial.inputs["delta"], 10 * DEG)
    np.testing.assert_allclose(trial.outputs["psi"], [2 * DEG, 3 * DEG])
    assert "converted from deg" in trial.steps[0].effect


@pytest.mark.parametrize("named", ["psi (deg)", "psi [deg]", "psi"])
def test_the_unit_in_the_header_counts_however_the_column_is_named(tmp_path: Path, named: str) -> None:
    text = "t [min],delta [deg],psi [deg]\n0,10,2\n1,10,3\n"
    trial = read(tmp_path, text, time="t [min]", outputs={"psi": ColumnSpec(named)})
    np.testing.assert_allclose(trial.outputs["psi"], [2 * DEG, 3 * DEG])
    assert trial.t.tolist() == [0.0, 60.0]


def test_a_channel_is_the_mean_of_columns(tmp_path: Path) -> None:
    text = "t,port [deg],stbd [deg],delta,psi\n0,10,12,0,1\n1,,12,0,1\n2,-4,-2,0,1\n"
    both = ColumnSpec("", mean=("port", "stbd"))
    trial = read(tmp_path, text, outputs={"rudder": both}, channels={"rudder": Channel("rudder", "rad")})
    np.testing.assert_allclose(trial.outputs["rudder"] / DEG, [11.0, np.nan, -3.0])
    assert "rudder: converted from deg, mean of 2 columns" in trial.steps[0].effect
    said = refusal(tmp_path, text.replace("stbd [deg]", "stbd [rad]"), outputs={"delta_s": both})
    assert "their headers say 'deg' and 'rad'" in said
    assert "angles that wrap have none" in refusal(tmp_path, text, outputs={"psi": both})


def test_unit_sign_and_invalid_samples_are_on_record(tmp_path: Path) -> None:
    spec = ColumnSpec("psi", "deg", sign=-1, invalid_where="fix == 0 or sats < 4")
    text = "t,delta,psi,fix,sats\n0,1,2,1,9\n1,1,2,0,9\n2,1,3,1,3\n3,1,5,1,9\n"
    trial = read(tmp_path, text, outputs={"psi": spec})
    np.testing.assert_allclose(trial.outputs["psi"], [-2 * DEG, np.nan, np.nan, -5 * DEG])
    assert "sign changed" in trial.steps[0].effect
    assert "2 of 4 samples not valid" in trial.steps[0].effect


@pytest.mark.parametrize(
    ("condition", "valid"),
    [
        ("flag", [1, 0, 1]),
        ("flag == 1", [1, 0, 1]),
        ("flag != 1", [0, 1, 1]),
        ("`my flag` >= 2 and flag=1", [1, 0, 1]),
        ("word", [0, 1, 0]),
    ],
)
def test_conditions(tmp_path: Path, condition: str, valid: list[int]) -> None:
    text = "t,delta,psi,flag,my flag,word\n0,1,2,0,2,true\n1,1,2,1,2,False\n2,1,3,,2,True\n"
    trial = read(tmp_path, text, outputs={"psi": ColumnSpec("psi", invalid_where=condition)})
    assert np.isfinite(trial.outputs["psi"]).astype(int).tolist() == valid


@pytest.mark.parametrize("condition", ["flog == 1", "flag == x", "flag ==", "flag == 1 or", "__import__('os')", "== 3"])
def test_bad_conditions(tmp_path: Path, condition: str) -> None:
    text = "t,delta,psi,flag\n0,1,2,0\n1,1,2,1\n"
    refusal(tmp_path, text, outputs={"psi": ColumnSpec("psi", invalid_where=condition)})


def test_dates_times_of_day_and_epochs(tmp_path: Path) -> None:
    trial = read(tmp_path, "t,delta,psi\n2020-07-31T13:14:21.5,1,2\n2020-07-31 13:14:22,1,2\n")
    np.testing.assert_allclose(trial.t, [0, 0.5])
    assert trial.conditions["start"].startswith("2020-07-31T13:14:21.5")
    np.testing.assert_allclose(np.diff(read(tmp_path, "t,delta,psi\n13:14:21.5,1,2\n13:14:22,1,2\n").t), 0.5)
    trial = read(tmp_path, "t,delta,psi\n1596201261.5,1,2\n1596201262.5,1,2\n")
    np.testing.assert_array_equal(trial.t, [0, 1])
    assert trial.conditions["start"].startswith("2020-07-31T13:14:21.5")
    trial = read(tmp_path, "ms,delta,psi\n0,1,2\n100,1,2\n", time=Clock("ms", "ms"))
    np.testing.assert_allclose(trial.t, [0, 0.1])


def test_parquet_keeps_dates_units_and_gaps(tmp_path: Path) -> None:
    frame = pd.DataFrame(
        {
            "when": pd.date_range("2020-01-01", periods=4, freq="500ms"),
            "delta [deg]": [1, 2, 3, 4],
            "psi": [1.0, None, 3, 4],
        }
    )
    frame.to_parquet(tmp_path / "run.parquet")
    trial = read_trial(
        tmp_path / "run.parquet",
        time="when",
        inputs={"delta": ColumnSpec("delta")},
        outputs={"psi": ColumnSpec("psi")},
    )
    np.testing.assert_allclose(trial.t, [0, 0.5, 1, 1.5])
    np.testing.assert_allclose(trial.inputs["delta"], np.array([1, 2, 3, 4]) * DEG)
    assert np.isnan(trial.outputs["psi"]).sum() == 1


def test_matlab_arrays_and_structs(tmp_path: Path) -> None:
    t = np.arange(5.0)
    columns = {"t": t, "delta": np.ones(5), "psi": t**2}
    for content in (
        columns,
        {"run": {**columns, "note": "calm", "L": 3.0}},
        {k: v[None, :] for k, v in columns.items()},
    ):
        scipy.io.savemat(tmp_path / "run.mat", content)
        trial = read_trial(
            tmp_path / "run.mat", inputs={"delta": ColumnSpec("delta")}, outputs={"psi": ColumnSpec("psi")}
        )
        np.testing.assert_array_equal(trial.outputs["psi"], t**2)
    scipy.io.savemat(tmp_path / "two.mat", {"a": columns, "b": {k: v[:3] for k, v in columns.items()}})
    with pytest.raises(BadInput, match=r"in 2 topics.*a\.psi"):
        read_trial(tmp_path / "two.mat", inputs={}, outputs={"psi": ColumnSpec("psi")})
    assert len(read_trial(tmp_path / "two.mat", inputs={}, outputs={"psi": ColumnSpec("psi")}, variable="b")) == 3
    with pytest.raises(BadInput, match="no variable 'c'"):
        read_trial(tmp_path / "two.mat", inputs={}, outputs={"psi": ColumnSpec("psi")}, variable="c")


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("", "empty"),
        ("  \n\n", "empty"),
        ("# only\n# comments\n", "only comments"),
        ("t,delta,psi\n", "no samples"),
        ("hello", "single column"),
        ("hello world\nfoo\n bar baz qux\n", "separator"),
        (b"\x00\x01\x02\x03", "binary"),
        (b"PK\x03\x04abc", "zip archive"),
        (b"\x1f\x8babc", "gzip"),
        ('{"t": [1, 2]}', "JSON"),
        ("t,delta,psi\n0,0,1,5,2,5\n0,5,1,5,2,2\n", "separator"),
        ("t,delta,psi\n0,1,2\n1,1,abc\n2,1,def\n", "line 3, column 'psi': 'abc' is not a number (and 1 more"),
        ("t;delta;psi\n0;1,5;2,5\n1;1,5;x\n", "line 3, column 'psi'"),
        ("t,delta,psi\n0,1,2\n1,1,inf\n", "line 3, column 'psi'"),
        ("t,delta,psi\n0,1,2\n0,1,3\n1,1,2\n", "line 3: 1 sample(s) repeat the time"),
        ("t,delta,psi\n0,1,2\n2,1,2\n1,1,2\n", "line 4: time runs back, from 2 s to 1 s"),
        ("t,delta,psi\n0,1,2\n,1,2\n1,1,2\n", "line 3, column 't': 1 sample(s) have no time"),
        ("t,delta,psi\n0,1,2\n1,,2\n2,,2\n3,1,2\n", "lines 3-4: input 'delta' has 2 missing"),
        ("t,delta,psi\n0,1,2\n1,1,2\n2,1,2,4\n", "line 4: it has 4 fields and the header has 3."),
        ("t,delta,psi\n0,1,2\n1,1\n2,1,2\n", "line 3: it has 2 fields"),
        ("t,delta,psi\n0,1,2\n1,1,2,4\n2,1,2\n", "line 3: it has 4 fields"),
        ("t,Delta,psi\n0,1,2\n1,1,2\n", "Did you mean 'Delta'?"),
        ("t,delta,delta\n0,1,2\n1,1,2\n", "two columns are called 'delta'"),
        ("t,delta,psi\n0,1,2\n", "fewer than two samples"),
        ('t,delta,psi\n0,1,"2\n1,3,2\n', "line 2: its quotes do not match"),
        ("0 10 2\n1 10 3\n", "no column 'delta'. Known: 1, 2, 3"),
        ("t,delta,psi\n06/07/2020 13:14,1,2\n06/07/2020 13:15,1,2\n", "line 2, column 't': the date 06.07.2020 can be"),
    ],
)
def test_bad_text_files(tmp_path: Path, content: str | bytes, says: str) -> None:
    assert says in refusal(tmp_path, content)


def test_bad_specifications(tmp_path: Path) -> None:
    assert "Did you mean 'deg'" in refusal(tmp_path, GOOD, outputs={"psi": ColumnSpec("psi", "degg")})
    assert "is length" in refusal(tmp_path, GOOD, outputs={"psi": ColumnSpec("psi", "m")})
    message = refusal(tmp_path, GOOD.replace("psi", "psi [rad]"), outputs={"psi": ColumnSpec("psi", "deg")})
    assert "header says 'rad' and the study says 'deg'" in message
    assert "zero" in refusal(tmp_path, GOOD, outputs={"psi": ColumnSpec("psi", scale=0.0)})
    assert "not dates" in refusal(tmp_path, GOOD, time=Clock("t", "date"))
    assert "time" in refusal(tmp_path, GOOD, time=Clock("t", "m"))


def test_bytes_that_are_text_are_read_as_such(tmp_path: Path) -> None:
    columns = {"t": [0.0, 1.0, 2.0], "x": [b"1.5", None, b"2.5"], "other": [b"\xff", b"", b"\x00"]}
    pd.DataFrame(columns).to_parquet(tmp_path / "a.parquet")
    trial = read_trial(tmp_path / "a.parquet", inputs={}, outputs={"x": "x"})
    np.testing.assert_array_equal(trial.outputs["x"], [1.5, np.nan, 2.5])
    for condition in ("other == 'a'", "other", "other > 3"):
        with pytest.raises(BadInput, match="it holds bytes"):
            read_trial(tmp_path / "a.parquet", inputs={}, outputs={"x": ColumnSpec("x", invalid_where=condition)})
    assert [field.kind for field in listing(read_log(tmp_path / "a.parquet"))] == ["numbers", "text", "text"]


def test_bytes_are_no_numbers_and_many_columns_are_refused_at_once(tmp_path: Path) -> None:
    pd.DataFrame({"t": [0.0, 1.0], "x": [b"\xff", b"\xfe"]}).to_parquet(tmp_path / "a.parquet")
    with pytest.raises(BadInput, match="column 'x': it holds bytes"):
        read_trial(tmp_path / "a.parquet", inputs={}, outputs={"x": "x"})
    with pytest.raises(BadInput, match="column 'x': it holds bytes"):
        read_trial(tmp_path / "a.parquet", time="x", inputs={}, outputs={})
    (tmp_path / "b.csv").write_text(",".join(f"c{k}" for k in range(50_000)) + "\n" + ",".join("1" * 50_000) + "\n")
    with pytest.raises(BadInput, match="it has 50000 columns"):
        read_log(tmp_path / "b.csv")


def test_bad_places(tmp_path: Path) -> None:
    (tmp_path / "zigzag.csv").write_text(GOOD)
    places: list[tuple[Path | str, str]] = [
        (tmp_path / "zigzak.csv", "Did you mean 'zigzag.csv'?"),
        (tmp_path / "nowhere" / "a.csv", "does not exist"),
        (tmp_path, "folder"),
        ("a\0b.csv", "null character"),
    ]
    for path, says in places:
        with pytest.raises(BadInput, match=says.replace("?", r"\?")):
            read_trial(path, inputs={}, outputs={})


def test_damaged_binary_files(tmp_path: Path) -> None:
    scipy.io.savemat(tmp_path / "good.mat", {"t": np.arange(50.0), "psi": np.arange(50.0)})
    whole = (tmp_path / "good.mat").read_bytes()
    assert "MATLAB" in refusal(tmp_path, whole[:200], "cut.mat")
    assert "damaged" in refusal(tmp_path, b"MATLAB 7.3 MAT-file, Platform" + b" " * 500, "new.mat")
    pd.DataFrame({"t": [0.0, 1.0], "psi": [1.0, 2.0]}).to_parquet(tmp_path / "good.parquet")
    whole = (tmp_path / "good.parquet").read_bytes()
    with pytest.raises(BadInput, match="Parquet"):
        read(tmp_path, whole[:60], "cut.parquet")
    assert "Parquet" in refusal(tmp_path, "t,psi\n0,1\n", "text.parquet")


def test_repeated_times_can_be_kept_once_and_are_on_record(tmp_path: Path) -> None:
    text = "t,delta,psi\n0,1,2\n0,1,3\n1,1,2\n"
    for choice, value, line in (("first", 2, 2), ("last", 3, 3)):
        trial = read(tmp_path, text, repeated_time=choice)
        assert trial.outputs["psi"][0] == value
        assert trial.lines is not None
        assert trial.lines[0] == line
        assert "1 fewer" in trial.steps[0].effect


def test_input_gaps_are_filled_only_on_request(tmp_path: Path) -> None:
    text = "t,delta,psi\n0,1,2\n1,,2\n2,3,2\n"
    trial = read(tmp_path, text, prepare=[("fill_gaps", {"max_gap": 2.0})])
    np.testing.assert_allclose(trial.inputs["delta"], [1, 2, 3])
    assert trial.steps[-1].name == "fill_gaps"
    assert "line 3" in refusal(tmp_path, text, prepare=[("fill_gaps", {"max_gap": 1.0})])


def test_extra_channels_are_kept_in_si(tmp_path: Path) -> None:
    channels = {"psi": Channel("psi", "rad", angle=True)}
    text = "t,delta,psi,tank\n0,1,2,250\n1,1,2,260\n"
    outputs = {"psi": ColumnSpec("psi"), "tank": ColumnSpec("tank", "cm^3")}
    trial = read(tmp_path, text, outputs=outputs, channels=channels)
    np.testing.assert_allclose(trial.outputs["tank"], [250e-6, 260e-6])


def test_read_log_shows_what_a_file_holds(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("t [s],u [kn],note\n0,1,a\n1,2,b\n")
    table = read_log(tmp_path / "a.csv").table()
    assert list(table.columns) == ["t", "u", "note"]
    assert table.units == {"t": "s", "u": "kn"}


def test_a_long_log_is_read_fast(tmp_path: Path) -> None:
    """Columns are read whole: the number of function calls does not grow with the number of lines."""
    few, _ = calls_to_read(tmp_path / "warm.csv", 200)  # the first call also loads modules
    few, _ = calls_to_read(tmp_path / "short.csv", 200)
    many, (trial, values) = calls_to_read(tmp_path / "long.csv", 20_000)
    assert many <= few + 100
    np.testing.assert_array_equal(trial.outputs["b"], values[:, 1])


def calls_to_read(file: Path, samples: int) -> tuple[int, tuple[Trial, np.ndarray]]:
    """Function calls (Python's and C's) that reading a log of so many samples takes; the trial; its values (n, 6)."""
    values = np.random.default_rng(0).standard_normal((samples, 6))
    frame = pd.DataFrame(values, columns=list("abcdef"))
    frame.insert(0, "t", np.arange(samples) * 0.01)
    frame.to_csv(file, index=False)
    calls = 0

    def count(frame: FrameType, event: str, argument: object) -> None:
        nonlocal calls
        calls += event in ("call", "c_call")

    before = sys.getprofile()
    sys.setprofile(count)
    try:
        trial = read_trial(file, inputs={"a": ColumnSpec("a")}, outputs={"b": ColumnSpec("b")})
    finally:
        sys.setprofile(before)
    return calls, (trial, values)


def test_a_bare_name_is_a_column(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text("clock,rudder,heading\n0,0.1,1.0\n1,0.2,1.1\n")
    trial = read_trial(tmp_path / "log.csv", time="clock", inputs={"delta": "rudder"}, outputs={"psi": "heading"})
    assert trial.t.tolist() == [0.0, 1.0]
    assert trial.inputs["delta"].tolist() == [0.1, 0.2]
    assert trial.outputs["psi"].tolist() == [1.0, 1.1]


def test_a_log_that_was_cut_off_is_read_without_its_last_line_and_says_so(tmp_path: Path) -> None:
    file = tmp_path / "log.csv"
    file.write_text("t,delta,psi\n" + "".join(f"{k},0.1,{0.2 * k}\n" for k in range(30)) + "30,0.1\n\n")
    trial = read_trial(file, time="t", inputs={"delta": "delta"}, outputs={"psi": "psi"})
    assert len(trial) == 30
    [said] = [finding for finding in check_trials([trial]) if finding.code == "cut-off"]
    assert said.message == "log.csv was cut off: line 32, its last, has 2 of 3 fields and is left out."


def test_rows_that_repeat_the_one_before_in_all_values_are_left_out(tmp_path: Path) -> None:
    """Also where a value is missing in both; a row that says something else is not."""
    file = tmp_path / "log.csv"
    rows = ["0,0.1,0.0", "1,0.1,", "1,0.1,", "2,0.1,0.4", "2,0.1,0.4", "3,0.1,0.6"]
    file.write_text("\n".join(["t,delta,psi", *rows]) + "\n")
    trial = read_trial(file, time="t", inputs={"delta": "delta"}, outputs={"psi": "psi"})
    assert trial.t.tolist() == [0.0, 1.0, 2.0, 3.0]
    assert "left out rows that repeat the one before, 2 of them" in trial.steps[0].effect
