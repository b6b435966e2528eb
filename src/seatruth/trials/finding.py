"""What a check says about a trial: how grave, what, where, and what to do about it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import pandas as pd

Severity = Literal["error", "warning", "note"]
_ORDER: dict[str, int] = {"error": 0, "warning": 1, "note": 2}


@dataclass(frozen=True)
class Finding:
    """One thing found in the data before any fit.

    `severity`: "error" makes a fit meaningless until it is put right, "warning" makes it worse or hard to trust,
    "note" is worth knowing. `code` is a short stable name of the kind of finding ("psi-r-sign"). `where` names the
    file or trial, and the channel and lines where there are any. `do` says what to do.
    """

    severity: Severity
    code: str
    message: str
    where: str
    do: str = ""
    trial: str = ""
    channel: str = ""

    def __str__(self) -> str:
        return f"{self.severity}: {self.where}: {self.message} {self.do}".strip() + f" [{self.code}]"


def gravest_first(findings: Sequence[Finding]) -> list[Finding]:
    """Errors, then warnings, then notes; otherwise in the order in which they were found."""
    return sorted(findings, key=lambda finding: _ORDER[finding.severity])


def findings_table(findings: Sequence[Finding]) -> pd.DataFrame:
    """One row a finding: severity, code, trial, channel, where, message, do."""
    columns = ["severity", "code", "trial", "channel", "where", "message", "do"]
    return pd.DataFrame([{name: getattr(f, name) for name in columns} for f in findings], columns=columns)
