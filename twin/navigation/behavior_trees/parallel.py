"""BehaviorTree.CPP's nodes that tick all children at once (parallel_node.cpp, parallel_all_node.cpp)."""

from __future__ import annotations

from twin.navigation.behavior_trees.node import ControlNode, NodeSetup, Status
from twin.navigation.behavior_trees.ports import inputs


class _AtOnce(ControlNode):
    """Remembers which children have ended."""

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._ended: dict[int, Status] = {}

    def tick_child(self, index: int) -> bool:
        """Tick a child unless it has ended; return whether it is skipped."""
        if index in self._ended:
            return False
        status = self.children[index].execute_tick()
        if status.is_completed:
            self._ended[index] = status
        return status is Status.SKIPPED

    def halt(self) -> None:
        """Forget which children have ended."""
        self._ended.clear()
        super().halt()


class Parallel(_AtOnce):
    """Succeeds or fails when so many children did; negative thresholds count from the number of children."""

    PORTS = inputs(success_count=("int", -1), failure_count=("int", 1))

    def tick(self) -> Status:
        """Tick the children that have not ended."""
        self.set_status(Status.RUNNING)
        count = len(self.children)
        success_count, failure_count = self.get("success_count"), self.get("failure_count")
        needed, fatal = _threshold(success_count, count), _threshold(failure_count, count)
        skipped = 0
        for i in range(count):
            skipped += self.tick_child(i)
            ends = list(self._ended.values())
            succeeded, failed = ends.count(Status.SUCCESS), ends.count(Status.FAILURE)
            if succeeded >= needed or (success_count < 0 and succeeded + skipped >= needed):
                return self.end(Status.SUCCESS)
            if count - failed < needed or failed == fatal:
                return self.end(Status.FAILURE)
        return Status.SKIPPED if skipped == count else Status.RUNNING


class ParallelAll(_AtOnce):
    """Waits for all children; fails if `max_failures` of them failed."""

    PORTS = inputs(max_failures=("int", 1))

    def tick(self) -> Status:
        """Tick the children that have not ended."""
        self.set_status(Status.RUNNING)
        count = len(self.children)
        skipped = sum(self.tick_child(i) for i in range(count))
        if skipped == count:
            return Status.SKIPPED
        if skipped + len(self._ended) < count:
            return Status.RUNNING
        failed = list(self._ended.values()).count(Status.FAILURE)
        fatal = _threshold(self.get("max_failures"), count)
        return self.end(Status.FAILURE if failed >= fatal else Status.SUCCESS)


def _threshold(given: int, count: int) -> int:
    return given if given >= 0 else max(count + given + 1, 0)
