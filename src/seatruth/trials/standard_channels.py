"""The standard channels: names that checks, preparation steps and effects understand, with their units."""

from __future__ import annotations

from seatruth.trials.channel import Channel

_ALL = (
    Channel("x", "m", "position along the earth x axis (north, or the basin's axis)"),
    Channel("y", "m", "position along the earth y axis (east, or 90 deg clockwise of x)"),
    Channel("z", "m", "position along the earth z axis, down"),
    Channel("depth", "m", "depth below the surface"),
    Channel("phi", "rad", "roll, positive starboard down", angle=True),
    Channel("theta", "rad", "pitch, positive nose up", angle=True),
    Channel("psi", "rad", "heading, positive clockwise seen from above", angle=True),
    Channel("u", "m/s", "velocity over ground along body x, forward"),
    Channel("v", "m/s", "velocity over ground along body y, to starboard"),
    Channel("w", "m/s", "velocity over ground along body z, down"),
    Channel("u_w", "m/s", "velocity through the water along body x, forward"),
    Channel("v_w", "m/s", "velocity through the water along body y, to starboard"),
    Channel("w_w", "m/s", "velocity through the water along body z, down"),
    Channel("sog", "m/s", "speed over ground"),
    Channel("cog", "rad", "course over ground, clockwise from north", angle=True),
    Channel("v_n", "m/s", "velocity over ground, north"),
    Channel("v_e", "m/s", "velocity over ground, east"),
    Channel("v_d", "m/s", "velocity over ground, down"),
    Channel("p", "rad/s", "roll rate"),
    Channel("q", "rad/s", "pitch rate, positive nose up"),
    Channel("r", "rad/s", "yaw rate, positive nose to starboard"),
    Channel("a_x", "m/s^2", "kinematic acceleration along body x (gravity removed)"),
    Channel("a_y", "m/s^2", "kinematic acceleration along body y (gravity removed)"),
    Channel("a_z", "m/s^2", "kinematic acceleration along body z (gravity removed)"),
    Channel("f_x", "m/s^2", "specific force (accelerometer, with gravity) along body x"),
    Channel("f_y", "m/s^2", "specific force (accelerometer, with gravity) along body y"),
    Channel("f_z", "m/s^2", "specific force (accelerometer, with gravity) along body z"),
    Channel("latitude", "deg", "latitude, north positive (WGS-84); with longitude it gives x and y"),
    Channel("longitude", "deg", "longitude, east positive (WGS-84)"),
    Channel("northing", "m", "UTM northing; with easting and the zone it gives x and y"),
    Channel("easting", "m", "UTM easting"),
    Channel("delta", "rad", "rudder, positive turns to starboard"),
    Channel("delta_s", "rad", "stern plane, positive pitches the nose down"),
    Channel("n", "rev/s", "propeller speed"),
)

STANDARD_CHANNELS: dict[str, Channel] = {channel.name: channel for channel in _ALL}
"""Standard channel by name; see seatruth.trials.channel.Channel for the conventions."""
