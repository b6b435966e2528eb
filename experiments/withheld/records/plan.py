"""Which cases the real set holds: the days of the pond, the basins, and errors put into their records.

Settled before any of them was diagnosed. Magnitudes are once and twice those that the library calls typical of a ship
of this length; a test compares them, so that neither follows the other unseen.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Source:
    """Recorded runs that are diagnosed together: the study that describes the ship, the folder, the runs."""

    study: str
    ship: str
    runs: tuple[str, ...]
    manoeuvres: tuple[str, ...]
    day: str = ""
    """Of a pond in the open: the day on which all of them were sailed."""


def _zigzags(*angles: int) -> tuple[str, ...]:
    return tuple(f"zigzag {angle}" for angle in angles)


SOURCES: dict[str, Source] = {
    "marin": Source(
        "kvlcc2_marin", "KVLCC2, 7 m, MARIN", ("zz_10", "zz_-10", "zz_20", "zz_-20"), _zigzags(10, 10, 20, 20)
    ),
    "hsva": Source(
        "kvlcc2_hsva", "KVLCC2, 7 m, HSVA",
        ("Z_10_01", "Z_15_05", "Z_25_05", "Z_10_10_P", "Z_20_10_S"), _zigzags(10, 15, 25, 10, 20),
    ),
    "pond_31-Jul": Source(
        "esso_osaka", "Esso Osaka, 3 m, pond",
        ("zigzag_31-Jul-2020_13_14_21", "zigzag_31-Jul-2020_13_22_52", "zigzag_31-Jul-2020_13_29_19",
         "zigzag_31-Jul-2020_13_50_28", "zigzag_31-Jul-2020_13_57_45", "zigzag_31-Jul-2020_14_03_39"),
        _zigzags(30, 15, 15, 30, 20, 20), "31-Jul",
    ),
    "pond_14-Sep": Source(
        "esso_osaka", "Esso Osaka, 3 m, pond",
        ("turn_14-Sep-2020_13_51_45", "turn_14-Sep-2020_15_47_33", "turn_14-Sep-2020_15_58_08",
         "turn_cut_14-Sep-2020_16_09_02"),
        ("turn 35", "turn -35", "turn 20", "turn -20"), "14-Sep",
    ),
    "pond_14-Oct": Source(
        "esso_osaka", "Esso Osaka, 3 m, pond",
        ("turn_14-Oct-2020_14_17_39", "turn_14-Oct-2020_14_29_49", "turn_14-Oct-2020_14_39_54",
         "turn_14-Oct-2020_14_56_07", "turn_14-Oct-2020_15_21_57"),
        ("turn 35", "turn 20", "turn 20", "turn -20", "turn -35"), "14-Oct",
    ),
}  # fmt: skip
"""Random and berthing runs are not used: the propeller goes astern in them, for which the model has no equations."""
BASINS = {"marin": "hsva", "hsva": "marin"}
"""Runs of the one are diagnosed with the model that was fitted to the other."""

LENGTHS = {"marin": 7.0, "hsva": 7.0, "pond_31-Jul": 3.0, "pond_14-Sep": 3.0, "pond_14-Oct": 3.0}


@dataclass(frozen=True)
class Error:
    """What can be put into a record: its values (SI, rad) at full scale, the power of length / 100 m that they go by.

    `name` is what the library calls it; `place` in the library's words.
    """

    key: str
    name: str
    number: int
    place: str
    typical: Mapping[str, float]
    units: Mapping[str, str]
    power: float = 0.0

    def values(self, length: float, times: float) -> dict[str, float]:
        """Its values on a ship of this length (m), so many times typical."""
        ratio = min(1.0, length / 100.0) ** self.power
        return {name: times * value * ratio for name, value in self.typical.items()}


_ARM = {"forward": 20.0, "starboard": 5.0}
_METRES = {"forward": "m", "starboard": "m"}
ERRORS: dict[str, Error] = {
    one.key: one
    for one in (
        Error("heading_bias", "heading_bias", 5, "sensor:psi", {"b": 0.03}, {"b": "rad"}),
        Error("speed_scale", "speed_scale", 3, "sensor:u", {"k": 0.03}, {"k": "1"}),
        Error("speed_bias", "speed_bias", 4, "sensor:u", {"b": 0.05}, {"b": "m/s"}, 0.5),
        Error("log_lever_arm", "log_lever_arm", 8, "sensor:v,sensor:u", _ARM, _METRES, 1.0),
        Error("position_lever_arm", "position_lever_arm", 8, "sensor:x,sensor:y", _ARM, _METRES, 1.0),
        Error("position_delay", "position_delay", 10, "sensor:x,sensor:y", {"tau": 0.4}, {"tau": "s"}),
        Error("heading_delay", "heading_delay", 10, "sensor:psi", {"tau": 0.4}, {"tau": "s"}),
        Error("log_misalignment", "log_misalignment", 8, "sensor:u,sensor:v", {"angle": 0.035}, {"angle": "rad"}),
    )
}


@dataclass(frozen=True)
class Plan:
    """One case: its runs, and what is done to them. `kind` is "control", "wind", "injected" or "basin"."""

    source: str
    kind: str
    cause: str = ""
    times: float = 0.0
    sign: float = 1.0
    values: Mapping[str, float] = field(default_factory=dict)


def _put(source: str, cause: str, times: float, sign: float = 1.0) -> Plan:
    size = sign * times
    return Plan(source, "injected", cause, times, sign, ERRORS[cause].values(LENGTHS[source], size))


CASES: tuple[Plan, ...] = (
    Plan("marin", "control"),
    _put("marin", "heading_bias", 2.0),
    Plan("hsva", "control"),
    Plan("pond_31-Jul", "wind"),
    Plan("pond_14-Sep", "wind"),
    Plan("pond_14-Oct", "wind"),
    Plan("marin", "basin"),
    Plan("hsva", "basin"),
    # Each error at both sizes, on different records; each basin and the pond get their share.
    _put("hsva", "heading_bias", 1.0, -1.0),
    _put("pond_31-Jul", "speed_scale", 2.0, -1.0),
    _put("marin", "speed_scale", 1.0),
    _put("hsva", "position_lever_arm", 1.0),
    _put("pond_31-Jul", "position_lever_arm", 2.0, -1.0),
    _put("pond_31-Jul", "position_delay", 1.0),
    _put("hsva", "heading_delay", 2.0),
    _put("marin", "log_lever_arm", 1.0, -1.0),
    _put("hsva", "log_lever_arm", 2.0),
    _put("marin", "log_misalignment", 2.0),
    _put("pond_31-Jul", "log_misalignment", 1.0, -1.0),
    _put("marin", "speed_bias", 2.0, -1.0),
)
"""The first two are those of --quick. The wind cases are the controls of what is put into records of the pond."""
QUICK = 2
