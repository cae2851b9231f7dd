"""The state of the physics, as run and workers share it."""

from __future__ import annotations

import mmap
from typing import TYPE_CHECKING

import numpy as np

from twin.geometry import Array

if TYPE_CHECKING:
    from twin.sim.world import World


class SharedState:
    """What nodes and lidars read of the physics, in memory that run and workers share."""

    def __init__(self, world: World) -> None:
        self._ends = np.cumsum([len(part) for part in self._parts(world)])
        memory = mmap.mmap(-1, 8 * int(self._ends[-1]))
        self._numbers = np.frombuffer(memory, count=int(self._ends[-1]))

    def tell(self, world: World) -> None:
        """Write the state of the run's world."""
        np.concatenate(self._parts(world), out=self._numbers)

    def take(self, world: World, step_count: int) -> None:
        """Read it into a worker's, after so many physics steps."""
        qpos, qvel, effort, *placed = np.split(self._numbers, self._ends[:-1])
        world.go_to(step_count, qpos, qvel, effort, np.concatenate(placed))

    @staticmethod
    def _parts(world: World) -> list[Array]:
        data = world.data
        return [data.qpos, data.qvel, data.qfrc_actuator, data.mocap_pos.ravel(), data.mocap_quat.ravel()]
