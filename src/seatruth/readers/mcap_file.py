"""MCAP files, as ROS 2, Foxglove and other loggers write them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np

from seatruth.readers.base import Content, Progress, Reader
from seatruth.readers.ros_messages import AXES, PAYLOADS, Messages, problems
from seatruth.storage.parsing import parsed

Decode = Callable[[bytes], Any]


@dataclass(frozen=True)
class MCAP(Reader):
    """Topics of ROS 1, ROS 2 and JSON messages, each with the time of recording (`log_time`) as its clock.

    A file that ends early, as after a power cut, gives what was recorded before.
    """

    name: ClassVar[str] = "mcap"
    title: ClassVar[str] = "MCAP"
    suffixes: ClassVar[tuple[str, ...]] = (".mcap",)
    modules: ClassVar[tuple[str, ...]] = ("mcap", "rosbags")
    extra: ClassVar[str] = "seatruth[ros]"

    @classmethod
    def recognises(cls, head: bytes, path: Path) -> bool:
        return head.startswith(b"\x89MCAP0\r\n")

    def read(self, path: Path, progress: Progress) -> Content:
        from mcap.exceptions import McapError
        from mcap.reader import NonSeekingReader

        topics: dict[str, Messages] = {}
        failed: dict[str, int] = {}
        decoders: dict[int, Decode | None] = {}
        notes: list[str] = []
        size = max(1, path.stat().st_size)
        with open(path, "rb") as stream:
            reader = NonSeekingReader(stream, validate_crcs=True)
            try:
                for schema, channel, message in reader.iter_messages(log_time_order=False):
                    if channel.id not in decoders:
                        decoders[channel.id] = _decoder(schema, channel, notes)
                    decode = decoders[channel.id]
                    if decode is None:
                        continue
                    try:
                        content = decode(message.data)
                        topics.setdefault(channel.topic, Messages(channel.topic)).add(message.log_time, content)
                    except Exception:  # one damaged message
                        failed[channel.topic] = failed.get(channel.topic, 0) + 1
                    progress(stream.tell() / size)
            except (McapError, EOFError) as problem:
                if not topics:
                    raise
                text = (str(problem) or type(problem).__name__).splitlines()[0][:120]
                notes.append(f"The file is damaged or ends early ({text}): what stands before is shown.")
        found = [topic for messages in topics.values() if (topic := messages.result()) is not None]
        return Content(found, [*notes, *problems(failed)])


def _decoder(schema: Any, channel: Any, notes: list[str]) -> Decode | None:
    """How the messages of a channel are decoded; None, with a note, where they cannot be."""
    encoding = channel.message_encoding
    kind = _ros2_name(schema.name) if schema is not None else ""
    if kind in PAYLOADS:
        return None
    if encoding == "json":
        return lambda data: _named(parsed(data))
    if schema is not None and (encoding, schema.encoding) in (
        ("cdr", "ros2msg"),
        ("cdr", "ros2idl"),
        ("ros1", "ros1msg"),
    ):
        if AXES not in notes:
            notes.append(AXES)
        return _ros(kind, schema, encoding)
    notes.append(f"{channel.topic} is left out: its messages are {encoding or 'of no stated encoding'}.")
    return None


def _ros(kind: str, schema: Any, encoding: str) -> Decode:
    from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore

    store = get_typestore(Stores.EMPTY)
    text = schema.data.decode("utf-8", "replace")
    if schema.encoding == "ros2idl":
        for part in text.split("=" * 80 + "\n"):
            store.register(get_types_from_idl(part.partition("\n")[2] if part.startswith("IDL: ") else part))
    else:
        store.register(get_types_from_msg(text, kind))
    if encoding == "ros1":
        return lambda data: store.deserialize_ros1(data, kind)
    return lambda data: store.deserialize_cdr(data, kind)


def _ros2_name(name: str) -> str:
    """ "sensor_msgs/Image" of ROS 1 as ROS 2 calls it, "sensor_msgs/msg/Image"."""
    package, _, kind = name.partition("/")
    return name if "/" in kind or not kind else f"{package}/msg/{kind}"


def _named(value: Any, depth: int = 0) -> Any:
    """A JSON object as an object with fields, and a list of numbers as an array."""
    if isinstance(value, Mapping) and depth < 8:
        fields = {str(key).replace(".", "_"): _named(item, depth + 1) for key, item in value.items()}
        return SimpleNamespace(**fields, __dataclass_fields__=tuple(fields))
    if isinstance(value, list) and value and all(isinstance(item, (int, float)) for item in value):
        return np.array(value, dtype=np.float64)
    return value
