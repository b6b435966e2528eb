"""Runs of a comparison: paired, repeatable, resumed, kept when they fail."""

from __future__ import annotations

import contextlib
import functools
import os
import sqlite3
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import psutil
import pytest
from joblib.externals.loky import get_reusable_executor
from small_comparison import TRUTH, glide, guess, line, numbers, small, solvers, stumble

from seatruth import BadInput, SeatruthError
from seatruth.comparison import Noise, Problem, compare, standing
from seatruth.comparison.realisation import NoisyProblem, RealisationSettings
from seatruth.comparison.runner import STORE
from seatruth.comparison.store import Store
from seatruth.comparison.worker import jobs_of, run_job
from seatruth.errors import SeatruthWarning
from seatruth.optimizers import from_callable, make
from seatruth.progress import ProgressEvent

HERE = Path(__file__).parent


def test_runs_end_near_the_truth_and_count_evaluations(tmp_path: Path) -> None:
    seen: list[ProgressEvent] = []
    results = compare(small(), tmp_path, progress=seen.append)
    assert results.left == 0
    assert len(results.runs) == 18
    assert (results.runs["status"] == "done").all()
    assert (results.runs["evaluations"] <= 100).all()
    assert seen[0].left == 18
    assert (seen[-1].done, seen[-1].left) == (18, 0)
    clean = results.estimates.query("solver == 'local' and level == 0")
    assert clean["value"].to_numpy() == pytest.approx(np.tile(list(TRUTH.values()), 3), abs=1e-9)
    assert results.overall.query("solver == 'local' and level == 0.05")["efficiency"].iloc[0] == pytest.approx(
        1, abs=0.8
    )


def test_the_number_of_workers_changes_nothing_and_they_run_no_code_of_the_working_directory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    get_reusable_executor().shutdown(wait=True)  # the workers of this test are new ones
    here = tmp_path / "received"
    here.mkdir()
    for name in ("argparse", "pickle", "queue", "joblib", "numpy"):
        (here / f"{name}.py").write_text(f"open({str(tmp_path / 'executed')!r}, 'a').write({name!r})\n")
    monkeypatch.chdir(here)
    one = compare(small(), tmp_path / "one", workers=1)
    two = compare(small(), tmp_path / "two", workers=2)
    assert not (tmp_path / "executed").exists()
    pd.testing.assert_frame_equal(numbers(one), numbers(two), check_exact=True)


def test_all_solvers_and_costs_see_the_same_record_and_start() -> None:
    problem = NoisyProblem(glide(), RealisationSettings(seed=1, base_level=0.01))
    noise = Noise("coloured", 0.02)
    a, b, c = (
        problem.realise(cost, noise, seed) for cost, seed in (("trajectory", 4), ("regression", 4), ("trajectory", 5))
    )
    for name in ("v", "s"):
        assert (a.trials[0].outputs[name] == b.trials[0].outputs[name]).all()
        assert (a.trials[0].outputs[name] != c.trials[0].outputs[name]).any()
        assert a.trials[0].outputs[name][0] == problem.clean_trials[0].outputs[name][0]  # the start is read from it
    assert [q.value for q in a.free] == [q.value for q in b.free]
    assert [q.value for q in a.free] != [q.value for q in c.free]


def test_a_changed_definition_makes_only_what_it_touches(tmp_path: Path) -> None:
    compare(small(), tmp_path)
    more = small(solvers={**solvers(), "guess": from_callable(guess, name="other")}, seeds=3)
    seen: list[ProgressEvent] = []
    results = compare(more, tmp_path, progress=seen.append)
    assert seen[0].left == 6  # the solver under its other name, nothing else
    assert results.left == 0
    seen.clear()
    compare(small(seeds=4), tmp_path, progress=seen.append)
    assert seen[0].left == 6
    seen.clear()
    compare(small(problems=[Problem("line", line(), TRUTH | {"a": 2.5})]), tmp_path, progress=seen.append)
    assert seen[0].left == 18


def tries(many: int) -> Any:
    def solver(problem: Any, rng: np.random.Generator) -> str:
        problem.values(problem.sample(rng, many))
        return f"{many} tried"

    return solver


def test_all_runs_are_made_again_where_that_is_wished(tmp_path: Path) -> None:
    made = small(solvers={"guess": solvers()["guess"]}, seeds=1, noise=[Noise("white", 0.05)])
    first = compare(made, tmp_path).runs
    kept, again = compare(made, tmp_path).runs, compare(made, tmp_path, fresh=True).runs
    # No two searches take the same time to the last digit.
    assert kept["search_s"].tolist() == first["search_s"].tolist()
    assert (again["search_s"] != first["search_s"]).all()
    pd.testing.assert_frame_equal(numbers(compare(made, tmp_path)), numbers(compare(made, tmp_path, fresh=True)))
    for part in ((0, 2), (3, 2)):
        with pytest.raises(BadInput, match=f"there is no part {part[0]} of 2. Count the parts from 1"):
            compare(made, tmp_path, part=part)


def test_functions_made_with_other_values_are_other_solvers() -> None:
    keys = {
        small(solvers={"it": from_callable(function, name="it")}).runs[0].key
        for function in (tries(5), tries(6), functools.partial(guess), guess)
    }
    assert len(keys) == 4
    again = [small(solvers={"it": from_callable(tries(5), name="it")}).runs[0].key for _ in range(2)]
    assert again[0] == again[1]
    assert again[0] in keys


def test_a_failed_run_is_kept_with_its_reason_and_stops_no_other(tmp_path: Path) -> None:
    comparison = small(solvers={"local": make("least_squares"), "stumble": from_callable(stumble)})
    results = compare(comparison, tmp_path)
    assert results.left == 0
    assert set(results.failures["solver"]) == {"stumble"}
    assert results.failures["error"].str.contains("stumbled on purpose").all()
    ranking = results.ranking("accuracy")
    assert ranking is not None
    assert ranking.order == ["local", "stumble"]
    assert any("failed" in str(said) for said in results.conclusions)
    seen: list[ProgressEvent] = []
    compare(comparison, tmp_path, retry_failed=True, progress=seen.append)
    assert seen[0].left == 6


@pytest.mark.slow
def test_workers_find_compiled_kernels_and_make_none(tmp_path: Path) -> None:
    code = """
import sys, os
sys.path[:0] = [{here!r}, {above!r}]
from pathlib import Path
from small_comparison import small, glide
from seatruth.comparison import compare
from seatruth.comparison.worker import jobs_of
comparison = small(problems=[glide(costs=("trajectory", "regression"))], seeds=1)
jobs_of(comparison, list(comparison.runs))
def kernels():
    return {{path.name: path.stat().st_ino for path in Path(os.environ["SEATRUTH_CACHE"]).iterdir()}}
before = kernels()
assert compare(comparison, {out!r}, workers=2).left == 0
assert len(before) > 3
assert kernels() == before, (before, kernels())
"""
    code = code.format(here=str(HERE), above=str(HERE.parent), out=str(tmp_path / "out"))
    environment = {**os.environ, "SEATRUTH_CACHE": str(tmp_path / "kernels")}
    subprocess.run([sys.executable, "-c", code], check=True, env=environment)


def die(problem: Any, rng: np.random.Generator) -> str:
    problem.values(problem.sample(rng, 5))
    psutil.Process().kill()
    return ""


@pytest.mark.slow
def test_a_run_that_kills_its_process_is_found_and_the_others_go_on(tmp_path: Path) -> None:
    comparison = small(solvers={"local": make("least_squares"), "die": from_callable(die)}, seeds=1, noise=[Noise()])
    results = compare(comparison, tmp_path, workers=2)
    assert results.left == 0
    assert dict(zip(results.runs["solver"], results.runs["status"])) == {"local": "done", "die": "failed"}
    assert "ended its process" in results.failures["error"].iloc[0]


SCRIPT = """
import sys
sys.path[:0] = [{here!r}, {above!r}]
from small_comparison import slow
from seatruth.comparison import compare
compare(slow(), {out!r}, workers=2)
"""


def test_killed_at_any_moment_it_goes_on_and_ends_with_the_same(tmp_path: Path) -> None:
    from small_comparison import DOZE_S, slow

    code = SCRIPT.format(here=str(HERE), above=str(HERE.parent), out=str(tmp_path / "killed"))
    process = subprocess.Popen([sys.executable, "-c", code], env=os.environ | {DOZE_S: "0.5"})
    store = tmp_path / "killed" / STORE
    deadline = time.monotonic() + 60
    few = len(slow().references) + 4  # rows of references come first, and are no runs
    while _rows(store) < few and time.monotonic() < deadline and process.poll() is None:
        time.sleep(0.01)
    with pytest.raises(BadInput, match="another comparison is writing"):
        compare(slow(), tmp_path / "killed")
    assert standing(slow(), tmp_path / "killed").left < len(slow().runs)  # may be looked at meanwhile
    workers = psutil.Process(process.pid).children(recursive=True)
    assert len(workers) > 2
    process.kill()
    process.wait()
    assert not psutil.wait_procs(workers, timeout=30)[1]  # they end by themselves
    before = _rows(store)
    assert few <= before < len(slow().references) + len(slow().runs)
    seen: list[ProgressEvent] = []
    results = compare(slow(), tmp_path / "killed", workers=2, progress=seen.append)
    assert seen[0].done == before
    whole = compare(slow(), tmp_path / "whole", workers=1)
    pd.testing.assert_frame_equal(numbers(results), numbers(whole), check_exact=True)


def _rows(store: Path) -> int:
    try:
        base = sqlite3.connect(f"file:{store}?mode=ro", uri=True)
        try:
            return int(base.execute("SELECT count(*) FROM runs").fetchone()[0])
        finally:
            base.close()
    except sqlite3.Error:
        return 0


@pytest.mark.slow
def test_a_full_disk_ends_in_one_message_and_loses_nothing(tmp_path: Path) -> None:
    comparison = small(seeds=12)
    done = [run_job(job) for job in jobs_of(comparison, [*comparison.references, *comparison.runs])]
    hashes = {("line", "formula"): "x"}
    with Store(tmp_path / STORE) as store:
        pages = store._base.execute("PRAGMA page_count").fetchone()[0]
        store._base.execute(f"PRAGMA max_page_count = {pages + 1}")  # SQLite then says what it says of a full disk
        kept = 0
        with pytest.raises(SeatruthError, match=r"disk is full.*Free some space"):  # noqa: PT012
            for one in done:
                store.add(one, hashes)
                kept += 1
    assert 0 < kept < len(done)
    seen: list[ProgressEvent] = []
    results = compare(comparison, tmp_path, progress=seen.append)
    assert seen[0].left == len(comparison.runs) - max(0, kept - len(comparison.references))
    pd.testing.assert_frame_equal(numbers(results).drop(columns="study_hash"), _reference_numbers(tmp_path, comparison))


def _reference_numbers(tmp_path: Path, comparison: Any) -> pd.DataFrame:
    return numbers(compare(comparison, tmp_path / "reference")).drop(columns="study_hash")


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="limits of processes are POSIX")
def test_a_file_size_limit_in_the_middle_of_a_run_is_survived(tmp_path: Path) -> None:
    code = SCRIPT.format(here=str(HERE), above=str(HERE.parent), out=str(tmp_path)).replace("slow()", "small(seeds=30)")
    code = code.replace("import slow", "import small").replace("workers=2", "workers=1")
    limit = "import resource, signal; signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
    limit += "resource.setrlimit(resource.RLIMIT_FSIZE, (300_000, 300_000))\n"
    done = subprocess.run([sys.executable, "-c", limit + code], capture_output=True, text=True)
    assert "cannot be written" in done.stderr
    assert "All earlier runs are kept" in done.stderr
    left = standing(small(seeds=30), tmp_path).left
    assert 0 < left < len(small(seeds=30).runs)
    assert compare(small(seeds=30), tmp_path).left == 0


def test_stores_of_others_are_left_alone(tmp_path: Path) -> None:
    path = tmp_path / STORE
    path.write_text("my notes, not a database; long enough to be looked at as one" * 20)
    with pytest.raises(BadInput, match="no store of seatruth"):
        compare(small(), tmp_path)
    assert path.read_text().startswith("my notes")
    path.unlink()
    base = sqlite3.connect(path)
    base.execute("CREATE TABLE mine (x)")
    base.commit()
    base.close()
    with pytest.raises(BadInput, match="another program"):
        compare(small(), tmp_path)
    path.unlink()
    compare(small(seeds=1), tmp_path)
    base = sqlite3.connect(path)
    base.execute("PRAGMA user_version = 99")
    base.commit()
    base.close()
    with pytest.raises(BadInput, match=r"another version of seatruth \(format 99"):
        compare(small(seeds=1), tmp_path)
    with pytest.raises(BadInput, match="no such store"):
        standing(small(), tmp_path / "elsewhere")


def test_the_store_opens_with_ordinary_tools_and_says_where_it_comes_from(tmp_path: Path) -> None:
    compare(small(seeds=1), tmp_path)
    base = sqlite3.connect(tmp_path / STORE)
    runs = pd.read_sql_query(
        "SELECT solver, level, e.parameter, e.value, provenance FROM runs JOIN estimates e USING (key) "
        "JOIN sources ON sources.id = runs.source",
        base,
    )
    base.close()
    assert len(runs) == 12
    assert runs["provenance"].str.contains("numpy").all()
    assert set(runs["parameter"]) == {"a", "b"}


@pytest.mark.parametrize(
    "change",
    [
        "UPDATE runs SET value = value * (1 + 1e-15) WHERE key = :key",
        "UPDATE runs SET level = 0.06 WHERE key = :key",
        "UPDATE estimates SET value = value + 1e-12 WHERE key = :key AND parameter = 'a'",
        "DELETE FROM estimates WHERE key = :key AND parameter = 'b'",
        "UPDATE runs SET checksum = NULL WHERE key = :key",
        "UPDATE runs SET value = x'00ff' WHERE key = :key",
    ],
)
def test_a_changed_digit_is_noticed_and_its_run_made_again(tmp_path: Path, change: str) -> None:
    whole = numbers(compare(small(seeds=1), tmp_path))
    key = str(whole.query("solver == 'local' and level == 0.05")["key"].iloc[0])
    base = sqlite3.connect(tmp_path / STORE)
    assert base.execute(change, {"key": key}).rowcount == 1
    base.commit()
    base.close()
    with pytest.warns(SeatruthWarning, match="1 stored run is damaged"):
        assert standing(small(seeds=1), tmp_path).left == 1
    seen: list[ProgressEvent] = []
    with pytest.warns(SeatruthWarning, match="makes them again"):
        again = compare(small(seeds=1), tmp_path, progress=seen.append)
    assert seen[0].left == 1
    pd.testing.assert_frame_equal(numbers(again), whole, check_exact=True)
    assert standing(small(seeds=1), tmp_path).left == 0  # without a second warning


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ("ALTER TABLE runs DROP COLUMN reason", "other columns"),
        ("DROP TABLE estimates", "other columns"),
        ("ALTER TABLE fits ADD COLUMN more TEXT", "other columns"),
        ("UPDATE sources SET provenance = 'nonsense'", "damaged and left out"),
    ],
)
def test_a_store_with_other_tables_or_another_origin_of_its_runs_is_noticed(
    tmp_path: Path, change: str, says: str
) -> None:
    compare(small(seeds=1), tmp_path)
    with contextlib.closing(sqlite3.connect(tmp_path / STORE)) as base:
        base.execute(change)
        base.commit()
    with pytest.raises((BadInput, SeatruthWarning), match=says):
        standing(small(seeds=1), tmp_path)


def test_a_store_that_cannot_be_read_is_said(tmp_path: Path) -> None:
    compare(small(seeds=1), tmp_path)
    path = tmp_path / STORE
    content = bytearray(path.read_bytes())
    content[4096:] = b"\xff" * (len(content) - 4096)  # all pages but the first
    path.write_bytes(content)
    with pytest.raises(BadInput, match=r"damaged|no store of seatruth"):
        standing(small(seeds=1), tmp_path)


@pytest.mark.parametrize("name", ["noise_options", "finished_utc", "provenance", "checksum"])
def test_a_store_whose_column_names_are_no_text_is_refused(tmp_path: Path, name: str) -> None:
    """A byte of the schema changed: SQLite opens the file, and its names cannot be decoded."""
    path = tmp_path / "store.sqlite"
    with Store(path):
        pass
    with contextlib.closing(sqlite3.connect(path)) as base:
        base.execute("PRAGMA journal_mode = DELETE")
    whole = path.read_bytes()
    assert name.encode() in whole
    path.write_bytes(whole.replace(name.encode(), name[:3].encode() + b"\xd3" + name[4:].encode()))
    with pytest.raises(BadInput, match=r"store is damaged|no store"):
        _read(path)


def _read(path: Path) -> None:
    with Store(path, write=False) as store:
        store.known(["k"])
        store.frame("runs")
