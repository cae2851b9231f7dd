"""`/explore`: drives to frontiers of a growing map until none is left; names and colours of explore_lite."""

from __future__ import annotations

import numpy as np

from twin.bridge.action_types import NavigateToPose
from twin.bridge.actions import ActionClient
from twin.bridge.actions.client import ClientGoal
from twin.bridge.bus import Bus
from twin.bridge.msgs import (
    Bool,
    ColorRGBA,
    ExploreStatus,
    Marker,
    MarkerArray,
    OccupancyGrid,
    header,
    new,
    ns,
)
from twin.bridge.qos import LATCHED
from twin.errors import MapError
from twin.geometry import Pose2
from twin.navigation.exploration.explorer import Explorer
from twin.navigation.maps.occupancy_map import OccupancyMap
from twin.navigation.warm_up import warm_up_exploration
from twin.nodes.messages import pose_stamped
from twin.nodes.navigation.exploration.config import ExplorerNodeConfig
from twin.nodes.navigation.mapping.graph_markers import BLUE, RED, Look, point_marker
from twin.nodes.navigation.mapping.map_server import occupancy_map
from twin.nodes.navigation.robot_pose import RobotPose
from twin.nodes.node_parameters import declare_config


class ExplorerNode:
    """Takes `map` and `explore/resume`; sends `navigate_to_pose`.

    Publishes `explore/status`, and `explore/frontiers` if somebody listens. The map decides what is a
    frontier, navigation what can be reached: a goal that it gives up is left out.
    """

    _WATCH_NS = 100_000_000

    def __init__(
        self,
        bus: Bus,
        robot_pose: RobotPose,
        config: ExplorerNodeConfig | None = None,
        *,
        namespace: str = "",
    ) -> None:
        self.node = node = bus.create_node("explore", namespace)
        self.config = config or ExplorerNodeConfig()
        warm_up_exploration()
        self.explorer = Explorer(self.config.explorer)
        self.done = False
        """Whether nothing is left to explore, and the robot is back where it was to return."""
        self.succeeded: bool | None = None
        """None until it is done."""
        self.status = ""
        """The last `explore/status`."""
        self.reason = ""
        """Why the last goal failed; empty if it did not."""
        self._robot_pose = robot_pose
        self._map: OccupancyMap | None = None
        self._map_ns = -1
        self._looked_ns = 0
        self._home: Pose2 | None = None
        self._goal: ClientGoal | None = None
        self._paused = False
        declare_config(node, self.config)
        self._status_publisher = node.create_publisher(ExploreStatus, "explore/status", LATCHED)
        self._markers = node.create_publisher(MarkerArray, "explore/frontiers", 10)
        self._navigate = ActionClient(node, NavigateToPose, "navigate_to_pose")
        node.create_subscription(OccupancyGrid, "map", self._on_map, LATCHED)
        node.create_subscription(Bool, "explore/resume", self._on_resume, 10)
        node.create_timer(self._WATCH_NS, self._watch)
        node.create_timer(self.config.planner_period_ns, self._plan)
        self._tell(ExploreStatus.EXPLORATION_STARTED)

    def _on_map(self, message: OccupancyGrid) -> None:
        try:
            self._map, self._map_ns = occupancy_map(message), ns(message.header.stamp)
        except MapError as error:
            self.node.get_logger().error(f"map refused: {error}")

    def _on_resume(self, message: Bool) -> None:
        if self.done or message.data != self._paused:
            return
        self._paused = not message.data
        if self._paused:
            self._stop()
            self.explorer.goal = None
            self._tell(ExploreStatus.EXPLORATION_PAUSED)
        else:
            self._tell(ExploreStatus.EXPLORATION_IN_PROGRESS)

    def _watch(self) -> None:
        """Take the end of a goal."""
        goal = self._goal
        if goal is None or not goal.done:
            return
        self._goal = None
        why = goal.error or getattr(goal.result, "error_msg", "") or "navigation failed"
        self.reason = "" if goal.succeeded else why
        if self.status == ExploreStatus.RETURNING_TO_ORIGIN:
            self._finish(ExploreStatus.RETURNED_TO_ORIGIN if goal.succeeded else None)
            return
        self._looked_ns = self.node.now_ns
        if goal.succeeded:
            self.explorer.arrived()
        else:
            self.node.get_logger().warn(f"frontier given up: {self.reason}")
            self.explorer.failed()

    def _plan(self) -> None:
        """Choose a goal on a map that is newer than the last arrival."""
        pose = self._robot_pose.in_map()
        returning = self.status == ExploreStatus.RETURNING_TO_ORIGIN
        if self.done or self._paused or returning or pose is None or self._map is None:
            return
        if self._home is None:
            self._home = pose
        # The clock may have been set back: no map comes from after now.
        self._looked_ns = min(self._looked_ns, self.node.now_ns)
        if self._map_ns <= self._looked_ns:
            return
        self._looked_ns = self._map_ns
        before = self.explorer.goal
        goal = self.explorer.update(self._map, pose, self.node.now_ns * 1e-9)
        self._show()
        if goal is not None and goal is not before:
            x, y = goal.target
            left = len(self.explorer.frontiers)
            self.node.get_logger().info(f"to the frontier at ({x:.2f}, {y:.2f}), the best of {left}")
            self._send(goal.pose)
        elif goal is None and self.explorer.explored:
            self._stop()
            self._explored()

    def _explored(self) -> None:
        given_up = len(self.explorer.given_up)
        self.node.get_logger().info(f"nothing left to explore, {given_up} places given up")
        if self.config.return_to_init and self._home is not None:
            self._tell(ExploreStatus.RETURNING_TO_ORIGIN)
            self._send(self._home)
        else:
            self._finish(ExploreStatus.EXPLORATION_COMPLETE)

    def _finish(self, status: str | None) -> None:
        """End; without a status the robot did not get back."""
        self.done = True
        self.succeeded = status is not None and (self.explorer.reached > 0 or not self.explorer.given_up)
        if status is not None:
            self._tell(status)

    def _send(self, pose: Pose2) -> None:
        """Send a goal; navigation drops the one before."""
        stamped = pose_stamped(pose, self._robot_pose.frames.map, self.node.now_ns)
        self._goal = self._navigate.send_goal(new(NavigateToPose.Goal, pose=stamped))

    def _stop(self) -> None:
        if self._goal is not None:
            self._goal.cancel()
            self._goal = None

    def _tell(self, status: str) -> None:
        self.status = status
        self._status_publisher.publish(new(ExploreStatus, status=status))

    def _show(self) -> None:
        if self._markers.has_subscribers:
            markers = frontier_markers(self.explorer, self._robot_pose.frames.map, self.node.now_ns)
            self._markers.publish(new(MarkerArray, markers=markers))


_GREEN = ColorRGBA(r=0.0, g=1.0, b=0.0, a=1.0)


def frontier_markers(explorer: Explorer, frame: str, time_ns: int) -> list[Marker]:
    """Return frontiers as blue points, given up ones as red points, their targets as green spheres.

    The first marker deletes those of the time before.
    """
    at, frontiers = header(time_ns, frame), explorer.frontiers
    looks: list[Look] = [(Marker.POINTS, frontier.points, 0.1, BLUE) for frontier in frontiers]
    if frontiers:
        looks.append((Marker.SPHERE_LIST, np.array([each.target for each in frontiers]), 0.3, _GREEN))
    if explorer.given_up:
        looks.append((Marker.POINTS, np.array(explorer.given_up), 0.2, RED))
    first = new(Marker, header=at, ns="frontiers", action=Marker.DELETEALL)
    return [first, *(point_marker(at, "frontiers", number, look) for number, look in enumerate(looks, 1))]
