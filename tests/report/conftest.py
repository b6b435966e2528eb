"""What the tests of reports share."""

from __future__ import annotations

import pytest
from drawing import outline

from seatruth.report.sections import pictures


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Figures are made but not drawn: for tests of a page's words."""
    monkeypatch.setattr(pictures, "svg", outline)
