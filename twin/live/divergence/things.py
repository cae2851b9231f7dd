"""Where in the map things are that one lidar sees and the other does not."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from twin.geometry import Pose2
from twin.live.divergence.scans import Thing

_NEAR = 0.6
"""A thing that is so near to where one was is the same [m]."""
_FORGET_NS = 4_000_000_000
_MOST = 32
_SIGHTINGS = 15
"""So often a thing must have been seen to be one ..."""
_SHARE = 0.6
"""... and in this share of the scans since it was seen first."""
_MOTION = 0.3
"""When the robot has come so far or turned so much, a thing that moved with it is on it [m], [rad]."""
_AT_LIDAR = 0.6
"""What is nearer may be on the robot [m]."""
_STUCK = 0.1
"""It then was all the time at one place of the lidar's frame [m]."""


@dataclass(kw_only=True)
class Place:
    """A thing in the map."""

    kind: Literal["more", "less"]
    x: float
    """Latest [m]."""
    y: float
    width: float
    """The largest so far [m]."""
    first: Pose2
    """Of the lidar when it was seen first."""
    first_scan: int
    latest_ns: int
    sightings: int
    start: tuple[float, float]
    """In the lidar's frame, when it was seen first [m]."""
    latest: tuple[float, float]
    """Likewise, when it was seen last [m]."""
    strayed: float = 0.0
    """In the lidar's frame [m]."""
    is_known: bool = False
    """Whether it can be told from something on the lidar: it is not at it, or the robot has moved."""
    is_carried: bool = False
    """Whether it moves with the robot: it is on the lidar."""


class Places:
    """Remembers at most `_MOST` things."""

    def __init__(self) -> None:
        """Know of none."""
        self._places: list[Place] = []
        self._scans = 0

    def take(self, stamp_ns: int, lidar: Pose2, things: tuple[Thing, ...]) -> None:
        """Take what a scan from a place of the map shows."""
        self._scans += 1
        self._places = [place for place in self._places if 0 <= stamp_ns - place.latest_ns < _FORGET_NS]
        taken: set[int] = set()
        for thing in things:
            there = lidar @ Pose2(thing.x, thing.y, 0.0)
            same = [place for place in self._places if place.kind == thing.kind and id(place) not in taken]
            nearest = min(same, key=lambda place: _apart(place, there, thing), default=None)
            if nearest is None or _apart(nearest, there, thing) > _NEAR + thing.width / 2:
                nearest = Place(
                    kind=thing.kind,
                    x=there.x,
                    y=there.y,
                    width=thing.width,
                    first=lidar,
                    first_scan=self._scans,
                    latest_ns=stamp_ns,
                    sightings=0,
                    start=(thing.x, thing.y),
                    latest=(thing.x, thing.y),
                )
                self._places.append(nearest)
            taken.add(id(nearest))
            self._see(nearest, there, thing, lidar, stamp_ns)
        if len(self._places) > _MOST:
            self._places = sorted(self._places, key=lambda place: -place.sightings)[:_MOST]

    def found(self, kind: Literal["more", "less"]) -> Place | None:
        """Return the thing that was seen most often; None: nothing was seen often enough."""
        sure = [
            place
            for place in self._places
            if place.kind == kind
            and place.is_known
            and place.sightings >= max(_SIGHTINGS, _SHARE * (self._scans - place.first_scan))
        ]
        return max(sure, key=lambda place: (place.is_carried, place.sightings), default=None)

    def _see(self, place: Place, there: Pose2, thing: Thing, lidar: Pose2, stamp_ns: int) -> None:
        place.x, place.y, place.latest_ns = there.x, there.y, stamp_ns
        place.sightings += 1
        place.latest = thing.x, thing.y
        place.width = max(place.width, thing.width)
        place.strayed = max(place.strayed, math.dist(place.start, (thing.x, thing.y)))
        moved = place.first.inverse() @ lidar
        has_moved = max(math.hypot(moved.x, moved.y), abs(moved.yaw)) > _MOTION
        place.is_known = has_moved or math.hypot(*place.start) > _AT_LIDAR
        if has_moved:
            place.is_carried = place.strayed < _STUCK


def _apart(place: Place, there: Pose2, thing: Thing) -> float:
    """Return how far a thing is from where it would be if it stood still, or moved with the lidar [m]."""
    in_map = math.hypot(place.x - there.x, place.y - there.y)
    return min(in_map, math.dist(place.latest, (thing.x, thing.y)))
