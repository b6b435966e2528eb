"""How many threads a simulation takes."""

from __future__ import annotations

import pytest

from seatruth.errors import BadInput
from seatruth.simulate.threads import MOST_THREADS, THREADS, thread_count


def test_how_many(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(THREADS, raising=False)
    assert 1 <= thread_count(None) <= MOST_THREADS
    assert thread_count(3) == 3
    assert thread_count(1000) == MOST_THREADS
    monkeypatch.setenv(THREADS, "2")
    assert thread_count(None) == 2
    monkeypatch.setenv(THREADS, "two")
    with pytest.raises(BadInput, match="'two'"):
        thread_count(None)
