"""Nav2's control and decorator nodes (nav2_behavior_tree/plugins) as py_trees composites."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Generator, Iterator, Sequence

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Composite

Step = Generator[Behaviour, None, Status]


class ControlNode(Composite):
    """A composite whose `step` says how its children run; running children are halted when it ends."""

    def tick(self) -> Iterator[Behaviour]:
        """Tick once; yields every node that was visited."""
        if self.status != Status.RUNNING:
            self._halt(lambda child: child.status != Status.INVALID)
            self.initialise()
        status = yield from self.step()
        if status == Status.RUNNING:
            self.status = status
        else:
            self._halt(lambda child: child.status == Status.RUNNING)
            self.stop(status)
        yield self

    @abstractmethod
    def step(self) -> Step:
        """Tick the children that are due and return the own status."""

    def _halt(self, which: Callable[[Behaviour], bool]) -> None:
        for child in self.children:
            if which(child):
                child.stop(Status.INVALID)


class PipelineSequence(ControlNode):
    """Ticks earlier children again while a later one runs; the last one's success is its own."""

    def initialise(self) -> None:
        """Start with the first child."""
        self._last_ticked = 0

    def step(self) -> Step:
        """Tick all children up to the furthest one reached so far."""
        for i, child in enumerate(self.children):
            yield from child.tick()
            if child.status == Status.FAILURE:
                return Status.FAILURE
            if child.status == Status.RUNNING and i >= self._last_ticked:
                self._last_ticked = i
                return Status.RUNNING
        return Status.SUCCESS


class RecoveryNode(ControlNode):
    """Runs its first child; when that fails, runs the second one and tries again, at most `retries` times."""

    def __init__(self, name: str, retries: int, main: Behaviour, recovery: Behaviour) -> None:
        super().__init__(name, [main, recovery])
        self.retries = retries

    def initialise(self) -> None:
        """Start with the main child and all retries."""
        self._recovering = False
        self._count = 0

    def step(self) -> Step:
        """Tick the main child; after its failure the recovery, after whose success the main child again."""
        main, recovery = self.children
        while True:
            if not self._recovering:
                yield from main.tick()
                if main.status != Status.FAILURE:
                    return main.status
                if self._count >= self.retries:
                    return Status.FAILURE
                self._recovering = True
            yield from recovery.tick()
            if recovery.status != Status.SUCCESS:
                return recovery.status
            self._recovering = False
            self._count += 1


class RoundRobin(ControlNode):
    """Runs one child a time, going on with the next one at every entry; fails when all have failed."""

    _next = 0

    def initialise(self) -> None:
        """Forget the failures of the last entry."""
        self._failures = 0

    def step(self) -> Step:
        """Tick the child whose turn it is."""
        while self._failures < len(self.children):
            child = self.children[self._next]
            yield from child.tick()
            if child.status == Status.RUNNING:
                return Status.RUNNING
            self._next = (self._next + 1) % len(self.children)
            if child.status == Status.SUCCESS:
                return Status.SUCCESS
            self._failures += 1
        self._next = 0
        return Status.FAILURE

    def terminate(self, new_status: Status) -> None:
        """Begin with the first child again after a halt while running."""
        if self.status == Status.RUNNING and new_status == Status.INVALID:
            self._next = 0


class RateController(ControlNode):
    """Ticks its child at once, then when `period_ns` of simulated time has passed; runs in between."""

    def __init__(self, name: str, period_ns: int, clock: Callable[[], int], child: Behaviour) -> None:
        super().__init__(name, [child])
        self._period_ns = period_ns
        self._clock = clock
        self._due: int | None = None

    def terminate(self, new_status: Status) -> None:
        """Forget the rate when halted, so that the next entry ticks at once."""
        if new_status == Status.INVALID:
            self._due = None

    def step(self) -> Step:
        """Tick the child if it is due or still running."""
        (child,) = self.children
        if self._due is not None and self._clock() < self._due and child.status != Status.RUNNING:
            return Status.RUNNING
        yield from child.tick()
        if child.status != Status.RUNNING:
            self._due = self._clock() + self._period_ns
        return child.status


class Fallback(ControlNode):
    """Ticks its children in order, from the first at every tick, until one does not fail."""

    def step(self) -> Step:
        """Return the status of the first child that does not fail."""
        for child in self.children:
            yield from child.tick()
            if child.status != Status.FAILURE:
                return child.status
        return Status.FAILURE


def sequence(name: str, children: Sequence[Behaviour]) -> Composite:
    """Return a sequence that goes on where it was (BehaviorTree.CPP's `Sequence`)."""
    from py_trees.composites import Sequence as PySequence

    return PySequence(name, memory=True, children=list(children))
