"""Nav2's control nodes and the decorators that need no more than a clock (nav2_behavior_tree/plugins)."""

from __future__ import annotations

from twin.navigation.behavior_trees.node import ControlNode, DecoratorNode, Status
from twin.navigation.behavior_trees.ports import Port, inputs


class PipelineSequence(ControlNode):
    """Ticks earlier children again while a later one runs; the last one's success is its own."""

    _furthest = 0

    def tick(self) -> Status:
        """Tick all children up to the furthest one reached so far."""
        skipped = 0
        for i, child in enumerate(self.children):
            status = child.execute_tick()
            if status is Status.FAILURE:
                return self.end(status)
            skipped += status is Status.SKIPPED
            if status is Status.RUNNING and i >= self._furthest:
                self._furthest = i
                return status
        return self.end(Status.SKIPPED if skipped == len(self.children) else Status.SUCCESS)

    def halt(self) -> None:
        """Start with the first child next time."""
        self._furthest = 0
        super().halt()


class _IdleIfSkipped(ControlNode):
    def end(self, status: Status) -> Status:
        """Begin anew next time; a node that is skipped is idle."""
        self.halt()
        if status is Status.SKIPPED:
            self.set_status(Status.IDLE)
        return status


class RecoveryNode(_IdleIfSkipped):
    """Runs its first child; when that fails, runs the second one and tries again, at most so many times."""

    CHILDREN = (2, 2)
    PORTS = inputs(number_of_retries=("int", 1))
    _recovering = False
    _count = 0

    def tick(self) -> Status:
        """Tick the first child; after its failure the second, after whose success the first again."""
        self.set_status(Status.RUNNING)
        main, recovery = self.children
        while True:
            if not self._recovering:
                status = main.execute_tick()
                if status is Status.RUNNING:
                    return status
                if status is not Status.FAILURE or self._count >= self.get("number_of_retries"):
                    return self.end(status)
                main.reset()
                self._recovering = True
            status = recovery.execute_tick()
            if status is Status.RUNNING:
                return status
            if status is Status.FAILURE:
                return self.end(status)
            recovery.reset()
            self._recovering = False
            if status is Status.SKIPPED:
                return Status.FAILURE
            self._count += 1

    def halt(self) -> None:
        """Have all retries again next time."""
        self._recovering, self._count = False, 0
        super().halt()


class RoundRobin(_IdleIfSkipped):
    """Runs one child a time, at every entry the next one; fails when all have failed, or after the last.

    Without `wrap_around` it fails when the last child has ended, also with success, and begins anew
    (since Nav2 Kilted; before, it always wrapped around).
    """

    PORTS = inputs(wrap_around=("bool", True))
    _current = _failed = 0

    def tick(self) -> Status:
        """Tick the child whose turn it is; after a failure the next one."""
        self.set_status(Status.RUNNING)
        count, skipped = len(self.children), 0
        while self._failed + skipped < count:
            child = self.children[self._current]
            if not child.status.is_active:
                self.context.on_recovery(child.name)
            status = child.execute_tick()
            self.context.recovering = status is Status.RUNNING
            if status is Status.RUNNING:
                return status
            self._current += 1
            self._failed += status is Status.FAILURE
            skipped += status is Status.SKIPPED
            if self._current == count:
                if not self.get("wrap_around"):
                    break
                self._current = 0
            if status is Status.SUCCESS:
                self._failed = 0
                self.reset_children()
                return status
        return self.end(Status.FAILURE if skipped < count else Status.SKIPPED)

    def halt(self) -> None:
        """Begin with the first child next time."""
        self._current = self._failed = 0
        self.context.recovering = False
        super().halt()


class NonblockingSequence(ControlNode):
    """Ticks all children at every tick; succeeds when all succeed at once, fails when one fails."""

    def tick(self) -> Status:
        """Tick all children."""
        all_succeeded = True
        for child in self.children:
            status = child.execute_tick()
            if status is Status.FAILURE:
                return self.end(status)
            all_succeeded &= status is not Status.RUNNING
        return self.end(Status.SUCCESS) if all_succeeded else Status.RUNNING


class PersistentSequence(ControlNode):
    """A sequence whose place is a blackboard entry, so that it outlives halts."""

    PORTS = (Port("current_child_idx", "int", required=True),)

    def tick(self) -> Status:
        """Tick from the child that the entry names."""
        self.set_status(Status.RUNNING)
        current = self.get("current_child_idx") or 0
        while current < len(self.children):
            status = self.children[current].execute_tick()
            if status is Status.RUNNING:
                return status
            if status is Status.FAILURE:
                break
            current += 1
            self.put("current_child_idx", current)
        self.reset_children()
        self.put("current_child_idx", 0)
        return Status.SUCCESS if current >= len(self.children) else Status.FAILURE


class RateController(DecoratorNode):
    """Ticks its child at once, then again when its period has passed; runs in between."""

    PORTS = inputs(hz=("double", 10.0))
    _started = 0
    _is_first = True

    def tick(self) -> Status:
        """Tick the child if it is due or still running."""
        now = self.context.now_ns()
        if not self.status.is_active:
            self._started, self._is_first = now, True
        self.set_status(Status.RUNNING)
        is_due = (now - self._started) * self.get("hz") >= 1e9
        if not (self._is_first or is_due or self.child.status is Status.RUNNING):
            return Status.RUNNING
        self._is_first = False
        status = self.child.execute_tick()
        if status is Status.SUCCESS:
            self._started = now
        return status


class SingleTrigger(DecoratorNode):
    """Runs its child once, then fails until it is reset."""

    _is_first = True

    def tick(self) -> Status:
        """Tick the child if it has not ended since the last reset."""
        if not self.status.is_active:
            self._is_first = True
        self.set_status(Status.RUNNING)
        if not self._is_first:
            return Status.FAILURE
        status = self.child.execute_tick()
        self._is_first = not status.is_completed
        return status
