"""What others are told of a navigation: how far it is, and what changed in its tree.

Distance along the path and time to go are told as by Nav2's feedback, changes on `behavior_tree_log`
(nav2_behavior_tree's RosTopicLogger).
"""

from __future__ import annotations

from collections import deque

import numpy as np

from twin.bridge.msgs import BehaviorTreeLog, BehaviorTreeStatusChange, Path, stamp
from twin.bridge.node import Node
from twin.geometry import Array, Pose2
from twin.navigation.behavior_trees import paths
from twin.navigation.behavior_trees.node import Status, TreeNode
from twin.nodes.messages import path_array

_SEARCH_WINDOW = 2.0
"""How far along the path the robot is searched for, from where it was [m]."""
_SLOW, _NEAR = 0.01, 0.1
"""Below these speeds [m/s] and distances [m] no time is estimated."""


class Progress:
    """Follows the robot along the path of the moment."""

    def __init__(self, filter_duration_ns: int) -> None:
        """Speed is averaged over `filter_duration_ns`."""
        self._window_ns = filter_duration_ns
        self._poses: deque[tuple[int, Pose2]] = deque()
        self._path: Path | None = None
        self._points: Array = np.zeros((0, 3))
        self._to_go: Array = np.zeros(0)
        """From each point to the end, below zero, so that it rises along the path [m]."""
        self._nearest = 0

    def update(self, path: Path | None, pose: Pose2, now_ns: int) -> tuple[float, int]:
        """Return the length of path left [m], 0 without a path, and the time to go [ns], 0 if unknown."""
        self._poses.append((now_ns, pose))
        while len(self._poses) > 2 and self._poses[0][0] < now_ns - self._window_ns:
            self._poses.popleft()
        distance = self._remaining(path, pose)
        speed = self._speed()
        if speed <= _SLOW or distance <= _NEAR:
            return distance, 0
        return distance, round(distance / speed * 1e9)

    def _speed(self) -> float:
        (began_ns, first), (now_ns, last) = self._poses[0], self._poses[-1]
        return first.distance(last) / ((now_ns - began_ns) * 1e-9) if now_ns > began_ns else 0.0

    def _remaining(self, path: Path | None, pose: Pose2) -> float:
        if path is not self._path:
            self._path, self._nearest = path, 0
            self._points = path_array(path) if path is not None else np.zeros((0, 3))
            ahead = paths.steps(self._points)[::-1].cumsum()[::-1] if len(self._points) else np.zeros(0)
            self._to_go = -np.append(ahead, 0.0)
        if not len(self._points):
            return 0.0
        to_go = self._to_go
        behind = int(to_go.searchsorted(_SEARCH_WINDOW + to_go[self._nearest], side="right"))
        ahead_xy = self._points[self._nearest : behind]
        dx, dy = ahead_xy[:, 0] - pose.x, ahead_xy[:, 1] - pose.y
        self._nearest += int((dx * dx + dy * dy).argmin())
        return -float(to_go[self._nearest])


class TreeLog:
    """Gathers changes of status, and publishes those of a tick together."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._publisher = node.create_publisher(BehaviorTreeLog, "behavior_tree_log", 10)
        self._changes: list[BehaviorTreeStatusChange] = []

    def take(self, node: TreeNode, before: Status, now: Status) -> None:
        """Remember a change."""
        self._changes.append(
            BehaviorTreeStatusChange(
                timestamp=stamp(self._node.now_ns),
                node_name=node.name,
                uid=node.uid,
                previous_status=before.value,
                current_status=now.value,
            )
        )

    def flush(self) -> None:
        """Publish what has changed, if anything has."""
        if self._changes:
            self._publisher.publish(
                BehaviorTreeLog(timestamp=stamp(self._node.now_ns), event_log=self._changes)
            )
            self._changes = []
