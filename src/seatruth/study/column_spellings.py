"""How loggers and autopilots spell a channel's name: fields of messages, glued words, the system before the name."""

from __future__ import annotations

from collections.abc import Sequence

AUTOPILOTS = {
    "x": ("vehicle local position x", "pn"),
    "y": ("vehicle local position y", "pe"),
    "z": ("vehicle local position z", "pd"),
    "v_n": ("vehicle local position vx",),
    "v_e": ("vehicle local position vy",),
    "v_d": ("vehicle local position vz",),
    "sog": ("vehicle gps position vel", "sensor gps vel", "gps spd"),
    "cog": ("gps gcrs",),
    **{
        rate: (f"vehicle angular velocity xyz {k}", f"sensor combined gyro rad {k}", f"imu gyr {axis}")
        for k, (rate, axis) in enumerate(zip("pqr", "xyz"))
    },
}
"""Fields of autopilots whose names alone mislead or say nothing: PX4's message definitions (VehicleLocalPosition.msg:
x, y, z and vx, vy, vz are north, east, down), ArduPilot's list of log messages (GPS, IMU, XKF1)."""
MEANT = {word: channel for channel, words in AUTOPILOTS.items() for word in words}
"""The channel that each of these fields holds."""
_OF_GLIDERS = {"m": "measured", "c": "cmd"}
"""What the first letter of a Slocum's sensors says: m_battpos is measured, c_battpos commanded. Seagliders put eng_
before what their engineering files hold."""
_SOLVED = ("ins", "ekf", "nav", "mocap", "vicon", "qualisys", "est", "estimated")
"""Systems that give a whole solution, whose x and y are north and east."""
_FIXES = ("usbl", "lbl", "sbl", "gps", "gnss", "rtk", "dgps")
"""Systems of positions. Their x and y may be ahead and abeam of a transceiver, or geocentric: a letter says nothing."""
_RATES = ("imu", "ahrs", "mru", "gyro", "gyr")
"""Systems of rates of turn: a letter after one of them says which."""
_OF_A_TRACK = frozenset(("bt", "bottom", "track", "vel", "velocity", "speed"))
"""Words beside a Doppler log's letter: "dvl_bt_u"."""
_SYSTEMS = {
    **dict.fromkeys(("x", "y", "northing", "easting"), (*_FIXES, *_SOLVED)),
    **dict.fromkeys(("phi", "theta", "psi"), ("imu", "ahrs", "mru", "eng", "m", *_SOLVED)),
    **dict.fromkeys(("p", "q", "r"), (*_RATES, *_SOLVED)),
    **dict.fromkeys(("z", "depth"), ("usbl", "ctd", "pressure", "m", *_SOLVED)),
    **dict.fromkeys(("latitude", "longitude"), ("m", *_FIXES, *_SOLVED)),
    **dict.fromkeys(("sog", "cog", "v_n", "v_e", "v_d"), (*_FIXES, *_SOLVED)),
}
_CLOCK = frozenset(("time", "timestamp", "datetime", "utc", "stamp", "epoch"))
"""Words of a time; one of them is in its name ..."""
_WHOSE = frozenset(
    (
        *("date", "gmt", "zulu", "iso", "iso8601", "local", "gps", "gnss", "unix", "posix", "system", "sys", "host"),
        *("pc", "log", "logger", "record", "recorded", "recording", "sample", "measurement", "ros", "rosbag", "header"),
        *("boot", "since", "start", "elapsed", "mission", "run", "test", "sim", "simulation", "m", "sci", "present"),
    )
)
"""... and these may stand beside it: how the time is written, who keeps it, from when on it counts. The last three are
of a glider's m_present_time and sci_m_present_time."""
_SHORTEST = 4
"""Letters of a glued name, or after a letter, below which it may be another word: "fx" is a force, "un" no speed."""


def other_spellings(name: str, channel: str, known: Sequence[str]) -> tuple[str, ...]:
    """Those of a channel's known names that a column's name is, but for a blank or the system named before it.

    Example:
        >>> other_spellings("yawrate", "r", ["r", "yaw rate"]), other_spellings("usbl north", "x", ["x", "north"])
        (('yaw rate',), ('north',))
        >>> other_spellings("dvl bt u", "u", ["u", "dvl u"]), other_spellings("gyro q", "q", ["q", "pitch rate"])
        (('dvl u',), ('q',))
        >>> other_spellings("easting usbl", "y", ["y", "easting"])
        ('easting',)
    """
    if channel == "t":
        words = {*name.split()}
        return tuple(known[:1]) if words & _CLOCK and words <= _CLOCK | _WHOSE else ()
    glued = name.replace(" ", "")
    found = [word for word in known if " " in word and len(glued) >= _SHORTEST and word.replace(" ", "") == glued]
    before, _, second = name.partition(" ")
    first, _, behind = name.rpartition(" ")
    for system, rest in ((before, second), (behind, first)):
        if system in _SYSTEMS.get(channel, ()) and rest in known and (len(rest) > 1 or system in (*_SOLVED, *_RATES)):
            found.append(rest)
    if "dvl" in name.split() or "bt" in name.split():
        plain = " ".join(["dvl", *(word for word in name.split() if word not in {"dvl", *_OF_A_TRACK})])
        found += [word for word in known if word == plain != name]
    return tuple(found)


def spelt_out(name: str) -> str:
    """A name of an actuator's column with a glider's letters for what was ordered and what acted as words.

    Example:
        >>> spelt_out("c battpos"), spelt_out("c 1")
        ('cmd battpos', 'c 1')
    """
    letter, _, rest = name.partition(" ")
    return f"{_OF_GLIDERS[letter]} {rest}" if letter in _OF_GLIDERS and len(rest) >= _SHORTEST else name
