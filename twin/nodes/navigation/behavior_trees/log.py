"""`behavior_tree_log`: what changed in the tree (nav2_behavior_tree's RosTopicLogger)."""

from __future__ import annotations

from twin.bridge.msgs import BehaviorTreeLog, BehaviorTreeStatusChange, stamp
from twin.bridge.node import Node
from twin.navigation.behavior_trees.node import Status, TreeNode


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
