"""What the nodes of one robot are built from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from twin.bridge.bus import Bus
from twin.geometry import Pose2
from twin.navigation.maps.occupancy_map import OccupancyMap
from twin.scenario.robots import RobotConfig
from twin.sim.battery import BatteryConfig
from twin.sim.robot import RobotHandle


@dataclass(frozen=True, kw_only=True)
class Layout:
    """Which nodes of robots there are, and where."""

    autonomy: Literal["all", "localisation", "none"] = "all"
    """What there is beside the nodes of the hardware (drive, joints, sensors, description); missions go with
    all of it."""
    hardware: str = ""
    """Before the namespaces of the hardware's nodes: with `/twin` they are beside a physical robot, which
    autonomy is then about."""
    is_one_of_several: bool = False
    """Whether other robots share the graph that are not of this run: the only one has its namespace, too."""
    commands: str = ""
    """Topic on which autonomy commands, behind `hardware` and the robot's namespace; empty: `cmd_vel`."""


WHOLE = Layout()


@dataclass(frozen=True, kw_only=True)
class StackContext:
    """What the stack of one robot is built from."""

    bus: Bus
    config: RobotConfig
    handle: RobotHandle
    start: Pose2
    """Where the robot really starts; only its guess, off by the scenario's error, reaches localisation."""
    map: OccupancyMap | None
    seed: int
    control_period_ns: int
    spawn_height: float
    """Of the root link when the robot stands on the floor [m]."""
    track_ratio: float | None
    """Effective over geometric track of a skid steer, as calibrated."""
    namespace: str
    """'' for a single robot, '/name' among several."""
    layout: Layout = WHOLE
    battery: BatteryConfig | None = None

    @property
    def hardware_namespace(self) -> str:
        """Of the nodes of its hardware."""
        return self.layout.hardware + self.namespace
