"""What `init` can only propose: positions in UTM, whose zone must be known, accelerometers, and what is to be free."""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from seatruth.effects.undeclared_actuators import drive_inputs
from seatruth.models import Model, Parameter, Thruster
from seatruth.readers import Log
from seatruth.readers.listing import names
from seatruth.readers.tables import as_text
from seatruth.study.infer_columns import InferredColumn, infer_columns, place_in, split_header
from seatruth.study.observations import observable
from seatruth.trials import STANDARD_CHANNELS

UTM = ("northing", "easting")
_EASTING, _NORTHING = (1e5, 9e5), (0.0, 1e7)
"""m: eastings of a zone lie between these, as its middle has 500 km and it is nowhere wider than 700 km; northings are
counted from the equator, or from 10,000 km south of it. ([L] NGA.SIG.0012, The Universal Grids, 2014)"""
_ZONE = re.compile(r"(\d{1,2})\s*(north|south|[C-HJ-NP-X])", re.IGNORECASE)
_NORTHERN, _SOUTHERN = "NPQRTUVWX", "CDEFGHJKLM"
"""Letters of latitude bands. S is missing: "32S" can be band S, which is north, or the south."""
_OF_A_DRAWING = frozenset(("m", "m2", "m^2", "m3", "m^3", "kg/m3", "kg/m^3"))
_ADDED_NAMES = r"(a_?|lambda_)\d\d|[xyzkmn]_?(d[uvwpqr]|[uvwpqr]_?d(ot)?)"
_OF_A_MASS = re.compile(rf"(m|i|j)(_?[xyz]+)?|[ij]_\w*[xyz]|mass.*|{_ADDED_NAMES}", re.IGNORECASE)
"""Names of masses, moments of inertia and added masses, of a unit of kg: m, m_y, I_zz, I_px, A_33, X_ud, X_du, N_rdot.
Damping may have that unit too. A scale and a drawing know masses and sizes, and where they are free as well as the
forces, a record shows the ratio of the two alone."""
_OVER_THE_MASS = re.compile(r"m_[xyz]")
"""Names of added masses over the mass."""
_ADDED = re.compile(_ADDED_NAMES, re.IGNORECASE)
"""Of these, the added masses, which no scale weighs."""
_ON_PAPER = re.compile(r"\b((data ?)?sheet|drawing|scales|open[- ]water)\b", re.IGNORECASE)
"""Words of a source that knows a parameter better than a record shows it."""
_GUESSED = re.compile(r"\b(guess(ed)?|assumed|scaled|estimated?|rule of thumb)\b", re.IGNORECASE)
"""Words of a source that says itself that it does not."""

_OF_A_PART = re.compile(r"m(_?\d|_[a-z]\w*)")
"""Names of the mass of a part, or of a difference of masses, in kg: m_0, m_h, m_disp. Derivatives have a large M."""
_GRAVITY = ("m/s2", "m/s^2")


def named_drives(model: Model) -> dict[str, str]:
    """What tells each drive from the others, by its input: the name of its thruster, else the place that it is said at.

    Example:
        >>> from seatruth import load_model
        >>> named_drives(load_model("twin_thruster"))
        {'n_port': 'port', 'n_starboard': 'starboard'}
    """
    drives = drive_inputs(model)
    said = {channel.name: place_in(channel.description) for channel in model.inputs if channel.name in drives}
    return said | {one.input: one.name for one in model.actuators if isinstance(one, Thruster)}


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


def is_measured(parameter: Parameter) -> bool:
    """Whether scales, a drawing or a data sheet know a parameter, or everybody: a mass, an inertia, a size, gravity."""
    guessed = _GUESSED.search(parameter.source) is not None
    if parameter.unit.startswith("kg") and _OF_A_MASS.fullmatch(parameter.name):
        return not (guessed and _ADDED.fullmatch(parameter.name))
    if parameter.unit == "1" and _OVER_THE_MASS.fullmatch(parameter.name):
        return not guessed
    weighed = parameter.unit == "kg" and _OF_A_PART.fullmatch(parameter.name) is not None
    if weighed or parameter.unit in _OF_A_DRAWING or (parameter.name == "g" and parameter.unit in _GRAVITY):
        return True
    return not guessed and _ON_PAPER.search(parameter.source) is not None
