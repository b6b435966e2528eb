"""Bags of ROS 1 (.bag) and ROS 2 (a folder, or its .db3 file)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from seatruth.errors import BadInput
from seatruth.readers.base import Content, Progress, Reader
from seatruth.readers.ros_messages import AXES, PAYLOADS, Messages, problems


@dataclass(frozen=True)
class Rosbag(Reader):
    """Topics as rosbags reads them, each with the time of recording (`log_time`) as its clock.

    `[time] column = "header.stamp"` takes the time of measurement instead. Types that a bag does not define are those
    of the latest ROS 2.
    """

    name: ClassVar[str] = "rosbag"
    title: ClassVar[str] = "ROS 1 and ROS 2 bags"
    suffixes: ClassVar[tuple[str, ...]] = (".bag", ".db3")
    modules: ClassVar[tuple[str, ...]] = ("rosbags",)
    extra: ClassVar[str] = "seatruth[ros]"

    @classmethod
    def recognises(cls, head: bytes, path: Path) -> bool:
        if not head:
            return (path / "metadata.yaml").is_file()
        return head.startswith(b"#ROSBAG V") or (head.startswith(b"SQLite format 3") and path.suffix == ".db3")

    def read(self, path: Path, progress: Progress) -> Content:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore

        if path.is_file() and path.suffix not in (".bag", ".db3"):
            raise BadInput("it is a ROS 1 bag of another name", where=str(path), do="Rename it to end in .bag.")
        topics: dict[str, Messages] = {}
        failed: dict[str, int] = {}
        with AnyReader([path], default_typestore=get_typestore(Stores.LATEST)) as bag:
            kept = [connection for connection in bag.connections if connection.msgtype not in PAYLOADS]
            whole = max(1, sum(connection.msgcount for connection in kept))
            for done, (connection, time_ns, raw) in enumerate(bag.messages(kept) if kept else ()):
                try:
                    message = bag.deserialize(raw, connection.msgtype)
                    topics.setdefault(connection.topic, Messages(connection.topic)).add(time_ns, message)
                except Exception:  # of one message, by a type that the bag does not define or by damage
                    failed[connection.topic] = failed.get(connection.topic, 0) + 1
                progress(done / whole)
        found = [topic for messages in topics.values() if (topic := messages.result()) is not None]
        if not found and failed:
            raise BadInput(
                "none of its messages can be decoded", where=str(path), do="Record it as MCAP, with its types."
            )
        return Content(found, [AXES, *problems(failed)])
