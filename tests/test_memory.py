"""What does not fit into memory is refused before it is made."""

from __future__ import annotations

from types import SimpleNamespace

import psutil
import pytest

from seatruth.errors import BadInput
from seatruth.memory import require_memory


def test_a_part_of_the_memory_that_is_left_may_be_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(psutil, "virtual_memory", lambda: SimpleNamespace(available=10e9))
    require_memory(7.9e9, "its rows", do="Take fewer.")
    with pytest.raises(
        BadInput, match=r"run: its rows need 9 GB of memory, and this machine has 10 GB left. Take fewer"
    ):
        require_memory(9e9, "its rows", where="run", do="Take fewer.")
