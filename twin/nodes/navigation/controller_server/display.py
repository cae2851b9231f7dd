"""What `/controller_server` shows to those who look: the path ahead, and what the controller makes of it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from twin.bridge.msgs import MarkerArray, Path, Point, PointStamped, header
from twin.bridge.node import Node
from twin.bridge.topics import Publisher
from twin.geometry import Array
from twin.navigation.control.controller import Controller
from twin.nodes.messages import path_msg
from twin.nodes.navigation.controller_server.trajectory_markers import trajectory_markers


class ControllerDisplay:
    """Publishes `lookahead_point`, `transformed_global_plan`, `optimal_path` and `trajectories`."""

    def __init__(self, node: Node, frame: str) -> None:
        self._node = node
        self._frame = frame
        self._lookahead = node.create_publisher(PointStamped, "lookahead_point", 1)
        self._plan = node.create_publisher(Path, "transformed_global_plan", 1)
        self._optimal = node.create_publisher(Path, "optimal_path", 1)
        self._trajectories = node.create_publisher(MarkerArray, "trajectories", 1)
        self._watched_at = -1
        self._wanted: list[Publisher[Any]] = []

    def show(self, controller: Controller, ahead: Array) -> None:
        """Publish what is followed.

        Args:
            controller: After its command.
            ahead: The path ahead of the robot, shape (n, 3).
        """
        now, frame = self._node.now_ns, self._frame
        if controller.carrot is not None:
            x, y = controller.carrot
            self._lookahead.publish(PointStamped(header=header(now, frame), point=Point(x=x, y=y, z=0.0)))
        wanted = self._watched(now)
        if self._plan in wanted:
            self._plan.publish(path_msg(ahead, frame, now))
        if self._optimal in wanted and (trajectory := controller.trajectory) is not None:
            self._optimal.publish(path_msg(trajectory, frame, now))
        if self._trajectories in wanted and (candidates := controller.candidates) is not None:
            self._trajectories.publish(trajectory_markers(candidates, controller.trajectory, frame, now))

    def _watched(self, now_ns: int) -> Sequence[Publisher[Any]]:
        """Return what somebody looks at, as of this second: to ask costs as much as to command."""
        second = now_ns // 1_000_000_000
        if second != self._watched_at:
            self._watched_at = second
            shown = (self._plan, self._optimal, self._trajectories)
            self._wanted = [publisher for publisher in shown if publisher.has_subscribers]
        return self._wanted
