"""What the library calls the mechanisms of the catalogue.

The only file that ties this benchmark's words to the library's. A test compares it with `seatruth list effects`. A
mechanism without a name here has no counterpart on that kind of vehicle, and causes no case.
"""

from __future__ import annotations

UNKNOWN = "unknown"
"""Stands for a cause outside the library."""

_SHIP: dict[str, str] = {
    "current": "current",
    "rising_current": "varying_current",
    "speed_scale": "speed_scale",
    "speed_bias": "speed_bias",
    "sway_bias": "sway_bias",
    "heading_bias": "heading_bias",
    "compass_deviation": "compass_deviation",
    "gyro_bias": "gyro_bias",
    "lever_arm": "log_lever_arm",
    "turned_log": "log_misalignment",
    "antenna": "position_lever_arm",
    "position_delay": "position_delay",
    "heading_delay": "heading_delay",
    "rate_delay": "rate_delay",
    "speed_delay": "speed_delay",
    "rudder_offset": "rudder_offset",
    "rudder_gain": "rudder_gain",
    "lag": "rudder_lag",
    "rate_limit": "rudder_rate_limit",
    "dead_time": "rudder_delay",
    "dead_band": "rudder_dead_band",
    "play": "rudder_backlash",
    "propeller_walk": "propeller_walk",
    "thrust_aside": "thrust_misalignment",
    "thrust": "thrust_gain",
    "drag": "drag_increase",
    "wind": "wind",
    "cross_flow": "cross_flow",
    "turning_loss": "turning_loss",
    "added_mass": "added_mass",
    "sloshing": "sloshing",
    "munk": "munk",
    "asymmetry": "lateral_asymmetry",
    "waves": "wave_forces",
    "wave_drift": "wave_drift",
    "bank": "bank",
    "shallow_water": "shallow_water",
    "tether": "tether",
}
_AUV: dict[str, str] = {
    "current": "current_along",
    "speed_scale": "speed_scale",
    "speed_bias": "speed_bias",
    "heave_bias": "heave_bias",
    "pitch_bias": "pitch_bias",
    "pitch_gyro_bias": "pitch_gyro_bias",
    "lever_arm": "log_lever_arm_vertical",
    "turned_log": "log_misalignment_vertical",
    "pressure_port": "depth_lever_arm",
    "depth_scale": "depth_scale",
    "depth_lag": "depth_lag",
    "pitch_delay": "pitch_delay",
    "rate_delay": "rate_delay",
    "speed_delay": "speed_delay",
    "rudder_offset": "plane_offset",
    "rudder_gain": "plane_gain",
    "lag": "plane_lag",
    "rate_limit": "plane_rate_limit",
    "dead_time": "plane_delay",
    "dead_band": "plane_dead_band",
    "play": "plane_backlash",
    "thrust": "thrust_gain",
    "drag": "drag_increase",
    "cross_flow": "cross_flow_vertical",
    "turning_loss": "turning_loss_vertical",
    "wave_drift": "wave_drift_vertical",
    "net_weight": "net_weight",
    "trim": "trim",
    "added_mass": "added_mass",
    "munk": "munk_vertical",
    "asymmetry": "asymmetry",
    "tether": "tether",
}
_TWIN_LEFT_OUT = ("shallow_water", "propeller_walk", "thrust_aside")
_AFLOAT = ("wind", "waves", "wave_drift", "bank", "sloshing")
_RUDDER = ("rudder_offset", "rudder_gain", "lag", "rate_limit", "dead_time", "dead_band", "play")
_TWIN: dict[str, str] = {key: name for key, name in _SHIP.items() if key not in (*_RUDDER, *_TWIN_LEFT_OUT)}
_SCREW = ("propeller_walk", "thrust_aside", "thrust")
"""The Mariner's model knows no propeller."""
NAMES: dict[str, dict[str, str]] = {
    "ship": _SHIP,
    "auv": _AUV,
    "mariner": {key: name for key, name in _SHIP.items() if key not in _SCREW},
    "tanker": _SHIP,
    "torpedo": _AUV,
    "container": _SHIP,
    "twin": {**_TWIN, "weak_thrusters": "drive_gain_n_starboard"},
    "frame": {key: name for key, name in _TWIN.items() if key not in _AFLOAT},
}
"""Family -> key of the mechanism -> name of the effect."""

TITLES = {
    "seatruth": "seatruth diagnose", "rmse": "worst channel", "bic": "refit per effect, BIC",
    "white": "white, unprojected", "sindy": "SINDy discrepancy", "prior": "prior alone", "oracle": "oracle",
    "limit": "limit", "classifier": "classifier trained on the simulator", "orthogonal": "orthogonal Gaussian process",
    "kinematics": "sensors' agreement alone",
}  # fmt: skip
"""What the diagnosing programs are called in words."""
