"""Nav2's RecoveryNode as a py_trees composite, for missions; the navigator has trees of its own kind."""

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


def sequence(name: str, children: Sequence[Behaviour]) -> Composite:
    """Return a sequence that goes on where it was (BehaviorTree.CPP's `Sequence`)."""
    from py_trees.composites import Sequence as PySequence

    return PySequence(name, memory=True, children=list(children))
