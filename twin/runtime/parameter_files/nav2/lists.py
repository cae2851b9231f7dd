"""What Nav2's parameter files name in lists: docks with their types, sources of costmaps."""

from __future__ import annotations

from collections.abc import Sequence

from twin.geometry import Pose2
from twin.navigation.docking.docks import Dock, DockDatabase, DockType
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


def _lasers(file: Nav2Parameters, node: str, layer: str, sources: Sequence[str]) -> list[str]:
    """Return the topics of those sources of a layer that are laser scans (Nav2's default: point clouds)."""
    values, found = file.values(node), []
    for source in sources:
        topic, type_ = (f"{layer}.{source}.{key}" for key in ("topic", "data_type"))
        if values.get(type_) == "LaserScan":
            found.append(file.relative(str(values.get(topic, source))))
            file.understood(node, f"{layer}.observation_sources", topic, type_)
    return found
