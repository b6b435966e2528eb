"""A headless Chromium for tests of pages: what it logs, what a script finds on a page, and what it prints."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

CHROMIUM = next(
    (path for name in ("chromium", "chromium-browser", "google-chrome") if (path := shutil.which(name))), None
)
needs_chromium = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is installed")

_FLAGS = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-extensions", "--no-first-run"),
    *("--allow-file-access-from-files", "--enable-logging=stderr", "--hide-scrollbars"),
)
_FRAME = """<!DOCTYPE html><meta charset="utf-8"><body>
<iframe src="{page}" width="{width}" height="900" style="border:0"></iframe>
<script>
document.querySelector("iframe").addEventListener("load", event => {{
  const inner = event.target.contentWindow, page = inner.document;
  let found;
  try {{ found = (() => {{ {script} }})(); }} catch (problem) {{ found = {{ error: String(problem) }}; }}
  const answer = document.createElement("pre");
  answer.id = "answer";
  answer.textContent = JSON.stringify(found);
  document.body.replaceChildren(answer);
}});
</script>"""


def ask(page: Path, script: str, *, width: int = 1200) -> tuple[Any, list[str]]:
    """What a script returns that sees the page as `page` and its window as `inner`, and what the browser logged.

    The page is the file as it is, in a frame of `width` pixels beside the script.
    """
    frame = page.with_name(f"frame-{page.name}")
    frame.write_text(_FRAME.format(page=page.name, width=width, script=script), encoding="utf-8")
    done = _chromium("--virtual-time-budget=8000", "--dump-dom", frame.as_uri(), profile=page.with_name("profile"))
    answer = re.search(r'<pre id="answer">(.*?)</pre>', done.stdout, re.DOTALL)
    assert answer is not None, done.stderr[-2000:]
    text = answer[1].replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&")
    return json.loads(text), [line for line in done.stderr.splitlines() if "CONSOLE" in line]


def printed(page: Path) -> bytes:
    """The page as a PDF."""
    target = page.with_suffix(".pdf")
    _chromium(f"--print-to-pdf={target}", "--no-pdf-header-footer", page.as_uri(), profile=page.with_name("profile"))
    return target.read_bytes()


def _chromium(*arguments: str, profile: Path) -> subprocess.CompletedProcess[str]:
    assert CHROMIUM is not None
    command = [CHROMIUM, *_FLAGS, f"--user-data-dir={profile}", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, check=True)
