"""The ways in which a ROS graph travels over Zenoh."""

from __future__ import annotations

from typing import Literal, get_args

Wire = Literal["rmw_zenoh", "humble", "ros2dds"]
"""rmw_zenoh of Jazzy and later; rmw_zenoh of Humble, which has no type hashes; zenoh-bridge-ros2dds."""
WIRES: tuple[Wire, ...] = get_args(Wire)
