"""Hostile files by hand: each was, or might have been, answered by a traceback, a hang, too much memory or nonsense."""

from __future__ import annotations

import io
import os
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from attack.boat import STUDY, log
from attack.bombs import Write, bombs

Prepared = list[str]
"""Arguments of the command line."""
Case = Callable[[Path], Prepared]


def cases() -> Iterator[tuple[str, Case]]:
    """Name and preparation of each case: it changes files in a fresh copy of the study's folder."""
    for command in ("check", "identify", "diagnose", "simulate"):
        for name, content in _logs():
            yield f"{command}: log {name}", _with_log(command, content)
    for name, text in _studies():
        yield f"check: study {name}", _with_study(text)
    for name, text in _models():
        yield f"check: model {name}", _with_model(text)
    for name, file, write in bombs():
        yield name, _with_file(file, write)
    yield from _places()


def _with_log(command: str, content: bytes) -> Case:
    def prepare(folder: Path) -> Prepared:
        (folder / "run_1.csv").write_bytes(content)
        more = {"diagnose": ["--quiet", "--effects", "rudder_offset", "--no-next-trial"], "identify": ["--quiet"]}
        return [command, str(folder / "study.toml"), *more.get(command, [])]

    return prepare


def _with_file(name: str, write: Write) -> Case:
    def prepare(folder: Path) -> Prepared:
        write(folder / name)
        study = folder / "study.toml"
        study.write_text(study.read_text().replace("run_*.csv", name))
        return ["check", str(study)]

    return prepare


def _with_study(text: str) -> Case:
    def prepare(folder: Path) -> Prepared:
        (folder / "study.toml").write_bytes(text.encode("utf-8", "surrogatepass"))
        return ["check", str(folder / "study.toml")]

    return prepare


def _with_model(text: str) -> Case:
    def prepare(folder: Path) -> Prepared:
        model = (folder / "boat.py").read_text()
        (folder / "boat.py").write_text(model.replace("return (p.K * i.delta - s.r) / p.T, s.r", text))
        return ["simulate", str(folder / "study.toml")]

    return prepare


def _logs() -> Iterator[tuple[str, bytes]]:
    whole = log()
    lines = whole.splitlines()
    yield "of two rows", "\n".join(lines[:3]).encode()
    yield "of one row", "\n".join(lines[:2]).encode()
    yield (
        "without numbers in a column",
        "\n".join([lines[0], *(f"{line.rsplit(',', 1)[0]}," for line in lines[1:])]).encode(),
    )
    yield (
        "with words in a column",
        "\n".join([lines[0], *(f"{line.rsplit(',', 1)[0]},on" for line in lines[1:])]).encode(),
    )
    for value in ("1e300", "1e308", "-1e308", "inf", "nan", "1e-320", "9" * 400):
        yield f"with {value[:8]} once", whole.replace(lines[20].split(",")[2], value, 1).encode()
        yield (
            f"of {value[:8]}",
            "\n".join([lines[0], *(f"{0.5 * k},{value},{value},{value}" for k in range(60))]).encode(),
        )
    yield "with a gap of 1e6 s", _shifted(lines, 30, 1e6)
    yield "with a gap of 1e12 s", _shifted(lines, 30, 1e12)
    yield "with steps of 1e-12 s", "\n".join([lines[0], *(f"{k * 1e-12!r},0.1,0.1,0.1" for k in range(60))]).encode()
    yield "at times of 1e300 s", "\n".join([lines[0], *(f"{k}e300,0.1,0.1,0.1" for k in range(1, 60))]).encode()
    yield "of constants", "\n".join([lines[0], *(f"{0.5 * k},0,0,0" for k in range(60))]).encode()
    yield "of 100,000 columns", _wide(100_000)
    yield "of a line of 10 MB", (lines[0] + "\n" + "1" * 10_000_000 + ",1,1,1\n").encode()
    yield "with short rows and a quote", _short_rows(lines)
    frame = pd.DataFrame({"t": np.arange(60.0), "delta": [b"\x00\xff"] * 60, "r": 0.0, "psi": 0.0})
    yield "of bytes (Parquet)", _parquet(frame)
    yield "of lists (Parquet)", _parquet(frame.assign(delta=pd.Series([[1.0]] * 60, dtype=object)))
    yield "without rows (Parquet)", _parquet(frame.iloc[:0])
    yield "of null characters", b"\0" * 5000
    yield "with a name of control characters", whole.replace("delta", "del\x1b[2Jta", 1).encode()


def _shifted(lines: list[str], at: int, by: float) -> bytes:
    rows = [line.split(",") for line in lines[1:]]
    moved = [[repr(float(row[0]) + (by if k >= at else 0.0)), *row[1:]] for k, row in enumerate(rows)]
    return "\n".join([lines[0], *(",".join(row) for row in moved)]).encode()


def _wide(columns: int) -> bytes:
    head = "t,delta,r,psi," + ",".join(f"c{k}" for k in range(columns))
    row = ",0.1,0.1,0.1" + ",0" * columns
    return "\n".join([head, *(f"{0.5 * k}{row}" for k in range(3))]).encode()


def _short_rows(lines: list[str]) -> bytes:
    return "\n".join(['"t",delta,r,psi', *lines[1:20], "9.5,0.1", *lines[21:]]).encode()


def _parquet(frame: pd.DataFrame) -> bytes:
    stream = io.BytesIO()
    frame.to_parquet(stream, index=False)
    return stream.getvalue()


def _studies() -> Iterator[tuple[str, str]]:
    def more(text: str) -> str:
        return STUDY + text

    yield "with a seed of 5,000 digits", STUDY.replace("seed = 1", f"seed = {'9' * 5000}")
    yield "with a seed of 4,000 digits", STUDY.replace("seed = 1", f"seed = {'9' * 4000}")
    yield "with 490 nested arrays", more(f"[noise]\nr = {'[' * 490}{']' * 490}\n")
    yield "with 5,000 nested arrays", more(f"[noise]\nr = {'[' * 5000}{']' * 5000}\n")
    yield "with a key of 40,000 parts", more(".".join(["a"] * 40_000) + " = 1\n")
    yield "with a table of 40,000 parts", more("[" + ".".join(["a"] * 40_000) + "]\n")
    yield "with a key of 900 parts", more(".".join(["a"] * 900) + " = 1\n")
    yield "with 40,000 blanks in invalid_where", more(f'[channels.r]\ninvalid_where = "{" " * 40_000}x"\n')
    yield "with 40,000 brackets in invalid_where", more(f'[channels.r]\ninvalid_where = "{"(" * 40_000}"\n')
    yield "with segments of 1e-9 s", more("[cost]\nsegments = 1e-9\n")
    yield "with steps of 1e-9 s", more("[cost]\nmax_step = 1e-9\n")
    yield "with a Hampel window of 1e9", more('[[prepare]]\nstep = "hampel"\nchannels = ["r"]\nwindow = 1000000000\n')
    yield "with a resampling to 1e-9 s", more('[[prepare]]\nstep = "resample"\nstep_s = 1e-9\n')
    yield "with a budget of 1e30", STUDY.replace("evaluations = 60", f"evaluations = 1{'0' * 30}")
    yield "with infinite bounds", more("[parameters]\nK = { min = -inf, max = inf }\n")
    yield "with a value of 1e308", more("[parameters]\nK = 1e308\n")
    yield "with bounds of 1e308", more("[parameters]\nK = { min = -1e308, max = 1e308 }\n")
    yield "with noise of 1e-320", more("[noise]\nr = 1e-320\n")
    yield "with 5,000 parameters", more("[parameters]\n" + "".join(f"p{k} = 1\n" for k in range(5000)))
    yield "with 20,000 trials", more("".join(f'[[trials]]\nname = "n{k}"\nfile = "run_1.csv"\n' for k in range(20_000)))
    yield "with a null character in a name", STUDY.replace("run_*.csv", "run\\u0000.csv")
    yield "with half a character", STUDY.replace("run_*.csv", "run\ud800.csv")
    yield "that reads a device", STUDY.replace("run_*.csv", "/dev/zero")
    yield "that reads the kernel's log", STUDY.replace("run_*.csv", "/proc/kmsg")
    yield "that searches the disk", STUDY.replace("run_*.csv", "/**/*")
    yield "whose model is a device", STUDY.replace("boat.py:Nomoto", "/dev/zero:Nomoto")
    yield "whose model is no Python file", STUDY.replace("boat.py:Nomoto", "run_1.csv:Nomoto")
    yield "of nothing but quotes", '"' * 10_000
    yield "of nothing but brackets", "[" * 100_000
    yield "with an expression of 10,000 brackets", more(f'[parameters]\nK = {{ expr = "{"(" * 10_000}1" }}\n')
    yield "with an expression of powers", more('[parameters]\nK = { expr = "9**9**9**9**9" }\n')


def _models() -> Iterator[tuple[str, str]]:
    yield (
        "with a loop of 5,000 terms",
        "x = s.r\n        for k in range(5000):\n            x = x + 1e-9 * (x * x + k)\n        return x, s.r",
    )
    yield "with an endless loop", "while s.r < 1:\n            pass\n        return s.r, s.r"
    yield "with endless recursion", "f = lambda x: f(x)\n        return f(s.r), s.r"
    yield "that returns one value", "return s.r"
    yield "that returns texts", "return 'a', 'b'"
    yield "that divides by zero", "return s.r / 0, s.r"
    yield "that overflows", "return 1e308 * 10 * s.r, s.r"
    yield "that raises", "raise ValueError('no such water')"
    yield "that ends the program", "raise SystemExit"
    yield "of comparisons", "return (s.r > 0) - (s.r < 0), s.r > 0"
    yield (
        "of 3,000 nested terms",
        "x = s.r\n        for k in range(3000):\n            x = (x + p.K) * p.T / (p.T + k)\n        return x, s.r",
    )
    yield "of powers of powers", "x = s.r\n        for k in range(40):\n            x = x * x\n        return x, s.r"


def _places() -> Iterator[tuple[str, Case]]:
    def renamed(name: bytes) -> Case:
        def prepare(folder: Path) -> Prepared:
            os.rename(folder / "run_1.csv", os.fsencode(folder) + b"/" + name)
            return ["check", str(folder / "study.toml")]

        return prepare

    def in_folder(name: str) -> Case:
        def prepare(folder: Path) -> Prepared:
            inner = folder / name
            inner.mkdir(parents=True)
            for file in ("boat.py", "run_1.csv", "run_2.csv", "study.toml"):
                os.rename(folder / file, inner / file)
            return ["identify", str(inner / "study.toml"), "--quiet"]

        return prepare

    def study_called(name: bytes) -> Case:
        def prepare(folder: Path) -> Prepared:
            path = os.fsencode(folder) + b"/" + name
            os.rename(folder / "study.toml", path)
            return ["identify", os.fsdecode(path), "--quiet"]

        return prepare

    def result(change: Callable[[Path], Any]) -> Case:
        def prepare(folder: Path) -> Prepared:
            place = folder / "study-result"
            place.mkdir()
            change(place)
            return ["identify", str(folder / "study.toml"), "--quiet"]

        return prepare

    def store(content: bytes) -> Case:
        def prepare(folder: Path) -> Prepared:
            (folder / "comparison-result").mkdir()
            (folder / "comparison-result" / "comparison.sqlite").write_bytes(content)
            return ["compare", str(folder / "comparison.toml"), "--workers", "1", "--quiet"]

        return prepare

    def comparison(old: str, new: str) -> Case:
        def prepare(folder: Path) -> Prepared:
            file = folder / "comparison.toml"
            file.write_text(file.read_text().replace(old, new))
            return ["compare", str(file), "--workers", "1", "--quiet"]

        return prepare

    def init(name: str) -> Case:
        def prepare(folder: Path) -> Prepared:
            log_file = folder / "run_1.csv"
            log_file.write_text(log_file.read_text().replace("delta", name, 1), encoding="utf-8")
            return ["init", str(log_file), "-o", str(folder / "made.toml")]

        return prepare

    def archive(*members: tuple[str, bytes]) -> Case:
        def prepare(folder: Path) -> Prepared:
            with zipfile.ZipFile(folder / "ship.fmu", "w", zipfile.ZIP_DEFLATED) as made:
                for name, content in members:
                    made.writestr(name, content)
            study = folder / "study.toml"
            study.write_text(study.read_text().replace("boat.py:Nomoto", "ship.fmu"))
            return ["check", str(study)]

        return prepare

    head = b'<fmiModelDescription fmiVersion="2.0" modelName="m" guid="g">'
    yield "an FMU whose description is 200 MB of blanks", archive(("modelDescription.xml", head + b" " * 200_000_000))
    entities = b"".join(b'<!ENTITY a%d "%s">' % (k, b"&a%d;" % (k - 1) * 10) for k in range(1, 12))
    entities = b'<!DOCTYPE m [<!ENTITY a0 "x">' + entities + b"]>"
    yield "an FMU of entities", archive(("modelDescription.xml", entities + head + b"&a11;</fmiModelDescription>"))
    yield "an FMU that leads elsewhere", archive(("modelDescription.xml", head), ("../../escaped", b"x"))
    yield "an FMU without a description", archive(("binaries/x", b"x"))
    yield "a comparison of 1e23 seeds", comparison("seeds = 2", f"seeds = 1{'0' * 23}")
    yield "a comparison of 20,000 budgets", comparison("[30]", str(list(range(1, 100_001, 5))))
    yield "a comparison of 100,000 levels", comparison("[0.01]", str([1e-6 * k for k in range(1, 100_001)]))
    yield "a comparison with a budget of 1e30", comparison("[30]", f"[1{'0' * 30}]")
    yield "a comparison with noise of 1e308", comparison("[0.01]", "[1e308]")
    yield "a comparison whose study is a device", comparison("study.toml", "/dev/zero")
    yield "a comparison whose study is itself", comparison("study.toml", "comparison.toml")
    yield (
        "a million workers",
        lambda folder: ["identify", str(folder / "study.toml"), "--quiet", "--cross-validate", "--workers", "1000000"],
    )
    for name in ('r"]', "a\\", "'", "\u202e", "#", "${HOME}", "{{7*7}}", "x" * 100_000):
        yield f"a column {name[:10]!r} for init", init(name)
    yield "a log whose name is not UTF-8", renamed(b"run_\xff.csv")
    yield "a log whose name moves the cursor", renamed(b"run_\x1b[2J.csv")
    yield "a folder with brackets", in_folder("a [1] * folder?")
    yield "a folder whose name is not UTF-8", in_folder(os.fsdecode(b"caf\xe9"))
    yield "a study whose name is not UTF-8", study_called(b"st\xffudy.toml")
    yield "a study of a long name", study_called(b"s" * 250 + b".toml")
    yield "a folder where the checkpoint should be", result(lambda place: (place / "checkpoint.journal").mkdir())
    yield (
        "a link where the checkpoint should be",
        result(lambda place: (place / "checkpoint.journal").symlink_to("/dev/zero")),
    )
    yield "a pipe where the checkpoint should be", result(lambda place: os.mkfifo(place / "checkpoint.journal"))
    yield "an empty checkpoint", result(lambda place: (place / "checkpoint.journal").write_bytes(b""))
    yield (
        "a checkpoint of another program",
        result(lambda place: (place / "checkpoint.journal").write_bytes(b"[" * 10**6)),
    )
    yield (
        "a checkpoint of nested JSON",
        result(lambda place: (place / "checkpoint.journal").write_bytes(b"[" * 10**6 + b"\n")),
    )
    yield "jobs of another program", result(lambda place: (place / "checkpoint.journal.jobs").write_bytes(b"{}\n"))
    yield "a store of zeros", store(b"\0" * 8192)
    yield "an empty store", store(b"")
    yield "a store of a header alone", store(b"SQLite format 3\0" + b"\xff" * 8000)
    yield "no study at all", lambda folder: ["identify", str(folder / "nothing.toml")]
    yield "a folder for a study", lambda folder: ["identify", str(folder)]
    yield "a device for a study", lambda folder: ["identify", "/dev/zero"]
    yield "a full device for the answer", lambda folder: ["check", str(folder / "study.toml"), "--json", "/dev/full"]
    yield "a log for a study", lambda folder: ["identify", str(folder / "run_1.csv")]
    yield "an option that is no number", lambda folder: ["identify", str(folder / "study.toml"), "--seed", "9" * 5000]
    yield "a seed of 30 digits", lambda folder: ["identify", str(folder / "study.toml"), "--seed", "9" * 30, "--quiet"]
