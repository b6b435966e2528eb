"""The `[[trials]]` of a study as text, and their place in a study file that is otherwise left as it is."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Sequence
from fnmatch import fnmatchcase
from pathlib import Path

from seatruth.errors import BadInput
from seatruth.study.file_patterns import is_pattern
from seatruth.study.load import parse
from seatruth.study.toml_positions import Lines
from seatruth.trials.stretches import Stretch


def trial_tables(stretches: Sequence[Stretch], file: str) -> str:
    """One `[[trials]]` table for each stretch of the log `file`, as the study file will name it.

    Example:
        >>> print(trial_tables([Stretch("zigzag", "zigzag 20/20", 10.0, 95.5, "rudder 20 deg", name="zz")], "log.csv"))
        [[trials]]   # zigzag 20/20: rudder 20 deg
        name = "zz"
        file = "log.csv"
        prepare = [{ step = "cut", start = 10.0, end = 95.5 }]
        <BLANKLINE>
    """
    blocks = []
    for stretch in stretches:
        said = " ".join(f"{stretch.label}: {stretch.facts}".split())
        lines = [f"[[trials]]   # {said}", f"name = {_text(stretch.name)}", f"file = {_text(file)}"]
        if stretch.where:
            lines.append(f"where = {_text(stretch.where)}")
        else:
            start, end = (
                round(stretch.start, 6),
                round(stretch.end, 6),
            )  # rounding noise of clocks is none of the user's
            lines.append(f'prepare = [{{ step = "cut", start = {start!r}, end = {end!r} }}]')
        blocks.append("\n".join(lines) + "\n")
    return "\n".join(blocks)


def with_trials(text: str, tables: str, file: str, source: str) -> str:
    """A study's text in which `tables` stand in place of the `[[trials]]` that took `file`; comments stay as they are.

    What those that they replace are all without, they are without as well.

    Raises:
        BadInput: the study is not valid, has a form in which its trials cannot be replaced safely, or takes the file by
            a pattern too.
    """
    before = parse(text, source)[0]
    taking = next((trial.file for trial in before.trials if _is_taken(file, trial.file)), None)
    if taking is not None:
        raise BadInput(
            f"its [[trials]] take {file!r} by the pattern {taking!r} already, and would hold it twice",
            where=source,
            do="Give each of the files of the pattern its own [[trials]]; then run this again.",
        )
    tables = _without(tables, [trial.without for trial in before.trials if Path(trial.file) == Path(file)])
    lines, ends = text.splitlines(keepends=True), _headers(text)
    mine = [k for k, trial in enumerate(before.trials) if Path(trial.file) == Path(file)]
    positions = Lines(text).positions
    drop: set[int] = set()
    for k in mine:
        first = positions.get(("trials", k))
        if first is None or ("trials", k) not in ends:
            raise _by_hand(source)
        drop.update(range(first - 1, ends[("trials", k)] - 1))
    at = min(drop, default=len(lines))
    kept = [line for number, line in enumerate(lines) if number not in drop]
    head, tail = "".join(kept[:at]), "".join(kept[at:])
    joined = head + ("" if not head or head.endswith("\n\n") else "\n" if head.endswith("\n") else "\n\n")
    result = joined + tables + ("\n" + tail.lstrip("\n") if tail.strip() else "")
    try:
        old, new, added = tomllib.loads(text), tomllib.loads(result), tomllib.loads(tables)
    except tomllib.TOMLDecodeError:
        raise _by_hand(source) from None
    others = [trial for k, trial in enumerate(old.pop("trials", [])) if k not in mine]
    trials = new.pop("trials", [])
    # What is written must say what was meant: nothing else changed, nothing lost, nothing twice.
    if old != new or any(trial not in trials for trial in others) or len(trials) != len(others) + len(added["trials"]):
        raise _by_hand(source)
    return result


def _headers(text: str) -> dict[tuple[str | int, ...], int]:
    """The line after each element of [[trials]]: that of the next header that does not belong to it."""
    positions = Lines(text).positions
    lines = text.splitlines()
    starts = sorted({line for path, line in positions.items() if lines[line - 1].lstrip().startswith("[")})
    owner = {line: path for path, line in sorted(positions.items(), key=lambda item: -len(item[0]))}
    ends: dict[tuple[str | int, ...], int] = {}
    for k in range(sum(1 for path in positions if len(path) == 2 and path[0] == "trials")):
        first = positions.get(("trials", k))
        if first is None:
            continue
        after = [line for line in starts if line > first and owner[line][:2] != ("trials", k)]
        end = min(after, default=len(lines) + 1)
        while end - 1 > first and lines[end - 2].lstrip()[:1] in ("#", ""):
            end -= 1  # comments and blank lines above the next header belong to it
        ends[("trials", k)] = end
    return ends


def _is_taken(file: str, pattern: str) -> bool:
    """Whether a pattern takes a file, both as the study names them."""
    own, parts = Path(file).parts, Path(pattern).parts
    if "**" in parts:
        at = parts.index("**")
        rest = parts[at + 1 :]
        return own[:at] == parts[:at] and len(own) >= at + len(rest) and _fit(own[len(own) - len(rest) :], rest)
    return is_pattern(pattern) and len(own) == len(parts) and _fit(own, parts)


def _fit(own: Sequence[str], parts: Sequence[str]) -> bool:
    return all(fnmatchcase(name, part) for name, part in zip(own, parts, strict=True))


def _without(tables: str, replaced: Sequence[Sequence[str]]) -> str:
    """Tables of trials without the channels that all those are without which they replace."""
    common = [name for name in replaced[0] if all(name in one for one in replaced)] if replaced else []
    if not common:
        return tables
    line = f"without = {json.dumps(common, ensure_ascii=False)}"
    return re.sub(r"^(file = .*)$", lambda found: f"{found[1]}\n{line}", tables, flags=re.MULTILINE)


def _by_hand(source: str) -> BadInput:
    return BadInput(
        "its [[trials]] are written in a form that cannot be replaced safely",
        where=source,
        do="Run the command without --write and paste what it prints.",
    )


def _text(value: str) -> str:
    return json.dumps(value, ensure_ascii=False)
