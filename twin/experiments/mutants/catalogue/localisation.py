"""Maps and estimates of the pose that are wrong."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from twin.experiments.mutants.mutant import Mutant, NotHere, Site


class FrozenLocalisation(Mutant):
    """After 5 s the localisation says no more where odom is in map."""

    def install(self, site: Site) -> None:
        """Keep what it said."""
        kept: list[Any] = []

        def frozen(message: Any) -> Any:
            if site.bus.clock.now_ns < 5_000_000_000 or not kept:
                kept[:] = [message]
            pairs = zip(message.transforms, kept[0].transforms, strict=True)
            return replace(message, transforms=[replace(new, transform=old.transform) for new, old in pairs])

        site.rewrite("tf", frozen, node="amcl")


class NoLocalisation(Mutant):
    """Nobody corrects odometry: the robot goes by dead reckoning from its first guess."""

    def edit(self, data: dict[str, Any]) -> None:
        """Take the filter away."""
        for robot in _localised(data):
            error = robot["localisation"].get("initial_pose_error")
            robot["localisation"] = {"type": "odometry"} | (
                {} if error is None else {"initial_pose_error": error}
            )


class WrongStart(Mutant):
    """The first guess of the pose is 4 m and 90 degrees off."""

    def edit(self, data: dict[str, Any]) -> None:
        """Change the guess."""
        for robot in _localised(data):
            robot["localisation"]["initial_pose_error"] = {"xy": "4 m", "yaw": "90 deg"}


class MapShifted(Mutant):
    """The map that is served lies 0.4 m aside."""

    def install(self, site: Site) -> None:
        """Move its origin."""

        def shifted(message: Any) -> Any:
            origin = message.info.origin
            moved = replace(origin.position, y=origin.position.y + 0.4)
            return replace(message, info=replace(message.info, origin=replace(origin, position=moved)))

        site.rewrite("map", shifted)


class MapMirrored(Mutant):
    """The rows of the map that is served are in the order of an image: top first."""

    def install(self, site: Site) -> None:
        """Turn it over."""

        def mirrored(message: Any) -> Any:
            rows = np.asarray(message.data).reshape(message.info.height, message.info.width)
            return replace(message, data=np.ascontiguousarray(rows[::-1]).ravel())

        site.rewrite("map", mirrored)


def _localised(data: dict[str, Any]) -> list[dict[str, Any]]:
    found = [robot for robot in data["robots"] if (robot.get("localisation") or {}).get("type") == "amcl"]
    if not found:
        raise NotHere("no robot localises itself on a map")
    return found
