"""Runs what README.md and docs/*.md show, as a reader would.

A block whose first line is a comment with a file's name is that file. Other Python blocks are run one after another in
one namespace, and so are the lines of console blocks that start with `$ seatruth`. All happens in the current folder.
"""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from seatruth.cli import run

ROOT = Path(__file__).parents[1]
_BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_FILE = re.compile(r"# (\S+\.(?:py|toml))\n")


def execute(document: str, **given: Any) -> dict[str, Any]:
    """Writes and runs all blocks of a document; returns the namespace of its Python blocks, which starts as `given`."""
    namespace: dict[str, Any] = {"__name__": "document", **given}
    for name, text in files(document).items():
        Path(name).write_text(text)
    for line, kind, block in blocks(document):
        if _FILE.match(block):
            continue
        if kind == "python":
            # Empty lines before it give an error the line that it has in the document.
            exec(compile("\n" * (line - 1) + block, document, "exec"), namespace)
        elif kind == "console":
            for command in block.splitlines():
                if command.startswith("$ seatruth "):
                    code = run(shlex.split(command, comments=True)[2:])
                    assert code == 0, f"{document}, line {line}: {command} ended with {code}"
    return namespace


def install(document: str, folder: Path) -> None:
    """Writes the files of a document that shows a package; pip installs it into the folder `site` beside them."""
    for name, text in files(document).items():
        (folder / name).write_text(text)
    pip = [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check", "install"]
    subprocess.run([*pip, "--no-deps", "--no-build-isolation", "--target", "site", "."], cwd=folder, check=True)


def files(document: str) -> dict[str, str]:
    """The files that a document shows, by name."""
    named = ((_FILE.match(block), block) for _, _, block in blocks(document))
    return {found[1]: block for found, block in named if found}


def blocks(document: str) -> Iterator[tuple[int, str, str]]:
    """First line, kind and text of each block."""
    text = (ROOT / document).read_text()
    for found in _BLOCK.finditer(text):
        yield text.count("\n", 0, found.start()) + 2, found[1], found[2]
