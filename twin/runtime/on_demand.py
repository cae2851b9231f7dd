"""Truths about robots that cost something, so that they are computed only for checks that ask for them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any

from twin.runtime.stacks.robot import RobotStack
from twin.sim.world import World

Read = Callable[[str], Any]
"""Returns the value of a robot, now."""


def _work(world: World, stacks: Sequence[RobotStack]) -> Read:
    world.measure_work()
    return world.work


def _clearance(world: World, stacks: Sequence[RobotStack]) -> Read:
    from twin.sim.clearance import ClearanceMeter

    return ClearanceMeter(world).clearance


def _slip(world: World, stacks: Sequence[RobotStack]) -> Read:
    from twin.sim.slip import SlipMeter

    return SlipMeter(world).slip


ON_DEMAND: Mapping[str, Callable[[World, Sequence[RobotStack]], Read]] = MappingProxyType(
    {"work_J": _work, "clearance": _clearance, "slip": _slip}
)
"""By the field of `RobotObservation`: what makes its reader at the start of a run."""
