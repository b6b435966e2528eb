"""Checksums of stored records: a changed digit is noticed when the record is read again.

They protect against damage (bit errors, an editor, a torn write), not against an attacker, who can compute them too.
"""

from __future__ import annotations

import hashlib
from functools import cache
from pathlib import Path


def checksum(content: bytes | str, owner: str = "") -> str:
    """BLAKE2b checksum of a record, 32 hexadecimal digits.

    Args:
        content: The record.
        owner: What the record belongs to: a record that is copied into the file of another owner does not fit.

    Example:
        >>> checksum("1.5") == checksum("1.6")
        False
    """
    data = content.encode("utf-8") if isinstance(content, str) else content
    key = hashlib.sha256(owner.encode("utf-8")).digest() if owner else b""
    return hashlib.blake2b(data, digest_size=16, key=key).hexdigest()


@cache
def of_source(file: str) -> str:
    """Checksum of a module's own file (`__file__`): what a changed program computed before is not taken for its own.

    Example:
        >>> from seatruth.storage import checksum
        >>> len(of_source(checksum.__file__))
        32
    """
    try:
        return checksum(Path(file).read_bytes())
    except OSError:
        return ""
