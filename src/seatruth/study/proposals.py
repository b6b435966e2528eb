"""What `init` can only propose: positions in UTM, whose zone must be known, and accelerometers, whose place matters."""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from seatruth.models import Model
from seatruth.readers import Log
from seatruth.readers.listing import names
from seatruth.readers.tables import as_text
from seatruth.study.infer_columns import InferredColumn, infer_columns, split_header
from seatruth.study.observations import observable
from seatruth.trials import STANDARD_CHANNELS

UTM = ("northing", "easting")
_EASTING, _NORTHING = (1e5, 9e5), (0.0, 1e7)
"""m: eastings of a zone lie between these, as its middle has 500 km and it is nowhere wider than 700 km; northings are
counted from the equator, or from 10,000 km south of it. ([L] NGA.SIG.0012, The Universal Grids, 2014)"""
_ZONE = re.compile(r"(\d{1,2})\s*(north|south|[C-HJ-NP-X])", re.IGNORECASE)
_NORTHERN, _SOUTHERN = "NPQRTUVWX", "CDEFGHJKLM"
"""Letters of latitude bands. S is missing: "32S" can be band S, which is north, or the south."""


def utm_positions(fields: Mapping[str, NDArray[np.float64]]) -> dict[str, InferredColumn]:
    """Columns of northing and easting whose numbers can be UTM; none where they are local coordinates."""
    found = infer_columns(fields, [STANDARD_CHANNELS[name] for name in UTM])
    for name, (low, high) in zip(UTM, (_NORTHING, _EASTING), strict=True):
        values = fields[found[name].column] if name in found else np.empty(0)
        values = values[np.isfinite(values)]
        if not values.size or found[name].unit != "m" or values.min() < low or values.max() > high:
            return {}
    return found


def utm_zone(log: Log) -> str | None:
    """The one zone that a column of the log states, as "32 north"; None where none does, or the hemisphere is open."""
    for name, (table, column) in names(log).items():
        if split_header(column)[0] not in ("zone", "utm zone"):
            continue
        said = as_text(table.columns[column], f"{log.source}, column {name!r}").dropna().unique()
        match = _ZONE.fullmatch(str(said[0])) if len(said) == 1 else None
        if match is not None and 1 <= int(match[1]) <= 60:
            word = match[2].lower()
            for half, bands in (("north", _NORTHERN), ("south", _SOUTHERN)):
                if word == half or word.upper() in bands:
                    return f"{int(match[1])} {half}"
    return None


def accelerometers(fields: Mapping[str, NDArray[np.float64]], model: Model) -> dict[str, InferredColumn]:
    """Columns of accelerometers that the model can show."""
    return infer_columns(fields, observable(model, accelerates=True))
