"""What robots carry: goods in a gripper, or on a deck, can hit something as a robot's own links can."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from twin.geometry import Array
from twin.scenario.observation import ContactObservation
from twin.sim.contacts import Touch
from twin.sim.world import World

_OPPOSED = -0.5
"""Cosine of the angle between two pushes of a robot from which on they squeeze a good."""
_BORNE = 0.5
"""Share of its weight by which a good that rests on a robot is carried by it."""
_UPWARDS = 0.7
"""Of a push: what lies under a good supports it."""
_DRAGGED = 0.02
"""A good that is still on its support, so far from where it was taken hold of or set down, is dragged [m]."""
_LIFTED = 0.002
"""A good that has risen so far is off its support [m]."""


class Payload:
    """Finds what the goods touch that a robot holds; the truth, for checks.

    A robot holds a good that its links squeeze from opposite sides, or that rests on it. While a good is
    taken hold of, lifted off or set down it may stand on something, unless it is dragged along, or pressed
    down harder than it is squeezed: a stiff arm that yields by a millimetre already puts its weight on it.
    """

    def __init__(self, world: World, goods: Iterable[str]) -> None:
        self._world = world
        self._weights = {good: world.weight(good) for good in goods}
        self._stood_at: dict[str, Array] = {}
        """Where held goods that stand on something began to [m]."""

    def contacts(self) -> list[ContactObservation]:
        """Return what held goods touch, other than who holds them and what they stand on.

        To be called at every control tick.
        """
        near = {
            (contact.body2, contact.body1.partition("/")[0])
            for contact in self._world.contacts()
            if contact.body2 in self._weights
        }
        stood_at, self._stood_at = self._stood_at, {}
        return [
            ContactObservation(robot=robot, body=good, other=other, force_N=force, carried=True)
            for good, robot in sorted(near)
            for other, force in self._hit(good, f"{robot}/", stood_at.get(good)).items()
        ]

    def _hit(self, good: str, robot: str, stood_at: Array | None) -> dict[str, float]:
        """Return the forces [N] of what a good hits if the robot whose links begin with `robot` holds it."""
        weight, here = self._weights[good], self._world.pose(good).xyz
        own: list[Touch] = []
        below: list[Touch] = []
        hit: list[Touch] = []
        for touch in self._world.touches(good):
            if touch.other.startswith(robot):
                own.append(touch)
            else:
                (below if touch.push[2] >= _UPWARDS * _force([touch]) else hit).append(touch)
        if not _is_held(own, weight):
            return {}
        if below and stood_at is None:
            stood_at = here
        if stood_at is not None and here[2] <= stood_at[2] + _LIFTED:
            self._stood_at[good] = stood_at
            dragged = math.dist(here[:2], stood_at[:2]) > _DRAGGED
            if dragged or _force(below) > weight + max(weight, _force(own)):
                hit += below
        return {other: _force(t for t in hit if t.other == other) for other in sorted({t.other for t in hit})}


def _is_held(pushes: Iterable[Touch], weight: float) -> bool:
    """Whether the pushes of a robot squeeze a good or bear it."""
    forces = np.array([touch.push for touch in pushes]).reshape(-1, 3)
    if forces[:, 2].sum() >= _BORNE * weight:
        return True
    sizes = np.linalg.norm(forces, axis=1)
    directions = forces[sizes > 0.0] / sizes[sizes > 0.0, None]
    return bool((directions @ directions.T < _OPPOSED).any())


def _force(touches: Iterable[Touch]) -> float:
    return math.fsum(math.hypot(*touch.push) for touch in touches)
