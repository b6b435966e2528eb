"""Codes of errors and findings: what each means, its causes and its remedies, read from the sources.

The code of an error names the part of seatruth that raises it: `readers-csv-file` is `seatruth.readers.csv_file`. The
code of a finding is written where it is made. What the sources say to a user is also what this list says, so that it
cannot be out of date. Constants stand in a message as numbers; three dots stand for what is filled in at run time.
"""

from __future__ import annotations

import ast
import functools
import importlib
import operator
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from seatruth.errors import code_of_module

_SOURCES = Path(__file__).parent
_ERRORS = {"SeatruthError", "BadInput", "PluginError", "Interrupted", "CannotWrite", "DiskFull", "StaleCheckpoint"}
_FINDINGS = {"Finding": 0, "make_finding": 1}
"""Functions that make a finding, with the position of its severity; code, message and remedy follow, the latter by name
or after the place."""


_MAKERS = _ERRORS | {*_FINDINGS, "add"}


@dataclass(frozen=True)
class Cause:
    """One message that a code stands for, and what to do. "" where the message itself says it."""

    message: str
    remedy: str
    severity: str = "error"


@dataclass(frozen=True)
class Code:
    """A code: what part it is about and its causes, in the order of the sources."""

    name: str
    kind: str
    """"error" or "finding"."""
    about: str
    causes: list[Cause] = field(default_factory=list)


@functools.cache
def codes() -> dict[str, Code]:
    """All codes by name, errors first."""
    errors: dict[str, Code] = {}
    findings: dict[str, Code] = {}
    about_plugins = "A model, an effect, an optimizer or a reader that does not come with seatruth."
    for path in sorted(_SOURCES.rglob("*.py")):
        module = "seatruth." + ".".join(path.relative_to(_SOURCES).with_suffix("").parts).removesuffix(".__init__")
        tree = _WithConstants(module).visit(ast.parse(path.read_text(encoding="utf-8")))
        pairs = _pairs(tree)
        about = (ast.get_docstring(tree) or "").split("\n\n")[0].replace("\n", " ")
        for call in _calls(tree):
            name = _name(call)
            known = _assigned(tree, call.lineno)
            if name in _ERRORS and call.args:
                code = code_of_module(module)
                errors.setdefault(code, Code(code, "error", about)).causes.append(_error(call, known))
            elif name == "add" and len(call.args) >= 2 and ast.unparse(call.func) == "problems.add":
                # A study's problems are collected, and raised together by one module.
                code = code_of_module("seatruth.study.validation")
                errors.setdefault(code, Code(code, "error", "")).causes.append(_problem(call, known))
            elif name in _FINDINGS:
                for made, cause in _finding(call, known, _FINDINGS[name], pairs):
                    findings.setdefault(made, Code(made, "finding", about)).causes.append(cause)
    errors["plug-in"] = Code("plug-in", "error", about_plugins, [Cause("what the plug-in says", "Ask its author.")])
    return {**dict(sorted(errors.items())), **dict(sorted(findings.items()))}


class _WithConstants(ast.NodeTransformer):
    """Writes constants of the sources into the texts that show them: a threshold is the same in every run."""

    def __init__(self, module: str) -> None:
        self.module = module

    def visit_FormattedValue(self, node: ast.FormattedValue) -> ast.expr:
        spec = "" if node.format_spec is None else _text(node.format_spec)
        try:
            return ast.Constant(format(self._number(node.value), spec))
        except (LookupError, ValueError):
            return node

    def _number(self, node: ast.expr) -> float:
        """The value of arithmetic with constants. Raises LookupError for anything else."""
        if isinstance(node, ast.Constant) and isinstance(node.value, (int, float)):
            return node.value
        if isinstance(node, ast.BinOp) and type(node.op) in _ARITHMETIC:
            return float(_ARITHMETIC[type(node.op)](self._number(node.left), self._number(node.right)))
        name = ast.unparse(node)
        if isinstance(node, (ast.Name, ast.Attribute)) and _CONSTANT.fullmatch(name):
            value = operator.attrgetter(name)(importlib.import_module(self.module))
            if isinstance(value, (int, float)):
                return value
        raise LookupError(name)


_ARITHMETIC: Mapping[type[ast.operator], Callable[[float, float], float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
}
_CONSTANT = re.compile(r"(?:[a-z_]+\.)?_?[A-Z][A-Z0-9_]+")
_OPEN = "\x00{0}\x01"
"""What is filled in at run time, by a short name, until the whole text is known."""
_FILLED = re.compile("\x00[^\x01]*\x01")


def _dots(text: str) -> str:
    """The text with three dots for each part that is filled in; "" where that is all of it."""
    text = re.sub(r"\.{4,}", "...", _FILLED.sub("...", text))
    return text if re.search(r"\w", text) else ""


_OWN_WORDS = "what the message says"
"""The cause, or the remedy, where the sources have no text but what is filled in."""


def _said(node: ast.expr | None) -> str:
    """A text as it is shown; "" where there is none."""
    text = _text(node)
    return _dots(text) or (text and _OWN_WORDS)


def _calls(tree: ast.AST) -> Iterator[ast.Call]:
    found = [node for node in ast.walk(tree) if isinstance(node, ast.Call) and _name(node) in _MAKERS]
    return iter(sorted(found, key=lambda call: (call.lineno, call.col_offset)))


def _name(call: ast.Call) -> str:
    return call.func.attr if isinstance(call.func, ast.Attribute) else getattr(call.func, "id", "")


def _assigned(tree: ast.AST, line: int) -> dict[str, ast.expr]:
    """The texts that variables hold at a line, as far as they are assigned above it in the same function."""
    around = [
        node
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef) and node.lineno <= line <= (node.end_lineno or 0)
    ]
    found: dict[str, ast.expr] = {}
    made = [node for node in ast.walk(around[-1]) if isinstance(node, ast.Assign)] if around else []
    for node in sorted(
        made, key=lambda node: node.lineno
    ):  # the last one above the line counts, however deep it stands
        if not (node.lineno < line and isinstance(node.targets[0], ast.Name)):
            continue
        if isinstance(node.value, (ast.Constant, ast.JoinedStr, ast.BinOp, ast.IfExp)):
            found[node.targets[0].id] = node.value
    return found


def _error(call: ast.Call, known: Mapping[str, ast.expr]) -> Cause:
    keywords = {keyword.arg: keyword.value for keyword in call.keywords}
    return Cause(_said(_value(call.args[0], known)) or _OWN_WORDS, _said(_value(keywords.get("do"), known)))


def _problem(call: ast.Call, known: Mapping[str, ast.expr]) -> Cause:
    do = call.args[2] if len(call.args) > 2 else None
    return Cause(_said(_value(call.args[1], known)) or _OWN_WORDS, _said(_value(do, known)))


def _value(node: ast.expr | None, known: Mapping[str, ast.expr]) -> ast.expr | None:
    return known.get(node.id, node) if isinstance(node, ast.Name) else node


def _finding(
    call: ast.Call, known: Mapping[str, ast.expr], first: int, pairs: Sequence[Mapping[str, str]]
) -> Iterator[tuple[str, Cause]]:
    """The code of a finding with its cause; one for each pair of channels where the code names two."""
    names = ("severity", "code", "message", "where", "do") if first == 0 else ("severity", "code", "message", "do")
    given = dict(zip(names, call.args[first:])) | {k.arg: k.value for k in call.keywords if k.arg in names}
    message, do, severity = (_text(_value(given.get(part), known)) for part in ("message", "do", "severity"))
    code = given.get("code")
    if isinstance(code, ast.Constant):
        yield str(code.value), Cause(_dots(message) or _OWN_WORDS, _dots(do) or (do and _OWN_WORDS), _dots(severity))
    elif isinstance(code, ast.JoinedStr):
        for pair in pairs:
            filled = [_dots(_filled(text, pair)) for text in (message, do, severity)]
            yield _filled(_text(code), pair), Cause(filled[0] or _OWN_WORDS, *filled[1:])


def _pairs(tree: ast.Module) -> list[dict[str, str]]:
    """The pairs of an angle and its rate that a module checks: what its constant `_PAIRS` holds."""
    for node in tree.body:
        # Another module's constant of this name may be computed.
        if (
            isinstance(node, ast.Assign)
            and isinstance(node.value, ast.Tuple)
            and ast.unparse(node.targets[0]) == "_PAIRS"
        ):
            return [dict(zip(("angle", "rate"), pair)) for pair in ast.literal_eval(node.value)]
    return []


def _filled(text: str, words: Mapping[str, str]) -> str:
    for name, word in words.items():
        text = text.replace(_OPEN.format(name), word)
    return text


def _text(node: ast.expr | None) -> str:
    """A message as the sources have it, with marks where something is filled in."""
    if node is None:
        return ""
    if isinstance(node, ast.Constant):
        return str(node.value)
    if isinstance(node, ast.JoinedStr):
        return "".join(_text(part) for part in node.values)
    if isinstance(node, ast.FormattedValue):
        return _OPEN.format(_placeholder(node.value))
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        return _text(node.left) + _text(node.right)
    if isinstance(node, ast.IfExp):
        return f"{_text(node.body)} / {_text(node.orelse)}" if _text(node.orelse) else _text(node.body)
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in ("strip", "join"):
        return _text(node.func.value) or _OPEN.format("...")
    if isinstance(node, ast.Call) and ast.unparse(node.func) == "nearest":
        return "The nearest known name is suggested."
    return _OPEN.format(_placeholder(node))


def _placeholder(node: ast.expr) -> str:
    """A short name of what is filled in: the last word of a variable, else three dots."""
    found = re.findall(r"[A-Za-z_]+", ast.unparse(node))
    plain = ("str", "len", "repr", "join", "sorted", "size", "sum")
    words = [word for word in found if len(word) > 2 and word not in plain]
    return words[-1].strip("_").replace("_", " ") if words and len(found) <= 4 else "..."
