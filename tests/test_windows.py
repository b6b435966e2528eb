"""What differs on Windows, tried on any system as far as that goes, and tests that must not ask it for POSIX."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

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
