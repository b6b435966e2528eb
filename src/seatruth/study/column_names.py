"""The words by which columns of logs are known: names of channels, units at the end of a name, orders and sides."""

from __future__ import annotations

MAGNETIC = tuple(
    f"{a} {b}" for one in ("mag", "magnetic") for name in ("hdg", "heading") for a, b in ((name, one), (one, name))
)
"""Names of a heading that lacks the declination."""
_POSITIONS = ("pos", "position", "usbl", "lbl", "sbl", "rtk")
"""What gives a position of which n and e are north and east. `gps n` may count satellites."""
NAMES: dict[str, tuple[str, ...]] = {
    "t": (
        *("t", "time", "timestamp", "seconds", "elapsed", "elapsed time", "utc", "datetime", "date time", "stamp"),
        *("unix time", "unix", "epoch", "gps time", "log time"),
    ),
    "x": (
        *("x", "x0", "north", "northing", "pos x", "position x", "x pos", "x position", "x north"),
        *(f"{one} n" for one in _POSITIONS),
    ),
    "y": (
        *("y", "y0", "east", "easting", "pos y", "position y", "y pos", "y position", "y east"),
        *(f"{one} e" for one in _POSITIONS),
    ),
    "z": ("z", "z0", "pos z", "position z", "down"),
    "depth": ("depth",),
    "phi": ("phi", "roll", "roll angle", "heel", "heel angle", "bank", "roll ang"),
    "theta": ("theta", "pitch", "pitch angle", "trim", "pitch ang"),
    "psi": (
        *("psi", "heading", "yaw", "yaw angle", "hdg", "heading angle", "compass", "gyro heading", "heading true"),
        *("true heading", "hdg true", "true hdg", "gyro", "gyrocompass", "gyro compass", "hdt", *MAGNETIC),
    ),
    "u": (
        *("u", "surge", "surge velocity", "surge speed", "speed", "forward speed", "longitudinal speed", "vx"),
        *("longitudinal velocity", "forward velocity", "velocity x", "ship speed", "u ship", "linear x"),
        *("longitudinal ground speed", "dvl vx", "dvl vx fwd", "dvl vx forward", "dvl u", "dvl x", "fwd speed"),
        *(
            "dvl fwd",
            "dvl ahead",
            "dvl surge",
            "dvl forward",
            "dvl fwd speed",
            "dvl forward speed",
            "fwd velocity",
            "velocity forward",
            "vel fwd",
        ),
    ),
    "v": (
        *("v", "sway", "sway velocity", "sway speed", "transverse speed", "lateral speed", "lateral velocity", "vy"),
        *("linear y", "transverse ground speed", "dvl vy", "dvl vy stbd", "dvl vy starboard", "dvl v", "dvl y"),
        *("dvl stbd", "dvl starboard", "dvl sway", "velocity starboard"),
    ),
    "w": (
        *("w", "heave velocity", "heave speed", "vertical speed", "vertical velocity", "vz", "heave rate"),
        *("dvl vz", "dvl w", "dvl z", "dvl down"),
    ),
    "u_w": (
        "u w",
        "stw",
        "speed through water",
        "speed through the water",
        "water speed",
        "log speed",
        "speed log",
        "longitudinal water speed",
    ),
    "v_w": ("v w", "stw across", "transverse speed through water", "transverse water speed"),
    "sog": ("sog", "speed over ground", "gps speed", "gnss speed", "ground speed", "speed gps", "spd"),
    "cog": ("cog", "course over ground", "gps course", "gnss course", "course", "track angle", "gcrs"),
    "v_n": ("v n", "vn", "v north", "north velocity", "velocity north", "vel n", "vel north"),
    "v_e": ("v e", "ve", "v east", "east velocity", "velocity east", "vel e", "vel east"),
    "v_d": ("v d", "vd", "v down", "down velocity", "velocity down", "vel d", "vel down"),
    "latitude": ("latitude", "lat", "gps lat", "gnss lat", "gps latitude"),
    "longitude": ("longitude", "lon", "lng", "long", "gps lon", "gps lng", "gnss lon", "gps longitude"),
    "northing": ("northing", "utm northing", "utm n", "utm north", "north", "utm y"),
    "easting": ("easting", "utm easting", "utm e", "utm east", "east", "utm x"),
    **{
        f"f_{axis}": tuple(f"{word} {axis}" for word in ("f", "acc", "accel", "accelerometer", "linear acceleration"))
        for axis in "xyz"
    },
    "p": ("p", "roll rate", "omega x", "gyro x", "gyr x", "roll velocity"),
    "q": ("q", "pitch rate", "omega y", "gyro y", "gyr y", "pitch velocity"),
    "r": (
        "r",
        "yaw rate",
        "rot",
        "rate of turn",
        "turn rate",
        "omega z",
        "gyro z",
        "gyr z",
        "yaw velocity",
        "rate turn",
        "angular z",
        "gyro",
        "gyro rate",
    ),
    "delta": (
        "delta",
        "rudder",
        "rudder angle",
        "helm",
        "rud",
        "rudder position",
        "rudder pos",
        "delta r",
        "steering",
        "steering angle",
        "nozzle",
        "nozzle angle",
        "jet angle",
    ),
    "delta_s": ("delta s", "stern plane", "stern planes", "elevator", "fin", "fin angle", "plane", "elevator angle"),
    "n": (
        *("n", "rpm", "rps", "propeller", "propeller speed", "shaft speed", "prop", "revs", "propeller rate", "shaft"),
        *(
            "prop speed",
            "propeller revs",
            "propeller rpm",
            "shaft rpm",
            "prop rpm",
            "propeller rps",
            "n prop",
            "engine",
            "propeller shaft speed",
            "shaft revolutions",
            "propeller revolutions",
            *("jet", "water jet", "waterjet", "impeller", "jet speed", "impeller speed", "jet rpm", "waterjet rpm"),
        ),
    ),
    "T": ("thrust", "thrust n", "propeller thrust"),
    "voltage": ("voltage", "battery voltage", "batt voltage", "vbat", "v bat", "battery v", "batt v"),
}
BRIDGE = frozenset(("rot", "rate of turn", "rate turn"))
"""Names of a rate of turn on a ship's bridge, where its instruments and sentences give deg/min (IEC 61162-1, ROT)."""
TOLD_BY_UNIT = frozenset(("gyro",))
"""Names of two channels, a gyrocompass's heading and a gyro's rate of turn, of which the unit tells which."""
SUFFIXES = {
    "deg": "deg",
    "degrees": "deg",
    "rad": "rad",
    "degs": "deg/s",
    "deg s": "deg/s",
    "deg per s": "deg/s",
    "deg sec": "deg/s",
    "degps": "deg/s",
    "dps": "deg/s",
    "rads": "rad/s",
    "rad s": "rad/s",
    "rad per s": "rad/s",
    "radps": "rad/s",
    "deg min": "deg/min",
    "degmin": "deg/min",
    **{length: length for length in ("m", "ft", "cm", "mm", "in", "km")},
    **dict.fromkeys(("inch", "inches"), "in"),
    **{volume: volume for volume in ("cc", "ml")},
    **dict.fromkeys(("l", "litre", "litres", "liter", "liters"), "l"),
    **{f"{length}3": f"{length}^3" for length in ("m", "cm")},
    **{pressure: pressure for pressure in ("dbar", "bar", "mbar")},
    **dict.fromkeys(("kpa", "k pa"), "kPa"),
    **dict.fromkeys(("hpa", "h pa"), "hPa"),
    "pa": "Pa",
    "ms": "m/s",
    "m s": "m/s",
    "mps": "m/s",
    "m per s": "m/s",
    **{f"{length} s": f"{length}/s" for length in ("cm", "mm", "ft")},
    **dict.fromkeys(("cms", "cm per s"), "cm/s"),
    **dict.fromkeys(("kmh", "km h", "kph"), "km/h"),
    **dict.fromkeys(("m s2", "m s 2", "mps2"), "m/s^2"),
    "kn": "kn",
    "kt": "kn",
    "kts": "kn",
    "knots": "kn",
    "rpm": "rpm",
    "rps": "rev/s",
    "hz": "rev/s",
    "s": "s",
    "sec": "s",
    "min": "min",
    "millis": "ms",
    "msec": "ms",
    "us": "us",
    "pct": "percent",
    "percent": "percent",
}
ORDERS = ("cmd", "command", "commanded", "order", "ordered", "setpoint", "sp", "demand", "demanded", "desired", "des")
"""Words that say that a column holds what an actuator was told."""
ACTED = ("feedback", "fb", "fdbk", "actual", "measured", "meas", "response", "indicated", "indicator")
"""Words that say that a column holds what an actuator did."""
TWINS = ("delta", "delta_s", "n")
"""Channels of which a vehicle may have one on each side, where its model has a single one."""
SIDES = {
    **dict.fromkeys(("port", "left", "ps", "bb"), "port"),
    **dict.fromkeys(("starboard", "stbd", "stb", "right", "sb"), "starboard"),
}
"""Words for the sides of a vehicle; bb and sb are the seaman's backbord and styrbord."""
PLACES = frozenset((*SIDES.values(), "bow", "stern", "fore", "front", "aft", "rear", "centre"))
"""Words of a place of a drive."""
OF_ANY_THRUSTER = frozenset(
    (
        *("n", "c", "t", "u", "rpm", "rps", "rev", "revs", "thr", "thruster", "thrust", "prop", "propeller"),
        *("motor", "engine", "esc", "speed", "shaft", "power", "throttle"),
    )
)
"""Words in the names of columns and inputs of thrusters that do not say which one it is."""
