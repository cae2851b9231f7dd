"""BehaviorTree.CPP's nodes that tick all children at once (parallel_node.cpp, parallel_all_node.cpp)."""

from __future__ import annotations

from twin.navigation.behavior_trees.node import ControlNode, NodeSetup, Status
from twin.navigation.behavior_trees.ports import inputs


class Parallel(ControlNode):
    """Succeeds or fails when so many children did; negative thresholds count from the number of children."""

    PORTS = inputs(success_count=("int", -1), failure_count=("int", 1))

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._ended: dict[int, Status] = {}

    def tick(self) -> Status:
        """Tick the children that have not ended."""
        self.set_status(Status.RUNNING)
        count = len(self.children)
        success_count, failure_count = self.get("success_count"), self.get("failure_count")
        needed, fatal = _threshold(success_count, count), _threshold(failure_count, count)
        skipped = 0
        for i, child in enumerate(self.children):
            if i not in self._ended:
                status = child.execute_tick()
                skipped += status is Status.SKIPPED
                if status.is_completed:
                    self._ended[i] = status
            ends = list(self._ended.values())
            succeeded, failed = ends.count(Status.SUCCESS), ends.count(Status.FAILURE)
            if succeeded >= needed or (success_count < 0 and succeeded + skipped >= needed):
                return self._end(Status.SUCCESS)
            if count - failed < needed or failed == fatal:
                return self._end(Status.FAILURE)
        return Status.SKIPPED if skipped == count else Status.RUNNING

    def halt(self) -> None:
        """Forget which children have ended."""
        self._ended.clear()
        super().halt()

    def _end(self, status: Status) -> Status:
        self._ended.clear()
        self.reset_children()
        return status


class ParallelAll(ControlNode):
    """Waits for all children; fails if `max_failures` of them failed."""

    PORTS = inputs(max_failures=("int", 1))

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._ended: dict[int, Status] = {}

    def tick(self) -> Status:
        """Tick the children that have not ended."""
        self.set_status(Status.RUNNING)
        skipped = 0
        for i, child in enumerate(self.children):
            if i in self._ended:
                continue
            status = child.execute_tick()
            skipped += status is Status.SKIPPED
            if status.is_completed:
                self._ended[i] = status
        count = len(self.children)
        if skipped == count:
            return Status.SKIPPED
        if skipped + len(self._ended) < count:
            return Status.RUNNING
        failed = list(self._ended.values()).count(Status.FAILURE)
        self._ended.clear()
        self.reset_children()
        fatal = _threshold(self.get("max_failures"), count)
        return Status.FAILURE if failed >= fatal else Status.SUCCESS

    def halt(self) -> None:
        """Forget which children have ended."""
        self._ended.clear()
        super().halt()


def _threshold(given: int, count: int) -> int:
    return given if given >= 0 else max(count + given + 1, 0)
