"""What Nav2's parameter files name in lists: docks with their types, sources of costmaps."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from twin.geometry import Pose2
from twin.navigation.costmaps.observation import ObservationSource
from twin.navigation.docking.docks import Dock, DockDatabase, DockType
from twin.parameters.declaration import fields_of
from twin.runtime.parameter_files.nav2.file import Nav2Parameters
from twin.runtime.parameter_files.nav2.names import class_of


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


def sources_of(file: Nav2Parameters, node: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the topics of scans and of ranges that a costmap's layers take; empty if the file tells none."""
    values = file.values(node)
    scans, ranges = list[str](), list[str]()
    for name, value in values.items():
        layer, _, last = name.rpartition(".")
        if values.get(f"{layer}.enabled") is False or layer not in values.get("plugins", layer):
            continue
        if last == "observation_sources":
            found = _lasers(file, node, layer, value.split() if isinstance(value, str) else value)
            scans += [topic for topic in found if topic not in scans]
        elif last == "topics" and class_of(values.get(f"{layer}.plugin", "")) == "RangeSensorLayer":
            file.understood(node, name)
            ranges += [file.relative(str(topic)) for topic in value]
    return tuple(scans), tuple(ranges)


def clouds_of(file: Nav2Parameters, node: str) -> tuple[ObservationSource, ...]:
    """Return the point clouds that a costmap's layers take. Faults are noted in `file`.

    Nav2's laser scans of a voxel layer are among `sources_of`: here the obstacle layer takes them, beside it.
    """
    values, found = file.values(node), list[ObservationSource]()
    for name, listed in values.items():
        layer, _, last = name.rpartition(".")
        is_used = values.get(f"{layer}.enabled") is not False and layer in values.get("plugins", layer)
        if last != "observation_sources" or not is_used:
            continue
        for source in listed.split() if isinstance(listed, str) else listed:
            if values.get(f"{layer}.{source}.data_type", "PointCloud2") == "PointCloud2":
                file.understood(node, name)
                found += _cloud(file, node, layer, source)
    return tuple(found)


def _cloud(file: Nav2Parameters, node: str, layer: str, source: str) -> list[ObservationSource]:
    """Return a source of clouds; [] if it cannot be one."""
    values, section = file.values(node), f"{layer}.{source}."
    is_voxel = class_of(values.get(f"{layer}.plugin", layer)).casefold() in ("voxellayer", "voxel_layer")
    taken: dict[str, Any] = {"layer": "voxel_layer" if is_voxel else "obstacle_layer"}
    for one in fields_of(ObservationSource).values():
        name = section + one.name
        if one.name == "layer" or one.domain is None or name not in values:
            continue
        file.understood(node, name)
        try:
            taken[one.field] = one.read(values[name])
        except ValueError as error:
            file.wrong(node, name, str(error))
            return []
    taken["topic"] = file.relative(str(taken.get("topic", source)))
    for bound, of_both in (("min", max), ("max", min)):  # the layer has limits, too
        name = f"{bound}_obstacle_height"
        if isinstance(own := values.get(f"{layer}.{name}"), int | float):
            file.understood(node, f"{layer}.{name}")
            taken[name] = of_both(float(own), taken.get(name, float(own)))
    try:
        return [ObservationSource(**taken)]
    except ValueError as error:
        file.wrong(node, f"{layer}.{source}", str(error))
        return []


def _lasers(file: Nav2Parameters, node: str, layer: str, sources: Sequence[str]) -> list[str]:
    """Return the topics of those sources of a layer that are laser scans (Nav2's default: point clouds)."""
    values, found = file.values(node), []
    for source in sources:
        topic, type_ = f"{layer}.{source}.topic", f"{layer}.{source}.data_type"
        if values.get(type_) == "LaserScan":
            found.append(file.relative(str(values.get(topic, source))))
            file.understood(node, f"{layer}.observation_sources", topic, type_)
    return found
