"""Readers: a file or log of some format becomes tables of fields, each with its own clock.

`read_log` recognises the format and reads the file; a reader of another format is one class, found through the entry
points `seatruth.readers` of every installed package. The names below are loaded when first used: the process that
reads a binary file in isolation needs few of them, and must start fast.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from seatruth.readers.base import Content, Reader, Topic
    from seatruth.readers.log import Log
    from seatruth.readers.read import read_log
    from seatruth.readers.registry import ReaderInfo, available
    from seatruth.readers.tables import Table

__all__ = ["Content", "Log", "Reader", "ReaderInfo", "Table", "Topic", "available", "read_log"]

_MODULE_OF = {
    "Content": "base",
    "Log": "log",
    "Reader": "base",
    "ReaderInfo": "registry",
    "Table": "tables",
    "Topic": "base",
    "available": "registry",
    "read_log": "read",
}


def __getattr__(name: str) -> Any:
    """The public name, imported from the module where it lives."""
    if name not in _MODULE_OF:
        raise AttributeError(f"module 'seatruth.readers' has no attribute {name!r}")
    return getattr(importlib.import_module(f"seatruth.readers.{_MODULE_OF[name]}"), name)
