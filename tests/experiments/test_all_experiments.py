"""The driver of all experiments: finds them, says how long, goes on after a failure, exits with what happened."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

EXPERIMENTS = Path(__file__).resolve().parents[2] / "experiments"
sys.path.insert(0, str(EXPERIMENTS))

import all as driver  # noqa: E402

SCRIPT = (
    'import sys\nif __name__ == "__main__":\n    print("{name}", *sys.argv[1:], flush=True)\n    sys.exit({code})\n'
)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "ended.py").write_text(SCRIPT.format(name="ended", code=0))
    (tmp_path / "broken.py").write_text(SCRIPT.format(name="broken", code=3))
    (tmp_path / "helper.py").write_text("x = 1\n")
    (tmp_path / "ships").mkdir()
    (tmp_path / "ships" / "__main__.py").write_text(SCRIPT.format(name="ships", code=0))
    (tmp_path / "ships" / "body.py").write_text("def body(options):\n    options.trials()\n")
    return tmp_path


DRAWN_LATER = {"withheld"}
"""Experiments whose figure is drawn from the gallery's tables when the site is made (`withheld_picture`)."""


def test_each_experiment_has_its_section_in_the_gallery_with_its_figure_and_command() -> None:
    text = (EXPERIMENTS / "README.md").read_text(encoding="utf-8")
    sections = {part.partition(":")[0]: part for part in text.split("\n## ")[1:]}
    names = {one.name for one in driver.find()}
    assert names <= set(sections)
    for name in names - DRAWN_LATER:
        assert f"![{name}](figures/{name}.png)" in sections[name], name
        assert (EXPERIMENTS / "figures" / f"{name}.png").stat().st_size > 10_000
        command = "" if (EXPERIMENTS / name).is_dir() and not (EXPERIMENTS / f"{name}.py").exists() else ".py"
        assert f"`python experiments/{name}{command}`" in sections[name], name
    for name in DRAWN_LATER:
        assert f"make {name}" in sections[name], name


def test_experiments_are_found_and_those_without_their_trials_left_out(folder: Path) -> None:
    found = driver.find(folder)
    assert [(one.name, one.needs_trials) for one in found] == [("broken", False), ("ended", False), ("ships", True)]
    run, left_out = driver.chosen(found, [], folder / "nowhere")
    assert [one.name for one in run] == ["broken", "ended"]
    assert left_out == ["ships"]
    run, left_out = driver.chosen(found, ["ships"], folder)
    assert [one.name for one in run] == ["ships"]
    assert left_out == []
    with pytest.raises(SystemExit, match="no experiment 'boat'"):
        driver.chosen(found, ["boat"], folder)


def test_a_failure_does_not_stop_the_others(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    failed = driver.run(driver.find(folder), ["--quick"], True, folder / "results")
    assert failed == ["broken: exit code 3"]
    shown = capfd.readouterr().out
    assert "ended --quick" in shown
    assert "ships --quick" in shown
    assert "[3/3]" in shown


def test_side_by_side_each_one_s_words_stay_together(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Each waits until the other has begun: one after the other they would never end."""
    meet = (
        "import pathlib, sys, time\n"
        'if __name__ == "__main__":\n'
        "    own, other = (pathlib.Path(__file__).with_name(f'{{name}}.begun') for name in {names})\n"
        "    own.touch()\n"
        "    while not other.exists():\n"
        "        time.sleep(0.01)\n"
        "    print('first of', own.stem, flush=True)\n"
        "    print('to standard error', file=sys.stderr, flush=True)\n"
        "    sys.exit({code})\n"
    )
    (folder / "ended.py").write_text(meet.format(names=("ended", "broken"), code=0))
    (folder / "broken.py").write_text(meet.format(names=("broken", "ended"), code=3))
    both = [one for one in driver.find(folder) if one.name != "ships"]
    assert driver.run(both, [], True, folder / "results", jobs=2) == ["broken: exit code 3"]
    shown = capfd.readouterr().out
    for name in ("ended", "broken"):
        assert f"-- {name} says:\nfirst of {name}\nto standard error\n-- {name}: " in shown


def test_side_by_side_the_longest_begins_first(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    seconds = {"ended": 5.0, "broken": 2.0, "ships": 9.0}
    monkeypatch.setattr(driver, "expected", lambda name, *_: (seconds[name], "here"))
    driver.run(driver.find(folder), [], True, folder / "results", jobs=2)
    begun = re.findall(r"== \[\d/3\] (\w+)", capfd.readouterr().out)
    assert begun == ["ships", "ended", "broken"]


def test_an_interrupted_one_interrupts_those_beside_it(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(driver, "_END_S", 0.1)
    (folder / "broken.py").write_text(
        SCRIPT.format(name="broken", code=130).replace("    print", "    import time\n    time.sleep(1.0)\n    print")
    )
    endless = "import time\nif __name__ == \"__main__\":\n    print('begun', flush=True)\n    time.sleep(600)\n"
    (folder / "ended.py").write_text(endless)
    with pytest.raises(KeyboardInterrupt):
        driver.run(driver.find(folder)[:2], [], True, folder / "results", jobs=2)
    shown = capfd.readouterr().out
    assert "begun" in shown
    assert "KeyboardInterrupt" in shown


def test_the_exit_code_and_the_last_lines_say_what_failed(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    found = driver.find(folder)
    monkeypatch.setattr(driver, "find", lambda: found)
    assert driver.main(["--quick", "--jobs", "1", "--data", str(folder)]) == 1
    shown = capfd.readouterr().out
    assert "3 experiments, about 0 s from nothing, and 3 of unknown length" in shown
    assert shown.rstrip().endswith("Not all went well:\n  broken: exit code 3")
    assert driver.main(["--only", "ended", "--data", str(folder)]) == 0
    (folder / "broken.py").write_text(SCRIPT.format(name="broken", code=130))
    assert driver.main([]) == 130


def test_an_interrupt_stops_all(folder: Path) -> None:
    (folder / "broken.py").write_text(SCRIPT.format(name="broken", code=130))
    with pytest.raises(KeyboardInterrupt):
        driver.run(driver.find(folder), [], False, folder / "results")


def test_times_are_those_of_the_last_run_or_recorded_ones(folder: Path) -> None:
    results, durations = folder / "results", folder / "durations.json"
    assert driver.expected("ended", False, results, durations) == (None, "never run")
    durations.write_text(json.dumps({"machine": "4 cores", "full": {"ended": 9}, "quick": {}}))
    assert driver.expected("ended", False, results, durations) == (9.0, "4 cores")
    assert driver.expected("ended", True, results, durations) == (None, "never run")
    (results / "ended").mkdir(parents=True)
    stages = {"a": {"seconds": 30.0, "resumed": True}, "b": {"seconds": 2.0, "resumed": False}}
    (results / "ended" / "result.json").write_text(json.dumps({"wall_s": 5.0, "stages": stages}))
    assert driver.expected("ended", False, results, durations) == (35.0, "last run here")
    driver.record(driver.find(folder), results, durations)
    assert json.loads(durations.read_text())["full"] == {"ended": 35}
    assert driver.duration(35) == "35 s"
    assert driver.duration(354) == "5.9 min"
    assert driver.duration(None) == "?"


def test_the_small_version_of_every_experiment_has_a_duration() -> None:
    known = json.loads(driver.DURATIONS.read_text(encoding="utf-8"))["quick"]
    assert {one.name for one in driver.find()} - set(known) == set()


def test_those_that_are_not_run_twice_are_run_whole_by_a_slow_test(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    assert set(driver.TESTED) <= {one.name for one in driver.find()}
    for name in driver.TESTED:
        (test,) = Path(__file__).parent.glob(f"test_{name}*.py")
        text = test.read_text(encoding="utf-8")
        assert '"--quick", "--out"' in text, name
        assert "@pytest.mark.slow" in text, name
        assert f"{name}.body(options, results)" in text or f'"{name}.py"' in text, name
    found = driver.find(folder)
    monkeypatch.setattr(driver, "find", lambda: found)
    monkeypatch.setattr(driver, "TESTED", ("broken", "ships"))
    assert driver.main(["--quick", "--untested", "--jobs", "1"]) == 0
    shown = capfd.readouterr().out
    assert "ended --quick" in shown
    assert "broken" not in shown


def test_the_command_line_lists_all_there_are() -> None:
    command = [sys.executable, str(EXPERIMENTS / "all.py"), "--quick", "--list", "--data", str(EXPERIMENTS / "nowhere")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    assert "xu2012" in done.stdout
    assert re.search(r"real_ships +left out, it needs the real trials", done.stdout)
    assert re.search(r"\d+ experiments( \(\d side by side\))?, about", done.stdout)


HELP = """
import runpy, sys
for script in sys.argv[1:]:
    sys.argv = [script, "--help"]
    try:
        runpy.run_path(script, run_name="__main__")
    except SystemExit as ended:
        assert not ended.code, script
"""


@pytest.mark.slow
def test_each_experiment_shows_its_help() -> None:
    """All in one process, which loads the libraries once."""
    scripts = [str(one.script) for one in driver.find()]
    done = subprocess.run([sys.executable, "-c", HELP, *scripts], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("usage: ") == len(scripts)


def test_the_readme_shows_figures_that_exist() -> None:
    shown = re.findall(r"\]\((figures/[^)]+)\)", (EXPERIMENTS / "README.md").read_text())
    assert len(shown) >= 4
    for figure in shown:
        assert 1_000 < (EXPERIMENTS / figure).stat().st_size < 150_000
