"""The truth about what a camera sees: which thing each pixel shows."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from twin.sim.cameras.eyes import Eyes

if TYPE_CHECKING:
    from twin.sim.cameras.camera import Camera
    from twin.sim.world import World

BACKGROUND, ROBOT = "background", "robot"
_KIND = re.compile(r"[^\d/]*[^\d/\W_]")


class Labels:
    """Things by number, and their kinds; 0 is the background, where nothing is.

    A thing is the floor, a robot, or what the scene has a name for. Its kind is its name up to the first
    digit or slash: `tote_3` is a `tote`.
    """

    def __init__(self, names: Sequence[str], robots: Collection[str]) -> None:
        """Number things by their names."""
        self.things = (BACKGROUND, *sorted(names))
        """Names."""
        kinds = [BACKGROUND, *(_kind(name, robots) for name in self.things[1:])]
        self.kinds = (BACKGROUND, *sorted({*kinds[1:]}))
        """Names."""
        self.kind_of: NDArray[np.uint16] = np.array([self.kinds.index(kind) for kind in kinds], np.uint16)
        """By the thing's number."""


class TrueEyes:
    """The same world as its cameras see, but each shape by itself: what never moves is not joined."""

    def __init__(self, world: World, cameras: Sequence[Camera]) -> None:
        """Compile the world, and open a canvas.

        Raises:
            SimulationError: Nothing can be drawn on this computer.
        """
        self.eyes = Eyes(world, world.spec_of_shapes(), cameras)
        self._world = world

    @cached_property
    def labels(self) -> Labels:
        """What the numbers mean."""
        return Labels(sorted(set(self._names)), self._world.robots)

    def things(self, camera: Camera) -> NDArray[np.uint16]:
        """Return the number of the thing that each pixel of a source shows, shape (height, width)."""
        return self._numbers[self.eyes.geoms(camera)]

    @cached_property
    def _names(self) -> list[str]:
        """Of the thing that each geom is of."""
        robots = list(self._world.robots)
        owners = zip(*self._world.geom_owners(self.eyes.model), strict=True)
        return [robots[robot] if robot >= 0 else owner for owner, robot in owners]

    @cached_property
    def _numbers(self) -> NDArray[np.uint16]:
        number = {name: i for i, name in enumerate(self.labels.things)}
        # The last is that of -1.
        return np.array([*(number[name] for name in self._names), 0], np.uint16)


def _kind(name: str, robots: Collection[str]) -> str:
    found = _KIND.match(name)
    return ROBOT if name in robots else found[0] if found else name
