"""What differs on Windows, tried on any system as far as that goes, and tests that must not ask it for POSIX."""

from __future__ import annotations

import ast
import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any, NoReturn

import pytest

from seatruth import processes
from seatruth.readers import child
from seatruth.storage import atomic, cache_folder

TESTS = Path(__file__).parent
ROOT = TESTS.parent
POSIX = re.compile(
    r"\bimport (?:\w+, )*(?:fcntl|resource)\b|\bfrom (?:fcntl|resource) import\b"
    r"|\bsignal\.SIG(?:KILL|STOP|CONT|HUP|ALRM|XFSZ)\b|\bos\.(?:mkfifo|fork|geteuid|getuid|killpg)\b"
    r"|\bos\.kill\(.*, signal\."  # there it ends the process, whatever the signal
)
GUARD = re.compile(r"skipif\(.*(?:os\.name|sys\.platform|hasattr)|importorskip\('(?:fcntl|resource)'\)")


def unguarded(text: str) -> Iterator[str]:
    """Names of the statements of a test module that use what Windows lacks, with nothing that skips them there.

    A text at the top of a module is the source of a child process: what uses it needs the guard.
    """
    texts: list[str] = []
    for statement in ast.parse(text).body:
        source = ast.unparse(statement)
        if isinstance(statement, ast.Assign) and isinstance(statement.value, ast.Constant):
            if POSIX.search(str(statement.value.value)):
                texts += [target.id for target in statement.targets if isinstance(target, ast.Name)]
            continue
        uses = POSIX.search(source) or any(re.search(rf"\b{name}\b", source) for name in texts)
        if uses and not GUARD.search(source):
            yield getattr(statement, "name", source.splitlines()[0])


def windows_os(**instead: Any) -> ModuleType:
    """The module `os` with the name of Windows, for one module: pathlib must go on as on this system."""
    module = ModuleType("os")
    vars(module).update({**vars(os), "name": "nt", **instead})
    return module


def never(*_: object) -> NoReturn:
    raise AssertionError("Windows has no such call, or it does something else there")


@pytest.fixture
def ended() -> int:
    """The number of a process that has ended."""
    process = subprocess.Popen([sys.executable, "-I", "-S", "-c", ""])
    process.wait()
    return process.pid


def test_a_worker_looks_for_its_parent_by_number(monkeypatch: pytest.MonkeyPatch, ended: int) -> None:
    codes = []

    def leave(code: int) -> NoReturn:
        codes.append(code)
        raise SystemExit

    monkeypatch.setattr(processes, "os", windows_os(getppid=never, _exit=leave))
    assert processes._is_parent(os.getpid())
    assert not processes._is_parent(ended)
    with pytest.raises(SystemExit):
        processes._watch(ended)
    assert codes == [1]


def test_without_sighup_only_sigterm_interrupts(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delattr(signal, "SIGHUP", raising=False)
    before = signal.getsignal(signal.SIGTERM)
    try:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        processes.interrupt_at_signals()
        with pytest.raises(KeyboardInterrupt, match="SIGTERM"):
            signal.raise_signal(signal.SIGTERM)
    finally:
        signal.signal(signal.SIGTERM, before)
    assert "SIGTERM ends this run" in capfd.readouterr().err


def test_no_signal_asks_whether_a_process_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, ended: int) -> None:
    monkeypatch.setattr(atomic, "os", windows_os(kill=never))
    left = tmp_path / f".{'0' * 16}-{atomic._HOST}-{ended}.part"
    left.touch()
    atomic.write_file(tmp_path / "a.txt", "text")
    assert {path.name for path in tmp_path.iterdir()} == {"a.txt", left.name}


def test_a_folder_that_cannot_be_opened_is_written_to(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plain = os.open

    def files_only(path: Path, *options: int) -> int:
        if Path(path).is_dir():
            raise PermissionError(13, "Permission denied")
        return plain(path, *options)

    monkeypatch.setattr(atomic, "os", windows_os(open=files_only))
    atomic.write_files(tmp_path, {"a.txt": "text"})
    atomic.write_file(tmp_path / "b.txt", "text")
    assert {path.read_bytes() for path in tmp_path.iterdir()} == {b"text"}


def test_the_cache_stands_where_windows_keeps_caches(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cache_folder, "os", windows_os(geteuid=never))
    for name in (cache_folder.CACHE, "XDG_CACHE_HOME", "LOCALAPPDATA"):
        monkeypatch.delenv(name, raising=False)
    assert cache_folder._chosen() == Path.home() / ".cache" / "seatruth"
    monkeypatch.setenv("LOCALAPPDATA", str(tmp_path / "local"))
    assert cache_folder.folder() == tmp_path / "local" / "seatruth"
    cache_folder.write_kept(tmp_path / "local" / "seatruth" / "a", b"head", b"content")
    assert cache_folder.read_kept(tmp_path / "local" / "seatruth" / "a", b"head", 1000) == b"content"
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "own"))
    assert cache_folder.folder() == tmp_path / "own" / "seatruth"


def test_a_reader_goes_on_where_nothing_can_be_limited(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "resource", None)
    child.limit(memory=1, seconds=0)  # with these limits this process would end
    assert len(bytes(1 << 24)) == 1 << 24


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("import os, fcntl", ["import os, fcntl"]),
        ("def test_a():\n    os.kill(1, signal.SIGKILL)", ["test_a"]),
        ("@pytest.mark.skipif(os.name == 'nt', reason='')\ndef test_a():\n    os.mkfifo('a')", []),
        ("@pytest.mark.parametrize('n', [signal.SIGSTOP])\ndef test_a(n):\n    pass", ["test_a"]),
        ("CODE = 'import resource, sys'\ndef test_a():\n    run(CODE)", ["test_a"]),
        ("CODE = 'import resource'\ndef ran():\n    pytest.importorskip('resource')\n    run(CODE)", []),
        ("class TestA:\n    def test_a(self):\n        os.kill(os.getpid(), signal.SIGINT)", ["TestA"]),
        ("from importlib import resources\nsignal.signal(signal.SIGINT, None)", []),
    ],
)
def test_what_only_posix_has_is_seen(text: str, names: list[str]) -> None:
    assert list(unguarded(text)) == names


def test_no_test_asks_windows_for_what_only_posix_has() -> None:
    found = {
        f"{path.relative_to(TESTS).as_posix()}: {name}"
        for path in TESTS.rglob("*.py")
        if path != Path(__file__)
        for name in unguarded(path.read_text(encoding="utf-8"))
    }
    assert not found


def test_text_files_are_opened_with_their_encoding() -> None:
    """Windows would take the code page of the user for them."""
    bare = []
    for path in (path for part in ("src", "optimizers", "tools") for path in (ROOT / part).rglob("*.py")):
        for call in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(call, ast.Call) or any(word.arg == "encoding" for word in call.keywords):
                continue
            name = ast.unparse(call.func)
            binary = any(
                isinstance(one, ast.Constant) and re.fullmatch("[rwax+]*b[+]?", str(one.value)) for one in call.args
            )
            if name == "open" or (re.search(r"\.(?:open|fdopen)$", name) and name != "os.open"):
                bare += [] if binary else [f"{path.relative_to(ROOT)}:{call.lineno}"]
            elif re.search(r"\.(?:read_text|write_text)$", name):
                bare.append(f"{path.relative_to(ROOT)}:{call.lineno}")
    assert not bare, bare
