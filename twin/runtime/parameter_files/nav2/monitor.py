"""The collision monitor of Nav2's parameter files."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from twin.navigation.control.collision_monitor_config import (
    CollisionMonitorConfig,
    MonitorCloud,
    MonitorPolygon,
)
from twin.parameters.declaration import fields_of, names_of
from twin.runtime.parameter_files.nav2.file import Nav2Parameters
from twin.runtime.parameter_files.nav2.names import corners_of
from twin.scenario.collision_monitor import (
    CollisionMonitorParameters,
    MonitorCloudParameters,
    MonitorPolygonParameters,
)

_NODE = "collision_monitor"
_CIRCLE_CORNERS = 16
_NAMES = names_of(CollisionMonitorConfig)
_SERVER = (_NAMES.polygons, "observation_sources", _NAMES.source_timeout_ns)
_POLYGON = (*MonitorPolygonParameters.model_fields, "type", "radius", "max_points")
_SENSOR = ("type", "topic", "enabled")
_SENSORS = ("scan", "range", "pointcloud")
"""Types of sources that are here."""


def monitor_of(file: Nav2Parameters) -> CollisionMonitorParameters | None:
    """Return the file's collision monitor; None if it has none. Faults are noted in `file`."""
    values = file.values(_NODE)
    names = values.get("polygons")
    if not isinstance(names, list) or not names:
        return None
    file.others(_NODE, tuple(_read(values)))
    active = [name for name in names if values.get(f"{name}.enabled", True)]
    fitting = [name for name in active if values.get(f"{name}.type") != "velocity_polygon"]
    polygons = tuple(found for name in fitting if (found := _polygon(name, file, values)))
    server = _taken(CollisionMonitorConfig, "", {_NAMES.source_timeout_ns: 2.0, **values}, file)
    if server is None:
        return None
    return CollisionMonitorParameters(
        **server,
        # A file of other polygons alone leaves the robot its usual guard.
        polygons=polygons if fitting or not active else None,
        scan_topics=_topics(file, values, "scan") or None,
        range_topics=_topics(file, values, "range"),
        clouds=tuple(_clouds(file, values)),
    )


def _taken(
    config: type, section: str, said: Mapping[str, Any], file: Nav2Parameters
) -> dict[str, Any] | None:
    """Return what is said of a config's parameters; None, and noted in `file`, if one cannot be."""
    taken = {}
    for one in fields_of(config).values():
        try:
            if one.domain is not None and one.name in said:
                taken[one.name] = one.domain.checked(said[one.name])
            elif one.is_required:
                raise ValueError("is missing")
        except ValueError as error:
            file.wrong(_NODE, section + one.name, str(error))
            return None
    return taken


def _read(values: Mapping[str, Any]) -> Iterator[str]:
    """Yield the names that are understood, and those in sections that no list names: Nav2 reads none."""
    yield from _SERVER
    polygons, sensors = values["polygons"], values.get("observation_sources") or ()
    yield from (
        name for name in values if "." in name and name.partition(".")[0] not in {*polygons, *sensors}
    )
    for name in polygons:
        if values.get(f"{name}.type") != "velocity_polygon":
            yield from (f"{name}.{key}" for key in _POLYGON)
    for name in sensors:
        if values.get(f"{name}.type", "scan") in _SENSORS:
            yield from (f"{name}.{key}" for key in _SENSOR)
        if values.get(f"{name}.type") == "pointcloud":
            yield from (f"{name}.{one.name}" for one in fields_of(MonitorCloud).values())


def _topics(file: Nav2Parameters, values: Mapping[str, Any], type_: str) -> tuple[str, ...]:
    return tuple(
        file.relative(str(values.get(f"{name}.topic", "scan")))
        for name in values.get("observation_sources") or ()
        if values.get(f"{name}.type", "scan") == type_ and values.get(f"{name}.enabled", True)
    )


def _clouds(file: Nav2Parameters, values: Mapping[str, Any]) -> Iterator[MonitorCloudParameters]:
    for name in values.get("observation_sources") or ():
        if values.get(f"{name}.type") != "pointcloud" or not values.get(f"{name}.enabled", True):
            continue
        inside = {key.removeprefix(f"{name}."): v for key, v in values.items() if key.startswith(f"{name}.")}
        given = _taken(MonitorCloud, f"{name}.", {"topic": "scan", **inside}, file)
        if given is None:
            continue
        try:
            yield MonitorCloudParameters.model_validate(given | {"topic": file.relative(given["topic"])})
        except ValueError:
            file.wrong(_NODE, name, "has a min_height above its max_height")


def _polygon(name: str, file: Nav2Parameters, values: Mapping[str, Any]) -> MonitorPolygonParameters | None:
    inside = {key.removeprefix(f"{name}."): v for key, v in values.items() if key.startswith(f"{name}.")}
    for key in ("radius", "max_points"):
        if key in inside and type(inside[key]) not in (int, float):
            file.wrong(_NODE, f"{name}.{key}", f"must be a number, not {inside[key]!r}")
            return None
    if inside.get("type") == "circle" and "radius" not in inside:
        file.wrong(_NODE, f"{name}.type", "is circle, which needs a radius")
        return None
    points = _points(inside)
    if points is None:
        file.wrong(_NODE, f"{name}.points", f"must be corners '[[x, y], ...]', not {inside['points']!r}")
        return None
    inside |= {"name": name, "points": points}
    if "max_points" in inside:
        inside[names_of(MonitorPolygon).min_points] = inside["max_points"] + 1
    given = _taken(MonitorPolygon, f"{name}.", inside, file)
    if given is None:
        return None
    try:
        MonitorPolygon(**given)
    except ValueError as error:
        file.wrong(_NODE, name, str(error))
        return None
    return MonitorPolygonParameters.model_validate(given)


def _points(inside: Mapping[str, Any]) -> Sequence[Sequence[float]] | None:
    """Return the corners of a polygon, none: the robot's footprint; None if they are no corners."""
    if inside.get("type") == "circle":
        return _circle(float(inside["radius"]))
    points = inside.get("points", "")
    if isinstance(points, list):  # Nav2 until Iron: x, y, x, y, …
        return list(zip(points[::2], points[1::2], strict=True)) if len(points) % 2 == 0 else None
    return corners_of(str(points))


def _circle(radius: float) -> list[tuple[float, float]]:
    """Return a polygon around a circle [m]."""
    reach = radius / math.cos(math.pi / _CIRCLE_CORNERS)
    angles = [2.0 * math.pi * i / _CIRCLE_CORNERS for i in range(_CIRCLE_CORNERS)]
    return [(reach * math.cos(angle), reach * math.sin(angle)) for angle in angles]
