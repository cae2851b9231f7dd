"""What a known-bad stack is: one thing that is wrong, in the scenario, before nodes are made, or in them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from typing import Any

from twin.bridge.bus import Bus
from twin.bridge.topics import Endpoint, Publisher
from twin.errors import TwinError
from twin.models.specs import DriveSpec
from twin.runtime.run import Run
from twin.sim.robot import RobotHandle
from twin.sim.world import World


class NotHere(TwinError):
    """A scenario has nothing that a mutant could spoil; says what it lacks."""


class Site:
    """Where a run is being built: the world is there, and a bus without nodes."""

    def __init__(self, world: World, bus: Bus, ending: ExitStack) -> None:
        self.world, self.bus = world, bus
        self._ending = ending
        self._rewritten: dict[tuple[str, str], int] = {}

    @property
    def robots(self) -> tuple[RobotHandle, ...]:
        """The robots: their hardware, and `description`, which their nodes are about to be made of."""
        return tuple(self.world.robots.values())

    def drives(self) -> Iterator[tuple[RobotHandle, DriveSpec]]:
        """Yield each robot that drives, with its drive.

        Raises:
            NotHere: None does.
        """
        found = [(robot, robot.description.drive) for robot in self.robots]
        if all(drive is None for _, drive in found):
            raise NotHere("no robot drives")
        yield from ((robot, drive) for robot, drive in found if drive is not None)

    def patch(self, owner: Any, name: str, value: Any) -> None:
        """Set an attribute of an object, class or module for as long as the run lasts."""
        before = vars(owner).get(name, _NOTHING)
        setattr(owner, name, value)
        self._ending.callback(_restore, owner, name, before)

    def rewrite(self, topic: str, change: Callable[[Any], Any], *, node: str = "") -> None:
        """Change what is published on a topic, before anybody has it.

        Args:
            topic: Its name without the robot's namespace: `scan`.
            change: Is given each message, which it leaves as it is, and returns another one instead, the same
                one, or None: nothing is published then.
            node: Name of the only node whose messages are changed; empty: everybody's.
        """
        then = self.bus.announced
        self._rewritten.setdefault((node, topic), 0)

        def announced(endpoint: Endpoint) -> None:
            if then is not None:
                then(endpoint)
            if not isinstance(endpoint, Publisher) or node not in ("", endpoint.node.name):
                return
            if endpoint.name.endswith(f"/{topic}"):
                self._rewritten[node, topic] += 1
                self.patch(endpoint, "publish", _changed(endpoint.publish, change))

        self.bus.announced = announced

    def check(self) -> None:
        """Look whether all that was to be rewritten is there, when all nodes are.

        Raises:
            NotHere: Nobody publishes a topic.
        """
        for (node, topic), count in self._rewritten.items():
            if not count:
                raise NotHere(f"{f'no node {node}' if node else 'nobody'} publishes {topic}")


class Mutant:
    """A known-bad stack. The first sentence of its docstring says what is wrong with it.

    Each method may spoil something, and raises `NotHere` if the scenario lacks what it would spoil.
    """

    def edit(self, data: dict[str, Any]) -> None:
        """Change the scenario, as plain data, in place."""

    def install(self, site: Site) -> None:
        """Spoil what nodes are made of, messages, or the code of nodes, before there are any."""

    def adjust(self, run: Run) -> None:
        """Spoil what was built, before the first tick."""

    @classmethod
    def says(cls) -> str:
        """Return what is wrong."""
        return " ".join((cls.__doc__ or "").partition("\n\n")[0].split())


_NOTHING = object()


def _restore(owner: Any, name: str, before: Any) -> None:
    if before is _NOTHING:
        delattr(owner, name)
    else:
        setattr(owner, name, before)


def _changed(publish: Callable[..., None], change: Callable[[Any], Any]) -> Callable[..., None]:
    def published(message: Any, *, frozen: bool = False) -> None:
        changed = change(message)
        if changed is not None:
            publish(changed, frozen=frozen)

    return published
