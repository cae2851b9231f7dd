"""A docking server before a shelf, on ideal wheels and synthetic scans."""

from __future__ import annotations

from typing import Any

import numpy as np

from tests.nodes.conftest import TICK_NS, Bench, Robot, Room, box
from twin.bridge.action_types import (
    DockRobot,
    UndockRobot,
)
from twin.bridge.actions import ActionClient
from twin.bridge.conversions import pose_from_pose2
from twin.bridge.msgs import (
    PoseArray,
    header,
    new,
)
from twin.geometry import Pose2
from twin.navigation.costmaps.costmap_config import CostmapConfig
from twin.navigation.docking.docks import DockDatabase
from twin.nodes.messages import pose_stamped
from twin.nodes.navigation.costmaps.config import CostmapNodeConfig
from twin.nodes.navigation.costmaps.costmap import CostmapNode
from twin.nodes.navigation.docking.config import DockingServerConfig
from twin.nodes.navigation.docking.server import DockingServerNode
from twin.warehouse.docks import DOCK_TYPES

FOOTPRINT = ((0.15, 0.15), (-0.15, 0.15), (-0.15, -0.15), (0.15, -0.15))
LOCAL_COSTMAP = CostmapNodeConfig(
    name="local_costmap",
    frame="odom",
    layers=CostmapConfig(footprint=FOOTPRINT, rolling_window=True, expected_update_rate=0.35),
)


CONFIG = DockingServerConfig(database=DockDatabase(types=DOCK_TYPES))


class Dock:
    """A shelf's face 2 m ahead, and if `tote` a tote 0.05 m behind it that the tote detector would report."""

    FACE = Pose2(2.0, 0.0, 0.0)

    def __init__(
        self,
        bench: Bench,
        *,
        start: Pose2,
        shelf: bool = True,
        config: DockingServerConfig | None = None,
        costmap: bool = False,
    ) -> None:
        self.bench = bench
        room = Room(box(-4.0, -4.0, 4.0, 4.0))
        if shelf:
            room.add_box(2.0, -1.5, 2.6, 1.5)
        self.robot = Robot(bench, room, cmd_vel="cmd_vel_docking", start=start)
        pose = self.robot.pose_lookup
        local = CostmapNode(bench.bus, pose, LOCAL_COSTMAP) if costmap else None
        DockingServerNode(bench.bus, pose, config or CONFIG, costmap=local, footprint=np.array(FOOTPRINT))
        self.told: list[Any] = []
        self.dock_client = ActionClient(bench.node, DockRobot, "dock_robot")
        self.undock_client = ActionClient(bench.node, UndockRobot, "undock_robot")
        self._totes = bench.node.create_publisher(PoseArray, "box_poses", 1)
        bench.run(0.5)

    def send(self, kind: str = "table", believed: Pose2 | None = None, **fields: Any) -> Any:
        docked = (believed or self.FACE) @ Pose2(-0.55, 0.0, 0.0)
        wanted = {"use_dock_id": False, "navigate_to_staging_pose": False, "dock_type": kind} | fields
        return self.dock_client.send_goal(
            new(DockRobot.Goal, dock_pose=pose_stamped(docked, "map", 0), **wanted), self.told.append
        )

    def dock(self, kind: str = "table", believed: Pose2 | None = None) -> Any:
        goal = self.send(kind, believed)
        self.bench.until(lambda: goal.done, 120.0)
        self.bench.run(0.5)
        return goal

    def show_totes(self, *ys: float, first: float | None = None) -> None:
        """Report, at every tick, totes at lateral positions `ys` of the face; at first one at `first`."""
        once = [] if first is None else [first]

        def report() -> None:
            shown = [once.pop()] if once else ys
            in_base = [self.robot.pose.inverse() @ Pose2(2.05, y, 0.0) for y in shown]
            in_base.sort(key=lambda pose: abs(pose.y))
            poses = [pose_from_pose2(pose) for pose in in_base]
            stamp = header(self.bench.clock.now_ns - TICK_NS, "base_footprint")
            self._totes.publish(PoseArray(header=stamp, poses=poses))

        self.bench.each_tick.append(report)

    def undock(self) -> float:
        """Undock; return how far the robot drove back."""
        before = self.robot.pose
        goal = self.undock_client.send_goal(new(UndockRobot.Goal, dock_type="table"))
        self.bench.until(lambda: goal.done)
        assert goal.result.success
        self.bench.run(0.5)
        return before.distance(self.robot.pose)
