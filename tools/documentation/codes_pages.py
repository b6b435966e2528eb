"""One page a code of an error or a finding: what it is about, its causes and its remedies."""

from __future__ import annotations

from pathlib import Path

from seatruth.codes import Code, codes

_HEAD = """# Codes

Each error and each finding ends with a code in brackets. `seatruth explain CODE` shows the same page in the terminal.
The code of an error names the part of seatruth that raises it. Three dots stand for what a message fills in.

"""


def write(folder: Path) -> None:
    """Writes index.md and a page for each code."""
    folder.mkdir(parents=True, exist_ok=True)
    found = codes()
    lines = [_HEAD]
    for kind, title in (("finding", "Findings"), ("error", "Errors")):
        lines.append(f"## {title}\n\n")
        lines += [f"- [{code.name}]({code.name}.md)\n" for code in found.values() if code.kind == kind]
        lines.append("\n")
    lines.append("```{toctree}\n:hidden:\n:glob:\n*\n```\n")
    (folder / "index.md").write_text("".join(lines), encoding="utf-8")
    for code in found.values():
        (folder / f"{code.name}.md").write_text(page(code), encoding="utf-8")


def page(code: Code) -> str:
    """The page of a code in Markdown."""
    text = f"# {code.name}\n\n"
    if code.kind == "error":
        text += "An error: bad input, or a run that failed.\n\n"
    else:
        text += "A finding: something that a check says of data or of a result.\n\n"
    if code.about:
        text += f"{literal(code.about)}\n\n"
    rows = [f"| {cell(cause.message)} | {cell(cause.remedy) or 'the message says it'} |" for cause in code.causes]
    if code.kind == "finding":
        rows = [f"| {cause.severity} {row}" for cause, row in zip(code.causes, rows)]
        return text + "| severity | cause | what to do |\n|---|---|---|\n" + "\n".join(rows) + "\n"
    return text + "| cause | what to do |\n|---|---|\n" + "\n".join(rows) + "\n"


def cell(text: str) -> str:
    """Text that a cell of a table can hold."""
    return literal(" ".join(text.split())).replace("|", "\\|")


def literal(text: str) -> str:
    """Text in which Markdown finds nothing to format, but for code."""
    parts = text.split("`")
    for k in range(0, len(parts), 2):
        for sign in "\\*_[]<>{}$":
            parts[k] = parts[k].replace(sign, f"\\{sign}")
    return "`".join(parts)
