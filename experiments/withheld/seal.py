"""What all steps share: files written whole, hashes, and the log that shows the order of the steps."""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]


def write(file: Path, text: str) -> None:
    """Writes a text file whole or not at all."""
    part = file.with_name(f"{file.name}.{os.getpid()}.part")
    part.write_text(text, encoding="utf-8", newline="\n")
    os.replace(part, file)


def digest_file(file: Path) -> str:
    """SHA-256 of a file."""
    return hashlib.sha256(file.read_bytes()).hexdigest()


def commit() -> str:
    """The commit that runs, with "+changes" where the working tree differs from it; empty outside of git."""

    def git(*words: str) -> str:
        done = subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=False)
        return done.stdout.strip()

    return git("rev-parse", "--short", "HEAD") + ("+changes" if git("status", "--porcelain") else "")


def note(out: Path, step: str, what: str, details: Mapping[str, Any]) -> None:
    """Adds a line to the log: when, which step, what. Each line holds the hash of those before."""
    file = out / "log.jsonl"
    before = file.read_bytes() if file.exists() else b""
    line = {
        "time": datetime.now(UTC).isoformat(timespec="seconds"),
        "step": step,
        "what": what,
        "commit": commit(),
        **details,
        "before": hashlib.sha256(before).hexdigest()[:16],
    }
    with file.open("ab") as stream:
        stream.write(json.dumps(line).encode() + b"\n")


def log(out: Path) -> list[dict[str, Any]]:
    """The log's lines; ValueError where one does not follow from those before it."""
    file = out / "log.jsonl"
    if not file.exists():
        return []
    lines, seen = [], b""
    for raw in file.read_bytes().splitlines(keepends=True):
        line = json.loads(raw)
        if line["before"] != hashlib.sha256(seen).hexdigest()[:16]:
            raise ValueError("the log was changed")
        lines.append(line)
        seen += raw
    return lines
