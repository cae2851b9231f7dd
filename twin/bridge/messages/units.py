"""Units of fields of messages, as their definitions and REP-103 have them."""

from __future__ import annotations

from collections.abc import Mapping

_POINT = {"x": "m", "y": "m", "z": "m"}
_UNITS: Mapping[str, Mapping[str, str]] = {
    "builtin_interfaces/msg/Time": {"": "ns"},
    "builtin_interfaces/msg/Duration": {"": "ns"},
    "geometry_msgs/msg/Point": _POINT,
    "geometry_msgs/msg/Point32": _POINT,
    "geometry_msgs/msg/Pose2D": {"x": "m", "y": "m", "theta": "rad"},
    "geometry_msgs/msg/Transform": {f"translation.{axis}": "m" for axis in "xyz"},
    "geometry_msgs/msg/Twist": {
        **{f"linear.{axis}": "m/s" for axis in "xyz"},
        **{f"angular.{axis}": "rad/s" for axis in "xyz"},
    },
    "geometry_msgs/msg/Accel": {
        **{f"linear.{axis}": "m/s^2" for axis in "xyz"},
        **{f"angular.{axis}": "rad/s^2" for axis in "xyz"},
    },
    "geometry_msgs/msg/Wrench": {
        **{f"force.{axis}": "N" for axis in "xyz"},
        **{f"torque.{axis}": "N m" for axis in "xyz"},
    },
    "nav_msgs/msg/MapMetaData": {"resolution": "m"},
    "sensor_msgs/msg/BatteryState": {
        "voltage": "V", "current": "A", "temperature": "degC",
        **dict.fromkeys(("charge", "capacity", "design_capacity"), "Ah"),
    },
    "sensor_msgs/msg/FluidPressure": {"fluid_pressure": "Pa"},
    "sensor_msgs/msg/Imu": {
        **{f"angular_velocity.{axis}": "rad/s" for axis in "xyz"},
        **{f"linear_acceleration.{axis}": "m/s^2" for axis in "xyz"},
    },
    "sensor_msgs/msg/LaserScan": {
        **dict.fromkeys(("angle_min", "angle_max", "angle_increment"), "rad"),
        **dict.fromkeys(("time_increment", "scan_time"), "s"),
        **dict.fromkeys(("range_min", "range_max", "ranges"), "m"),
    },
    "sensor_msgs/msg/MagneticField": {f"magnetic_field.{axis}": "T" for axis in "xyz"},
    "sensor_msgs/msg/NavSatFix": {"latitude": "deg", "longitude": "deg", "altitude": "m"},
    "sensor_msgs/msg/Range": {
        "field_of_view": "rad", **dict.fromkeys(("min_range", "max_range", "range"), "m"),
    },
    "sensor_msgs/msg/Temperature": {"temperature": "degC"},
}  # fmt: skip
"""By type, and path of the field from there."""


def unit_of(places: list[tuple[str, str]]) -> str:
    """Return the unit of a field, '' if it has none or that is not known.

    Args:
        places: The types of the messages that it is in, outermost first, each with its path from there.
    """
    return next((_UNITS[typename][path] for typename, path in places if path in _UNITS.get(typename, ())), "")
