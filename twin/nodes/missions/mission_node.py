"""What all missions are: a node that knows whether it is over."""

from __future__ import annotations

from twin.bridge.bus import Bus
from twin.bridge.msgs import String
from twin.bridge.qos import LATCHED
from twin.navigation.behavior_trees.node import Status, TreeNode

PERIOD_NS = 100_000_000
"""Of missions that need no other [ns]."""


class MissionNode:
    """`/mission`: publishes `mission/state`, and knows whether the mission is over and how it ended.

    A user's mission is one, made with a `MissionContext` and an object of its `Config`, a frozen dataclass.
    """

    def __init__(self, bus: Bus, *, namespace: str = "") -> None:
        self.node = bus.create_node("mission", namespace)
        self._publisher = self.node.create_publisher(String, "mission/state", LATCHED)
        self.state = "start"
        self.done = False
        self.succeeded: bool | None = None
        self.reason = ""

    def run(self, tree: TreeNode, period_ns: int) -> None:
        """Tick a tree until it ends, and the mission with it."""

        def tick() -> None:
            status = Status.IDLE if self.done else tree.execute_tick()
            if status.is_completed:
                self.finish(status is Status.SUCCESS)

        self.node.create_timer(period_ns, tick)

    def enter(self, state: str) -> None:
        """Go on to `state` and tell it."""
        self.state = state
        self._publisher.publish(String(data=state))
        self.node.get_logger().info(state)

    def note(self, reason: str) -> None:
        """Keep a reason for a failure; the last one is that of the mission."""
        self.reason = f"{self.state}: {reason}"
        self.node.get_logger().warn(self.reason)

    def finish(self, succeeded: bool) -> None:
        """End the mission."""
        self.done, self.succeeded = True, succeeded
        if succeeded:
            self.reason = ""
        self.enter("done" if succeeded else "failed")
