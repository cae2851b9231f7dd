"""The collision monitor of a robot in a scenario; names are Nav2's."""

from __future__ import annotations

from pydantic import model_validator

from twin.navigation.control.collision_monitor_config import (
    CollisionMonitorConfig,
    MonitorCloud,
    MonitorPolygon,
)
from twin.parameters.placed import overridden
from twin.scenario.parameter_group import ParameterGroup, keys_of


@keys_of(MonitorPolygon, whole=True)
class MonitorPolygonParameters(ParameterGroup):
    """A polygon about the robot, and what is done about obstacles in it."""

    @model_validator(mode="after")
    def _can_be(self) -> MonitorPolygonParameters:
        self.config()
        return self

    def config(self) -> MonitorPolygon:
        """Return the polygon."""
        return overridden(MonitorPolygon(name=self.name, action_type=self.action_type), self.overrides())


@keys_of(MonitorCloud, whole=True)
class MonitorCloudParameters(ParameterGroup):
    """A topic of point clouds that the monitor looks at."""

    @model_validator(mode="after")
    def _can_be(self) -> MonitorCloudParameters:
        self.config()
        return self

    def config(self) -> MonitorCloud:
        """Return the source."""
        return overridden(MonitorCloud(topic=self.topic), self.overrides())


@keys_of(CollisionMonitorConfig, whole=True)
class CollisionMonitorParameters(ParameterGroup):
    """Guards the commands of navigation and of people; only for robots with a lidar on `scan`, or with topics
    named here.
    """

    polygons: tuple[MonitorPolygonParameters, ...] | None = None
    """The slowest of their results holds; absent: `approach` with the footprint, as early as it brakes."""
    scan_topics: tuple[str, ...] | None = None
    """Topics of sensor_msgs/LaserScan that it looks at; absent: `scan`, if the robot has a lidar there."""
    range_topics: tuple[str, ...] = ()
    """Topics of sensor_msgs/Range that it looks at, too."""
    clouds: tuple[MonitorCloudParameters, ...] = ()
    """Topics of sensor_msgs/PointCloud2 that it looks at, too."""
