"""NMEA 0183: lines of sentences, as instruments send them and loggers keep them."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import numpy as np

from seatruth.errors import BadInput
from seatruth.readers.base import Content, Progress, Reader, Topic
from seatruth.readers.nmea_clock import day_of, seconds_of_day, spread, stamp_of, unwrapped
from seatruth.readers.nmea_sentences import SENTENCES
from seatruth.readers.rows import Rows
from seatruth.text import listed

_SENTENCE = re.compile(rb"[$!]([A-Z]{2})([A-Z]{3}),([^*\r\n]*)(?:\*([0-9A-Fa-f]{2}))?")
_ANY = re.compile(rb"[$!][A-Z]{1,2}[A-Z0-9]{2,6},")
_LONGEST_LINE = 4096
TIME = "time"


class _Kind(NamedTuple):
    """What one topic has collected: its rows, and for each its line, its stamp and its own UTC time."""

    rows: Rows
    lines: list[int]
    stamps: list[float]
    own: list[float]


@dataclass(frozen=True)
class NMEA(Reader):
    """The sentences GGA, RMC, VTG, HDT, ROT, VHW, VBW, RSA, RPM and MWV; each talker's is a topic, as "HEHDT".

    A sentence with a wrong check sum is left out and counted. The clock is the logger's stamp before each sentence (ISO
    date, seconds or milliseconds since 1970, or a TAG block). Without stamps it is the UTC time of GGA and RMC: other
    sentences between two fixes are spread evenly over that time, which the notes say.
    """

    name: ClassVar[str] = "nmea"
    title: ClassVar[str] = "NMEA 0183"
    suffixes: ClassVar[tuple[str, ...]] = (".nmea", ".log", ".txt")
    isolated: ClassVar[bool] = False

    @classmethod
    def recognises(cls, head: bytes, path: Path) -> bool:
        lines = [line for line in head.splitlines()[:40] if line.strip()]
        return bool(lines) and sum(_ANY.search(line[:200]) is not None for line in lines) > 0.6 * len(lines)

    def read(self, path: Path, progress: Progress) -> Content:
        log = _Lines()
        size = max(1, path.stat().st_size)
        with open(path, "rb") as stream:
            number = 0
            while line := stream.readline(_LONGEST_LINE):
                number += 1
                log.add(line, number)
                if number % 4096 == 0:
                    progress(stream.tell() / size)
        if not log.kinds:
            raise BadInput("it holds no sentence that is known", where=str(path), do=f"Known: {', '.join(SENTENCES)}.")
        if log.wrong > log.good:
            raise BadInput(
                f"{log.wrong} of {log.wrong + log.good} check sums are wrong", where=str(path), do="Copy it again."
            )
        return log.content(str(path))


class _Lines:
    """Collects the sentences of a file."""

    def __init__(self) -> None:
        self.kinds: dict[str, _Kind] = {}
        self.good = self.wrong = self.unchecked = self.void = self.garbled = 0
        self.unknown: set[str] = set()
        self.day: float | None = None

    def add(self, line: bytes, number: int) -> None:
        """Takes one line; what is no sentence is passed over."""
        found = _SENTENCE.search(line)
        if found is None:
            return
        talker, name, body, check = found[1].decode(), found[2].decode(), found[3], found[4]
        if check is None:
            self.unchecked += 1
        elif int(check, 16) != _check_sum(line[found.start() + 1 : found.end() - 3]):
            self.wrong += 1
            return
        else:
            self.good += 1
        if name not in SENTENCES:
            self.unknown.add(name)
            return
        try:
            self._add(talker, name, body.decode("ascii").split(","), number, stamp_of(line[: found.start()]))
        except (ValueError, KeyError, IndexError):
            self.garbled += 1

    def _add(self, talker: str, name: str, parts: list[str], number: int, stamp: float) -> None:
        kind = SENTENCES[name]
        own = np.nan
        if kind.clock is not None and parts[kind.clock[0]]:
            own = seconds_of_day(parts[kind.clock[0]])
            if kind.clock[1] is not None and self.day is None and parts[kind.clock[1]]:
                self.day = day_of(parts[kind.clock[1]])
        void = kind.status is not None and parts[kind.status] != "A"
        self.void += void
        row = [None if void else convert(parts, at) for at, _, convert in kind.fields.values()]
        instance = "".join(parts[at] for at in kind.instance)
        topic = self.kinds.setdefault(
            f"{talker}{name}[{instance}]" if instance else f"{talker}{name}", _Kind(Rows(list(kind.fields)), [], [], [])
        )
        topic.rows.add(row)
        topic.lines.append(number)
        topic.stamps.append(stamp)
        topic.own.append(own)

    def content(self, source: str) -> Content:
        """The topics with their clocks, and what was left out."""
        stamped = sum(np.isfinite(kind.stamps).sum() for kind in self.kinds.values())
        whole = sum(len(kind.lines) for kind in self.kinds.values())
        notes = [*self._notes(), *([] if stamped else self._clock_notes(source))]
        if stamped and stamped < whole:
            notes.append(f"{whole - stamped} sentences without a stamp of the logger are left out.")
        clocks = {name: np.array(kind.stamps) for name, kind in self.kinds.items()} if stamped else self._from_fixes()
        topics = []
        for name, kind in sorted(self.kinds.items()):
            timed = np.isfinite(clocks[name])
            columns: dict[str, Any] = {
                field: np.asarray(values)[timed] for field, values in kind.rows.columns().items()
            }
            columns[TIME] = clocks[name][timed]
            units = {field: unit for field, (_, unit, _) in SENTENCES[name[2:5]].fields.items() if unit}
            topics.append(Topic(name, columns, {**units, TIME: "s"}, TIME, np.array(kind.lines)[timed]))
        return Content(topics, notes)

    def _from_fixes(self) -> dict[str, np.ndarray]:
        """Clocks (n,) s of all topics from the times of the fixes, since 1970 where a sentence states the date."""
        fixes = {name: kind for name, kind in self.kinds.items() if np.isfinite(kind.own).any()}
        lines = np.concatenate([kind.lines for kind in fixes.values()])
        own = np.concatenate([kind.own for kind in fixes.values()])
        order = np.argsort(lines, kind="stable")
        order = order[np.isfinite(own[order])]
        times = unwrapped(own[order]) + (self.day or 0.0)
        at_line = dict(zip(lines[order].tolist(), times.tolist()))
        clocks = {}
        for name, kind in self.kinds.items():
            if name in fixes:
                clocks[name] = np.array([at_line.get(line, np.nan) for line in kind.lines])
            else:
                clocks[name] = spread(np.array(kind.lines), lines[order], times)
        return clocks

    def _clock_notes(self, source: str) -> list[str]:
        if not any(np.isfinite(kind.own).any() for kind in self.kinds.values()):
            raise BadInput(
                "its sentences have neither stamps of a logger nor the time of a fix (GGA, RMC)",
                where=source,
                do="Record it with a stamp before each sentence.",
            )
        if all(SENTENCES[name[2:5]].clock for name in self.kinds):
            return []
        return ["Sentences have no stamps: between two fixes they are spread evenly over that time, in their order."]

    def _notes(self) -> list[str]:
        counts = (
            (self.wrong, "sentence(s) with a wrong check sum are left out"),
            (self.unchecked, "sentence(s) have no check sum"),
            (self.garbled, "sentence(s) hold something else than numbers and are left out"),
            (self.void, "sentence(s) are declared void by their device: their values are missing"),
        )
        notes = [f"{count} {what}." for count, what in counts if count]
        if self.unknown:
            notes.append(f"Sentences that are not read: {listed(sorted(self.unknown), 12)}.")
        return notes


def _check_sum(text: bytes) -> int:
    """Exclusive or of all characters between "$" and "*"."""
    total = 0
    for character in text:
        total ^= character
    return total
