"""What finds tags in a robot's images; names are apriltag_ros's."""

from __future__ import annotations

from twin.nodes.cameras.apriltag import AprilTagNodeConfig
from twin.scenario.parameter_group import ParameterGroup, keys_of


@keys_of(AprilTagNodeConfig)
class AprilTagParameters(ParameterGroup):
    """Parameters of `/apriltag`, and which camera it looks through."""

    camera: str | None = None
    """Name of a sensor that makes images of colours; absent: the robot's first one."""
