"""BehaviorTree.CPP's control nodes (src/controls): those that tick children in order, and all at once."""

from __future__ import annotations

from typing import ClassVar

from twin.navigation.behavior_trees.node import ControlNode, NodeSetup, Status
from twin.navigation.behavior_trees.ports import inputs


class _Chain(ControlNode):
    """Goes on to the next child when one ended with `GO_ON`; an end with `STOP` is its own."""

    GO_ON: ClassVar[Status]
    STOP: ClassVar[Status]


class _InOrder(_Chain):
    """Keeps its place from tick to tick."""

    INTERRUPTIBLE: ClassVar[bool] = False
    """Whether the tree is ticked from its root between two children that end at once."""
    _current = _skipped = 0

    def tick(self) -> Status:
        """Tick from the current child on."""
        if not self.status.is_active:
            self._skipped = 0
        self.set_status(Status.RUNNING)
        while self._current < len(self.children):
            child = self.children[self._current]
            was_idle = child.status is Status.IDLE
            status = child.execute_tick()
            if status is Status.RUNNING:
                return status
            if status is self.STOP:
                self._stopped()
                return status
            self._skipped += status is Status.SKIPPED
            self._current += 1
            is_last = self._current == len(self.children)
            if self.INTERRUPTIBLE and was_idle and status is self.GO_ON and not is_last:
                self.context.woken = True
                return Status.RUNNING
        all_skipped = self._skipped == len(self.children)
        self.reset_children()
        self._current = self._skipped = 0
        return Status.SKIPPED if all_skipped else self.GO_ON

    def _stopped(self) -> None:
        self.reset_children()
        self._current = 0

    def halt(self) -> None:
        """Begin with the first child next time."""
        self._current = self._skipped = 0
        super().halt()


class Sequence(_InOrder):
    """Succeeds when all children did, one after the other; a failure ends it."""

    GO_ON, STOP = Status.SUCCESS, Status.FAILURE


class Fallback(_InOrder):
    """Tries children one after the other until one succeeds."""

    GO_ON, STOP = Status.FAILURE, Status.SUCCESS


class SequenceWithMemory(Sequence):
    """A sequence that after a failure or a halt goes on with the child that was not done."""

    INTERRUPTIBLE = True

    def _stopped(self) -> None:
        for child in self.children[self._current :]:
            child.reset()

    def halt(self) -> None:
        """Keep the place."""
        self.reset_children()


class _Reactive(_Chain):
    """Ticks from the first child every time; the one that runs halts all others."""

    def tick(self) -> Status:
        """Tick the children in order until one runs or stops it."""
        self.set_status(Status.RUNNING)
        all_skipped = True
        for child in self.children:
            status = child.execute_tick()
            all_skipped &= status is Status.SKIPPED
            if status is Status.RUNNING:
                for other in self.children:
                    if other is not child:
                        other.reset()
                return status
            if status is self.STOP:
                return self.end(status)
            if status is Status.SKIPPED:
                child.reset()
        return self.end(Status.SKIPPED if all_skipped else self.GO_ON)


class ReactiveSequence(_Reactive):
    """A sequence whose earlier children are asked again at every tick."""

    GO_ON, STOP = Status.SUCCESS, Status.FAILURE


class ReactiveFallback(_Reactive):
    """A fallback whose earlier children are asked again at every tick."""

    GO_ON, STOP = Status.FAILURE, Status.SUCCESS


class IfThenElse(ControlNode):
    """Ticks the second child if the first succeeds, else the third; asks once."""

    CHILDREN = (2, 3)
    _chosen = 0

    def tick(self) -> Status:
        """Ask, then tick what was chosen until it ends."""
        self.set_status(Status.RUNNING)
        if self._chosen == 0:
            status = self.children[0].execute_tick()
            if status is Status.SUCCESS:
                self._chosen = 1
            elif status is Status.FAILURE and len(self.children) == 3:
                self._chosen = 2
            else:
                return status
        status = self.children[self._chosen].execute_tick()
        return status if status is Status.RUNNING else self.end(status)

    def halt(self) -> None:
        """Ask again next time."""
        self._chosen = 0
        super().halt()


class WhileDoElse(ControlNode):
    """As `IfThenElse`, but asks at every tick."""

    CHILDREN = (2, 3)

    def tick(self) -> Status:
        """Ask, halt what is not chosen, tick what is."""
        self.set_status(Status.RUNNING)
        asked = self.children[0].execute_tick()
        if asked is Status.RUNNING:
            return asked
        chosen, other = (1, 2) if asked is Status.SUCCESS else (2, 1)
        if other < len(self.children):
            self.children[other].reset()
        status = self.children[chosen].execute_tick() if chosen < len(self.children) else Status.FAILURE
        return status if status is Status.RUNNING else self.end(status)


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
