"""Odometry from clouds."""

from __future__ import annotations

from twin.nodes.lidar_odometry import LidarOdometryConfig
from twin.scenario.parameter_group import ParameterGroup, keys_of


@keys_of(LidarOdometryConfig)
class LidarOdometryParameters(ParameterGroup):
    """Parameters of `/lidar_odometry`, which matches each cloud with those before it."""
