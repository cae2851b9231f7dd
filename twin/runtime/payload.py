"""What robots carry: goods in a gripper, or on a deck, can hit something as a robot's own links can."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from itertools import combinations, starmap

from twin.geometry import Array
from twin.scenario.observation import ContactObservation
from twin.sim.contacts import Touch, Vector
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

    A robot holds a good that its links squeeze from opposite sides, or that rests on it or on what it holds:
    all this is its load, whose parts may touch each other. While a good is taken hold of, lifted off or set
    down it may stand on something, unless it is dragged along, or pressed down harder than it is squeezed: a
    stiff arm that yields by a millimetre already puts its weight on it. A smooth good slips before that.
    """

    def __init__(self, world: World, goods: Iterable[str]) -> None:
        self._world = world
        self._weights = {good: world.weight(good) for good in goods}
        self._stood_at: dict[str, Array] = {}
        """Where held goods that stand on something began to [m]."""

    def contacts(self) -> list[ContactObservation]:
        """Return what held goods touch, other than who holds them, what they stand on and each other.

        To be called at every control tick.
        """
        near: dict[str, list[str]] = {}
        stood_at, self._stood_at = self._stood_at, {}
        for contact in self._world.contacts():
            good = contact.body2
            if good in self._weights:
                robot = contact.body1.partition("/")[0]
                # What nothing but the robot touches, as in the air, hits nothing.
                others = [it for it in self._world.neighbours(good) if not it.startswith(f"{robot}/")]
                if others or good in stood_at or not self._world.savings.unchanged_truth:
                    near.setdefault(robot, []).append(good)
        return [
            ContactObservation(robot=robot, body=good, other=other, force_N=force, carried=True)
            for robot in sorted(near)
            for good, (own, others) in self._load(robot, near[robot]).items()
            for other, force in self._hit(good, own, others, stood_at.get(good)).items()
        ]

    def _load(self, robot: str, goods: Iterable[str]) -> dict[str, tuple[list[Touch], list[Touch]]]:
        """Return what a robot holds, by touches of its own and of others; `goods` are those that it touches.

        What rests on its load belongs to the load.
        """
        load: dict[str, list[Touch]] = {}
        links, waiting = f"{robot}/", sorted(goods)
        while waiting:
            good = waiting.pop(0)
            if good in load:
                continue
            touches = self._world.touches(good)
            own = [push for other, push in touches if other.startswith(links) or other in load]
            if _is_held(own, self._weights[good]):
                load[good] = touches
                waiting += sorted({other for other, _ in touches if other in self._weights})
        return {
            good: _parted(touches, lambda touch: touch.other.startswith(links) or touch.other in load)
            for good, touches in load.items()
        }

    def _hit(
        self, good: str, own: list[Touch], others: list[Touch], stood_at: Array | None
    ) -> dict[str, float]:
        """Return the forces [N] of what a held good hits."""
        if not others and stood_at is None:
            return {}
        weight, here = self._weights[good], self._world.pose(good).xyz
        below, hit = _parted(others, lambda touch: touch.push[2] >= _UPWARDS * _force([touch]))
        if below and stood_at is None:
            stood_at = here
        if stood_at is not None and here[2] <= stood_at[2] + _LIFTED:
            self._stood_at[good] = stood_at
            dragged = math.dist(here[:2], stood_at[:2]) > _DRAGGED
            if dragged or _force(below) > weight + max(weight, _force(own)):
                hit += below
        return {other: _force(t for t in hit if t.other == other) for other in sorted({t.other for t in hit})}


def _parted(touches: Iterable[Touch], belongs: Callable[[Touch], bool]) -> tuple[list[Touch], list[Touch]]:
    parts: tuple[list[Touch], list[Touch]] = ([], [])
    for touch in touches:
        parts[not belongs(touch)].append(touch)
    return parts


def _is_held(pushes: list[Vector], weight: float) -> bool:
    """Whether the pushes of a robot squeeze a good or bear it."""
    if not pushes or math.fsum([push[2] for push in pushes]) >= _BORNE * weight:
        return len(pushes) > 0
    return any(starmap(_are_opposed, combinations(pushes, 2)))


def _are_opposed(one: Vector, other: Vector) -> bool:
    (a, b, c), (x, y, z) = one, other
    product = a * x + b * y + c * z
    return product < 0.0 and product < _OPPOSED * (math.hypot(a, b, c) * math.hypot(x, y, z))


def _force(touches: Iterable[Touch]) -> float:
    return math.fsum(math.hypot(*touch.push) for touch in touches)
