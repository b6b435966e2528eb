"""The reference, written from the code: public names, the command line, models, optimizers, effects, JSON."""

from __future__ import annotations

import inspect
import io
import json
import re
from collections.abc import Mapping, Sequence
from contextlib import redirect_stdout, suppress
from pathlib import Path
from typing import Any

from codes_pages import cell, literal

import seatruth
from seatruth import cli
from seatruth.commands import list_installed as installed
from seatruth.commands.list_installed import Kind

_PYTHON = """# Python

Everything that `import seatruth` offers, written from the sources. The examples are run as tests.

"""


def write(folder: Path) -> None:
    """Writes the generated pages."""
    folder.mkdir(parents=True, exist_ok=True)
    pages = {
        "python.md": _PYTHON + "".join(_name(name) for name in seatruth.__all__ if name != "__version__"),
        "commands.md": _commands(),
        "models.md": _entries(
            Kind.models, "Models", "The vehicles that come with seatruth: `seatruth list models --long`."
        ),
        "optimizers.md": _entries(
            Kind.optimizers, "Optimizers", "The solvers that come with seatruth: `seatruth list optimizers --long`."
        ),
        "costs.md": _entries(Kind.costs, "Costs", "The kinds of cost: `seatruth list costs --long`."),
        "json.md": _json(),
    }
    for name, text in pages.items():
        (folder / name).write_text(text, encoding="utf-8")


def _name(name: str) -> str:
    kind: Any = getattr(seatruth, name)
    text = f"## {name}\n\n"
    with suppress(TypeError, ValueError):  # some have no signature
        text += f"```python\n{_signature(name, kind)}\n```\n\n"
    text += document(inspect.getdoc(kind) or "")
    if inspect.isclass(kind):
        for member, value in vars(kind).items():
            if member.startswith("_") or not (inspect.isfunction(value) or isinstance(value, (property, classmethod))):
                continue
            doc = inspect.getdoc(value)
            if doc:
                function = getattr(value, "__func__", value)
                call = "" if isinstance(value, property) else re.sub(r"^\((self|cls)(, )?", "(", _arguments(function))
                text += f"### {name}.{member}\n\n```python\n{member}{call}\n```\n\n{document(doc)}"
    return text


def _signature(name: str, kind: Any) -> str:
    return f"{name}{_arguments(kind)}"


def _arguments(kind: Any) -> str:
    text = str(inspect.signature(kind))
    return re.sub(r"\bseatruth(\.\w+)+\.(\w+)", r"\2", text)


def document(doc: str) -> str:
    """A docstring in Markdown: its sections as headings in bold, arguments as a list, examples as code."""
    out: list[str] = []
    section = ""
    code = False
    for line in doc.splitlines():
        bare = line.strip()
        if code and not bare:
            out.append("```\n")
            code = False
        if found := re.fullmatch(r"(Args|Attributes|Returns|Raises|Yields|Example|Examples):", line):
            section = found[1]
            out.append(f"\n**{section}**\n")
            continue
        if section and line and not line.startswith(" "):
            section = ""
        if bare.startswith(">>>") and not code:
            out.append("\n```pycon")
            code = True
        if code:
            out.append(line[4:] if section else line)
        elif section in ("Args", "Attributes", "Raises") and (
            part := re.fullmatch(r"    (\*{0,2}\w[\w, ]*): (.*)", line)
        ):
            out.append(f"- `{part[1]}`: {literal(part[2])}")
        elif section.startswith("Example") and line.startswith("        "):
            out.append(f"    {line.strip()}")
        else:
            out.append(("  " if section in ("Args", "Attributes", "Raises") and bare else "") + literal(bare))
    if code:
        out.append("```")
    return "\n".join(out).replace("\n\n\n", "\n\n") + "\n\n"


def _commands() -> str:
    text = "# Commands\n\nWhat `seatruth COMMAND --help` prints.\n\n"
    for name in ("", *cli.COMMANDS):
        shown = io.StringIO()
        with redirect_stdout(shown):
            cli.run([*([name] if name else []), "--help"])
        text += f"## seatruth {name}\n\n```text\n{shown.getvalue().strip()}\n```\n\n"
    return text


def _entries(kind: Kind, title: str, about: str) -> str:
    entries, _ = installed._LISTS[kind]()
    text = f"# {title}\n\n{about}\n\n"
    for entry in entries:
        text += f"## {entry['name']}\n\n{literal(str(entry.get('title', '')))}\n\n"
        if entry.get("about"):
            text += document(str(entry["about"]))
        for part in ("kind", "states", "inputs", "outputs", "needs", "source", "sets"):
            if entry.get(part):
                value = entry[part]
                shown = ", ".join(map(str, value)) if isinstance(value, list) else str(value)
                text += f"- **{part}**: {literal(shown)}\n"
        for part in ("options", "parameters"):
            if entry.get(part):
                text += "\n" + table(entry[part])
        text += "\n"
    return text


def table(rows: Sequence[Mapping[str, Any]]) -> str:
    """Rows with equal keys as a table."""
    columns = list(rows[0])
    lines = [f"| {' | '.join(columns)} |", "|" + "---|" * len(columns)]
    for row in rows:
        values = [f"{value:g}" if isinstance(value := row[column], float) else str(value) for column in columns]
        lines.append(f"| {' | '.join(cell(value) for value in values)} |")
    return "\n".join(lines) + "\n"


def _json() -> str:
    """The layout of what `--json` writes, from calls on the sample."""
    import tempfile

    import seatruth.sample

    text = (
        "# JSON\n\nEvery command takes `--json FILE`. The keys, with the types of their values, as the commands write "
    )
    text += "them for the synthetic sample; [diagnosis](../diagnosis.md) describes `diagnosis.json`.\n\n"
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        seatruth.sample.copy_to(folder)
        (folder / "compare.toml").write_text(_COMPARISON, encoding="utf-8")
        for command, options in _CALLS.items():
            answer = _answer(command, options.split(), folder)
            text += f"## {command}\n\n```text\n" + "\n".join(layout(answer)) + "\n```\n\n"
    return text + "## demo\n\nThe keys of `identify`, and under `diagnosis` those of `diagnose`.\n"


_CALLS = {
    "init": "init DIR/zigzag_20_20.csv --output DIR/log.toml",
    "trials": "trials DIR/zigzag_20_20.csv",
    "check": "check DIR/study.toml",
    "simulate": "simulate DIR/study.toml",
    "identify": "identify DIR/study.toml --evaluations 60 --quiet --out DIR/result",
    "predict": "predict DIR/study.toml --draws 60 --turn 35 --result DIR/result --quiet",
    "diagnose": "diagnose DIR/diagnose.toml --effects current,rudder_offset --no-validation --no-next-trial --quiet",
    "compare": "compare DIR/compare.toml --workers 1 --quiet",
    "list": "list costs",
    "explain": "explain outliers",
}
"""Calls that show the JSON of each command but demo, which runs two of them; DIR holds the sample."""
_COMPARISON = """
[comparison]
name = "two solvers"
seeds = 2
budgets = [40]

[[problems]]
study = "log.toml"
truth = "study"

[[solvers]]
use = "least_squares"

[[solvers]]
use = "nelder_mead"

[[noise]]
kind = "white"
levels = [0.01]
"""


def _answer(command: str, options: Sequence[str], folder: Path) -> Any:
    """What a command writes as JSON; its words are not shown."""
    file = folder / f"{command}.json"
    with redirect_stdout(io.StringIO()) as said:
        code = cli.run([*(option.replace("DIR", str(folder)) for option in options), "--json", str(file)])
    if code:
        raise RuntimeError(f"seatruth {command} ended with {code}: {said.getvalue()}")
    return json.loads(file.read_text(encoding="utf-8"))


def layout(value: Any, depth: int = 0) -> list[str]:
    """Keys and types of a JSON value, nested by indentation; of a list its first entry."""
    lines = []
    for key, item in value.items() if isinstance(value, dict) else ():
        kind = {dict: "object", list: "list", str: "text", bool: "true or false", type(None): "null"}.get(
            type(item), "number"
        )
        lines.append(f"{'  ' * depth}{key}: {kind}")
        inner = item[0] if isinstance(item, list) and item else item
        if isinstance(inner, dict) and depth < 3:
            lines += layout(inner, depth + 1)
    return lines
