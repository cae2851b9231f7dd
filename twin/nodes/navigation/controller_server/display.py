"""What `/controller_server` shows to those who look: the path ahead, and what the controller makes of it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from twin.bridge.msgs import (
    ColorRGBA,
    Marker,
    MarkerArray,
    Path,
    Point,
    PointStamped,
    Pose,
    Vector3,
    header,
    new,
)
from twin.bridge.node import Node
from twin.bridge.topics import Publisher
from twin.geometry import Array
from twin.navigation.control.controller import Controller
from twin.nodes.messages import path_msg

_HEIGHT = {"Candidate Trajectories": 0.03, "Optimal Trajectory": 0.06}
"""Above the floor [m]."""


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


def trajectory_markers(candidates: Array, optimal: Array | None, frame: str, time_ns: int) -> MarkerArray:
    """Return one marker of points for all candidates, and one for the optimal trajectory.

    Two markers of many points instead of the many spheres of Nav2's TrajectoryVisualizer: a hundredth of the
    bytes. As there, points fade from the robot to the ends: candidates from blue to green, the optimal one
    from black to cyan.

    Args:
        candidates: Shape (n, m, 2) [m].
        optimal: Shape (k, 3), or None.
        frame: Of both.
        time_ns: Of both.
    """
    steps = candidates.shape[1]
    shades = [ColorRGBA(r=0.0, g=i / steps, b=1.0 - i / steps, a=1.0) for i in range(steps)]
    markers = [_points("Candidate Trajectories", candidates.reshape(-1, 2), shades, frame, time_ns)]
    if optimal is not None:
        count = len(optimal)
        shades = [ColorRGBA(r=0.0, g=i / count, b=i / count, a=1.0) for i in range(count)]
        markers.append(_points("Optimal Trajectory", optimal[:, :2], shades, frame, time_ns))
    return new(MarkerArray, markers=markers)


def _points(space: str, points: Array, shades: list[ColorRGBA], frame: str, time_ns: int) -> Marker:
    """Return points whose colours go through `shades` again and again."""
    height = _HEIGHT[space]
    return new(
        Marker,
        header=header(time_ns, frame),
        ns=space,
        type=Marker.POINTS,
        action=Marker.ADD,
        pose=new(Pose),
        scale=Vector3(x=0.03, y=0.03, z=0.0),
        points=[Point(x=float(x), y=float(y), z=height) for x, y in points],
        colors=shades * (len(points) // len(shades)),
    )
