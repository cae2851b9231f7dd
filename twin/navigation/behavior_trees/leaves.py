"""BehaviorTree.CPP's leaves (actions/*.h)."""

from __future__ import annotations

from twin.navigation.behavior_trees.node import Status, TreeNode
from twin.navigation.behavior_trees.ports import Port, is_pointer


class AlwaysSuccess(TreeNode):
    """Succeeds."""

    def tick(self) -> Status:
        """Succeed."""
        return Status.SUCCESS


class AlwaysFailure(TreeNode):
    """Fails."""

    def tick(self) -> Status:
        """Fail."""
        return Status.FAILURE


class SetBlackboard(TreeNode):
    """Sets an entry to a text, or to the value of another entry."""

    PORTS = (Port("output_key", "any", is_output=True, required=True), Port("value", "any", required=True))

    def tick(self) -> Status:
        """Set it."""
        self.put("output_key", self.get("value"))
        return Status.SUCCESS


class UnsetBlackboard(TreeNode):
    """Removes an entry; succeeds also if there is none."""

    PORTS = (Port("key", "any", required=True),)

    def tick(self) -> Status:
        """Remove it."""
        key = self._texts["key"]
        self.blackboard.unset(key[1:-1] if is_pointer(key) else key)
        return Status.SUCCESS


class Sleep(TreeNode):
    """Runs for so long, then succeeds."""

    PORTS = (Port("msec", "unsigned", required=True),)
    _due = 0

    def tick(self) -> Status:
        """Wait."""
        if self.status is not Status.RUNNING:
            self._due = self.context.now_ns() + self.get("msec") * 1_000_000
        return Status.SUCCESS if self.context.now_ns() >= self._due else Status.RUNNING
