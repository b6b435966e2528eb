"""What all tests share."""

from __future__ import annotations

import os
import signal
from collections import Counter
from collections.abc import Generator, Iterator
from pathlib import Path

import pytest
from hypothesis import settings

# Workers of pytest-xdist share the processors already: more threads in each would only wait for one another.
if "PYTEST_XDIST_WORKER" in os.environ:
    for _library in ("SEATRUTH", "OPENBLAS_NUM", "OMP_NUM", "MKL_NUM"):
        os.environ.setdefault(f"{_library}_THREADS", "1")

# What a shell starts in the background ignores interrupts, and so do its children: those that test one need it back.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# On a busy machine a single example may take long for reasons that are not the code's.
settings.register_profile("seatruth", settings(deadline=None))
settings.load_profile("seatruth")

SLOW_LIST = Path(__file__).with_name("slow_tests.txt")
SLOW = 0.2
"""Processor time (s) of a test from which it counts as slow: so the fast ones take four minutes together."""
_BEGUN = pytest.StashKey[float]()
_PROPERTY = "processor_s"


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--cpu", action="store_true", help="list the files and tests that take the most processor time")
    parser.addoption("--write-slow", action="store_true", help=f"write the tests that take long to {SLOW_LIST.name}")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Marks as slow what took long when the list was last written, but for the essential."""
    listed = set(SLOW_LIST.read_text(encoding="utf-8").splitlines())
    for item in items:
        if item.nodeid in listed and not item.get_closest_marker("essential"):
            item.add_marker("slow")


@pytest.fixture(scope="session", autouse=True)
def _no_process_left() -> Iterator[None]:
    """Ends the processes that tests have left at work, before their coverage is added up."""
    yield
    from seatruth.workers import close_all  # not before the variables above are set

    close_all()


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    item.stash[_BEGUN] = _processor_seconds()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Adds to a phase's report what the phase took: properties travel from a worker of pytest-xdist to the summary."""
    report = yield
    now = _processor_seconds()
    report.user_properties.append((_PROPERTY, now - item.stash.get(_BEGUN, now)))
    item.stash[_BEGUN] = now
    return report


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    tests: Counter[str] = Counter()
    files: Counter[str] = Counter()
    calls: Counter[str] = Counter()
    for reports in terminalreporter.stats.values():
        for report in reports:
            if isinstance(report, pytest.TestReport):
                seconds = dict(report.user_properties)[_PROPERTY]
                tests[f"{report.nodeid} ({report.when})"] += seconds
                files[report.nodeid.partition("::")[0]] += seconds
                # What a fixture of a whole file takes, its first test has to bear by chance.
                calls[report.nodeid] += seconds * (report.when == "call")
    if config.getoption("--write-slow"):
        known = {line for line in SLOW_LIST.read_text(encoding="utf-8").splitlines() if line not in calls}
        slow = known | {name for name, seconds in calls.items() if seconds > SLOW}
        SLOW_LIST.write_text("".join(f"{name}\n" for name in sorted(slow)), encoding="utf-8")
    if not config.getoption("--cpu"):
        return
    terminalreporter.section(f"processor time of the tests: {files.total():.0f} s")
    for name, seconds in [*files.most_common(30), *tests.most_common(60)]:
        terminalreporter.line(f"{seconds:8.2f} s  {name}")


def _processor_seconds() -> float:
    """Processor time of this process and of the children that have ended, s."""
    return sum(os.times()[:4])
