"""Checks of the tables that a formula is fitted to: rows have no time, so little of the other checks applies."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from seatruth.trials.check.helpers import Channels
from seatruth.trials.finding import Finding, gravest_first
from seatruth.trials.trial import Trial


def check_tables(tables: Sequence[Trial], model: Channels) -> list[Finding]:
    """Rows that cannot be fitted, columns that never change, measurements that are zero or missing; gravest first."""
    found: list[Finding] = []
    where = ", ".join(dict.fromkeys(table.source or table.name for table in tables))
    for channel in model.inputs:
        values = np.concatenate([table.inputs[channel.name] for table in tables])
        if values.size > 1 and np.ptp(values) == 0:
            what = f"Every row has {channel.name} = {values[0]:g}: its influence cannot be identified."
            do = "Add rows with another value, or fix the parameters that belong to it."
            found.append(Finding("note", "constant-column", what, where, do, channel=channel.name))
    for channel in model.outputs:
        values = np.concatenate([table.outputs[channel.name] for table in tables])
        valid = int(np.isfinite(values).sum())
        if valid == 0:
            what = f"No row has a measured {channel.name}."
            found.append(Finding("error", "no-rows", what, where, "Fill the column.", channel=channel.name))
        elif valid < values.size:
            what = (
                f"{values.size - valid} of {values.size} rows have no {channel.name}: they are predicted, not fitted."
            )
            do = "Fill in the value where it was measured."
            found.append(Finding("note", "rows-to-predict", what, where, do, channel=channel.name))
    return gravest_first(found)
