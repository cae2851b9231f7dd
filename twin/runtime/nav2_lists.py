"""What Nav2's parameter files name in lists: docks with their types, polygons of the collision monitor."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import yaml
from pydantic import ValidationError

from twin.errors import NavigationError, Problem
from twin.geometry import Pose2
from twin.navigation.docking.docks import Dock, DockDatabase, DockType
from twin.runtime.nav2_file import Nav2Parameters
from twin.scenario.collision_monitor import CollisionMonitorParameters, MonitorPolygonConfig

_CIRCLE_CORNERS = 16


def database_of(file: Nav2Parameters, own: DockDatabase) -> DockDatabase:
    """Return a database with the file's docks and types beside those that the scenario has.

    The types have Nav2's defaults yet: `Nav2Parameters.applied` puts the file's values in.
    """
    values = file.values("docking_server")
    types = {
        name: _dock_type(str(values.get(f"{name}.plugin", "")))
        for name in values.get("dock_plugins") or []
        if name not in own.types
    }
    docks = {}
    for name in values.get("docks") or []:
        pose = values.get(f"{name}.pose")
        if not (isinstance(pose, list) and len(pose) == 3):
            file.wrong("docking_server", f"{name}.pose", "must be a list: x, y and yaw")
            continue
        frame, type_ = str(values.get(f"{name}.frame", "map")), str(values.get(f"{name}.type", ""))
        if type_ not in (*types, *own.types):
            file.wrong("docking_server", f"{name}.type", f"must be one of {', '.join((*types, *own.types))}")
        docks[name] = Dock(type=type_, frame=frame, pose=Pose2(*map(float, pose)))
    return DockDatabase(types={**types, **own.types}, docks={**docks, **own.docks})


def _dock_type(plugin: str) -> DockType:
    """Return a type of docks with Nav2's defaults; without a detector's topic the map alone counts."""
    charges = plugin.rpartition("::")[2] == "SimpleChargingDock"
    return DockType(
        is_charger=charges,
        detection="none",
        external_detection_translation_x=-0.2,
        staging_x_offset=-0.7,
        use_battery_status=charges,
    )


def monitor_of(file: Nav2Parameters) -> CollisionMonitorParameters | None:
    """Return the file's collision monitor; None if it has none.

    Raises:
        NavigationError: a polygon that cannot be.
    """
    values = file.values("collision_monitor")
    if not values.get("polygons"):
        return None
    try:
        names = [name for name in values["polygons"] if values.get(f"{name}.enabled", True)]
        polygons = tuple(_polygon(name, values) for name in names)
        timeout = values.get("source_timeout", 2.0)
        return CollisionMonitorParameters(polygons=polygons, source_timeout=timeout)
    except (ValidationError, yaml.YAMLError, TypeError) as error:
        said = error.errors()[0]["msg"] if isinstance(error, ValidationError) else str(error)
        raise NavigationError([Problem(f"collision_monitor: {said}", file.path)]) from error


def _polygon(name: str, values: Mapping[str, Any]) -> MonitorPolygonConfig:
    inside = {key.removeprefix(f"{name}."): v for key, v in values.items() if key.startswith(f"{name}.")}
    given = {key: inside[key] for key in MonitorPolygonConfig.model_fields if key in inside}
    points = inside.get("points", [])
    points = yaml.safe_load(points) if isinstance(points, str) else points
    if points and not isinstance(points[0], list | tuple):  # Nav2 until Iron: x, y, x, y, …
        points = list(zip(points[::2], points[1::2], strict=True))
    if inside.get("type") == "circle":
        points = _circle(float(inside.get("radius", 0.0)))
    if "max_points" in inside:
        given["min_points"] = inside["max_points"] + 1
    return MonitorPolygonConfig.model_validate({**given, "name": name, "points": points})


def _circle(radius: float) -> list[tuple[float, float]]:
    """Return a polygon around a circle [m]."""
    reach = radius / math.cos(math.pi / _CIRCLE_CORNERS)
    angles = [2.0 * math.pi * i / _CIRCLE_CORNERS for i in range(_CIRCLE_CORNERS)]
    return [(reach * math.cos(angle), reach * math.sin(angle)) for angle in angles]
