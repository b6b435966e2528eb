"""Where each key of a TOML text stands, so that a message can name the line.

tomllib reads values without positions. This walks a text that tomllib has already accepted and notes the line of every
key; it never has to reject anything, only to skip strings, comments and brackets as TOML does.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Sequence

Path = tuple[str | int, ...]

_BARE = re.compile(r"[A-Za-z0-9_-]+")
_SCALAR = re.compile(r"[^,\]}#\r\n]*")
_BLANK = re.compile(r"[ \t]*")
_SPACE = re.compile(r"(?:[ \t\r\n]+|#[^\n]*)*")
_BASIC = re.compile(r'"(?:[^"\\\n]|\\.)*"')
_LITERAL = re.compile(r"'[^'\n]*'")
_LONG_BASIC = re.compile(r'"""(?:[^\\]|\\.)*?"""(?:""|")?', re.DOTALL)
_LONG_LITERAL = re.compile(r"'''.*?'''(?:''|')?", re.DOTALL)
_ESCAPE = re.compile(r"\\(?:u([0-9A-Fa-f]{4})|U([0-9A-Fa-f]{8})|(.))")
_ESCAPED = {"b": "\b", "t": "\t", "n": "\n", "f": "\f", "r": "\r", "e": "\x1b"}


class Lines:
    """Line of every key of a TOML text (valid TOML only; tomllib must have accepted it)."""

    def __init__(self, text: str) -> None:
        self._text = text
        self._at = 0
        self._starts = [0, *(match.end() for match in re.finditer("\n", text))]
        self._arrays: dict[Path, int] = {}
        self.positions: dict[Path, int] = {}
        self._document()

    def of(self, path: Sequence[str | int]) -> int | None:
        """Line of the key at `path`, or of the nearest table above it that is written down; None for the file itself.

        An index may be left out or be too much where a table stands for a list of one.
        """
        for stop in range(len(path), 0, -1):
            part = tuple(path[:stop])
            for candidate in (part, tuple(key for key in part if not isinstance(key, int))):
                if candidate in self.positions:
                    return self.positions[candidate]
        return None

    def _document(self) -> None:
        table: Path = ()
        while True:
            self._skip(_SPACE)
            if self._at >= len(self._text):
                return
            if self._text.startswith("[[", self._at):
                start, self._at = self._at, self._at + 2
                table = self._array_table(self._key())
                self._note_all(table, start)
                self._at += 2
            elif self._text[self._at] == "[":
                start, self._at = self._at, self._at + 1
                table = self._resolve(self._key())
                self._note_all(table, start)
                self._at += 1
            else:
                self._pair(table)

    def _array_table(self, keys: Path) -> Path:
        """Opens the next element of an array of tables."""
        path = (*self._resolve(keys[:-1]), keys[-1])
        index = self._arrays.get(path, -1) + 1
        self._arrays[path] = index
        return (*path, index)

    def _resolve(self, keys: Path) -> Path:
        """A header's keys with the index of the last element of each array of tables that they pass through."""
        path: Path = ()
        for key in keys:
            path = (*path, key)
            if path in self._arrays:
                path = (*path, self._arrays[path])
        return path

    def _pair(self, table: Path) -> None:
        start = self._at
        keys = self._key()
        self._note_all((*table, *keys), start)
        self._at += 1  # the equals sign
        self._skip(_SPACE)
        self._value((*table, *keys))

    def _key(self) -> Path:
        """Dotted key from here; stops at what follows it."""
        keys: list[str] = []
        while True:
            self._skip(_BLANK)
            here = self._text[self._at]
            if here == '"':
                keys.append(_ESCAPE.sub(_unescape, self._take(_BASIC)[1:-1]))
            elif here == "'":
                keys.append(self._take(_LITERAL)[1:-1])
            else:
                keys.append(self._take(_BARE))
            self._skip(_BLANK)
            if self._text[self._at] != ".":
                return tuple(keys)
            self._at += 1

    def _value(self, path: Path) -> None:
        for opening, pattern in (
            ('"""', _LONG_BASIC),
            ("'''", _LONG_LITERAL),
            ('"', _BASIC),
            ("'", _LITERAL),
        ):
            if self._text.startswith(opening, self._at):
                self._take(pattern)
                return
        here = self._text[self._at]
        if here == "[":
            self._items(path, "]")
        elif here == "{":
            self._items(path, "}")
        else:
            self._take(_SCALAR)

    def _items(self, path: Path, closing: str) -> None:
        self._at += 1
        index = 0
        while True:
            self._skip(_SPACE)
            if self._text[self._at] == closing:
                self._at += 1
                return
            if self._text[self._at] == ",":
                self._at += 1
            elif closing == "}":
                self._pair(path)
            else:
                self._note((*path, index), self._at)
                self._value((*path, index))
                index += 1

    def _note_all(self, path: Path, offset: int) -> None:
        """Notes a key and the tables above it that it opens."""
        for stop in range(1, len(path) + 1):
            self._note(path[:stop], offset)

    def _note(self, path: Path, offset: int) -> None:
        self.positions.setdefault(path, bisect_right(self._starts, offset))

    def _skip(self, pattern: re.Pattern[str]) -> None:
        match = pattern.match(self._text, self._at)
        if match is not None:
            self._at = match.end()

    def _take(self, pattern: re.Pattern[str]) -> str:
        match = pattern.match(self._text, self._at)
        if match is None or (match.end() == self._at and pattern is not _SCALAR):
            raise ValueError(f"no {pattern.pattern} at offset {self._at}")
        self._at = match.end()
        return match.group()


def _unescape(match: re.Match[str]) -> str:
    code = match.group(1) or match.group(2)
    if code:
        return chr(int(code, 16))
    return _ESCAPED.get(match.group(3), match.group(3))
