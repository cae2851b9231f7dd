"""Maps and estimates of the pose that are wrong."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from twin.experiments.mutants.catalogue import edits, installs, rewrites
from twin.experiments.mutants.catalogue.drive import with_transforms
from twin.experiments.mutants.mutant import NotHere, Site


@installs
def frozen_localisation(site: Site) -> None:
    """After 5 s the localisation says no more where odom is in map."""
    kept: list[Any] = []

    def frozen(message: Any) -> Any:
        if site.bus.clock.now_ns < 5_000_000_000 or not kept:
            kept[:] = [message]
        return with_transforms(message, kept[0])

    site.rewrite("tf", frozen, node="amcl")


@edits
def no_localisation(data: dict[str, Any]) -> None:
    """Nobody corrects odometry: the robot goes by dead reckoning from its first guess."""
    for robot in _localised(data):
        error = robot["localisation"].get("initial_pose_error")
        robot["localisation"] = {"type": "odometry"} | (
            {} if error is None else {"initial_pose_error": error}
        )


@edits
def wrong_start(data: dict[str, Any]) -> None:
    """The first guess of the pose is 4 m and 90 degrees off."""
    for robot in _localised(data):
        robot["localisation"]["initial_pose_error"] = {"xy": "4 m", "yaw": "90 deg"}


@rewrites("map")
def map_shifted(message: Any) -> Any:
    """The map that is served lies 0.4 m aside."""
    origin = message.info.origin
    moved = replace(origin.position, y=origin.position.y + 0.4)
    return replace(message, info=replace(message.info, origin=replace(origin, position=moved)))


@rewrites("map")
def map_mirrored(message: Any) -> Any:
    """The rows of the map that is served are in the order of an image: top first."""
    rows = np.asarray(message.data).reshape(message.info.height, message.info.width)
    return replace(message, data=np.ascontiguousarray(rows[::-1]).ravel())


def _localised(data: dict[str, Any]) -> list[dict[str, Any]]:
    found = [robot for robot in data["robots"] if (robot.get("localisation") or {}).get("type") == "amcl"]
    if not found:
        raise NotHere("no robot localises itself on a map")
    return found
