"""What Nav2's parameter files call things, and what the nodes here call them."""

from __future__ import annotations

import math
import re
from typing import Any, NamedTuple

import yaml

from twin.controllers.limiter import AxisLimits
from twin.navigation.costmaps.costmap_config import CostmapConfig
from twin.parameters.declaration import fields_of, names_of
from twin.parameters.placed import parameters_of
from twin.plugins import Kind

PLANNERS = {
    "NavfnPlanner": "grid_based",
    "SmacPlanner2D": "grid_based",
    "ThetaStarPlanner": "theta_star",
    "SmacPlannerHybrid": "smac_hybrid",
}
"""Nav2's plugin -> the scenario's name of what does the same here."""
LISTS = ("plugins", "plugin", "docks")
"""What these name has sections of its own."""
_DOCKS = ("SimpleChargingDock", "SimpleNonChargingDock")
_LAYERS = ("static_layer", "obstacle_layer", "voxel_layer", "inflation_layer", "stvl_layer", "range_layer")
"""Sections of layers whose plugin the file does not tell."""
_OWN_SECTIONS = ("range_sensor_layer.", "voxel_layer.", "keepout_filter.")
"""Of a costmap here; all other layers share one set of parameters."""
_SECTION_OF = {"RangeSensorLayer": "range_sensor_layer.", "VoxelLayer": "voxel_layer."}
"""Nav2's classes of layers -> their own section here."""
_BEHAVIORS = ("spin", "backup", "drive_on_heading", "assisted_teleop", "wait")
_SECTIONS = {
    "controller_plugins": "FollowPath",
    "planner_plugins": "GridBased",
    "goal_checker_plugins": "general_goal_checker",
    "progress_checker_plugins": "progress_checker",
    "progress_checker_plugin": "progress_checker",
}
"""List of plugins -> what the section of the first one is called here. Until Iron the last was one name."""


class Value(NamedTuple):
    """A parameter's value and where it comes from."""

    value: Any
    said: str
    """Its name in the file."""
    line: int | None
    is_general: bool
    """Whether it is for whichever node has it, as what is under a pattern is."""


def renamed(values: dict[str, Value]) -> dict[str, Value]:
    """Give the sections of the first plugins the names that they have here."""
    new_names = {
        f"{first}.": f"{name}."
        for key, name in _SECTIONS.items()
        if key in values and (first := _first(values[key].value))
    }

    def here(name: str) -> str:
        for old, new in new_names.items():
            if name.startswith(old):
                return new + name.removeprefix(old)
        return name

    return {here(name): entry for name, entry in values.items()}


def declared(values: dict[str, Value], config: Any, prefix: str) -> dict[str, Value]:
    """Return values by the names that a config's parameters have here, as they are written here."""
    out = dict(values)
    for name, one in parameters_of(config).items():
        section = prefix + name.removesuffix(one.declaration.name)
        for way in one.declaration.nav2:
            entry = out.pop(section + (way.name or one.declaration.name), None)
            if entry is not None:
                out[prefix + name] = entry._replace(value=way.read(entry.value))
    return out


def by_axis(values: dict[str, Value]) -> dict[str, Value]:
    """Return the smoother's parameters with its lists [x, y, yaw] taken apart, as they are declared here."""
    out = dict(values)
    for declaration in fields_of(AxisLimits).values():
        said = declaration.nav2[0].name if declaration.nav2 else declaration.name
        entry = out.get(said)
        if entry is None or not _is_triple(entry.value):
            continue
        x, _, yaw = out.pop(said).value
        out[f"linear.{declaration.name}"] = entry._replace(value=abs(x))
        out[f"angular.{declaration.name}"] = entry._replace(value=abs(yaw))
    return out


def converted(values: dict[str, Value]) -> dict[str, Value]:
    """Return values that Nav2 writes otherwise as they are declared here."""
    out = dict(values)
    footprint = out.get("footprint")
    if footprint is not None and isinstance(footprint.value, str):
        corners = corners_of(footprint.value)
        if corners == []:
            del out["footprint"]  # Nav2's default: the circle
        elif corners is not None:
            out["footprint"] = footprint._replace(value=corners)
            out.pop(names_of(CostmapConfig).robot_radius, None)  # as in Nav2, where the polygon goes first
    for name, entry in out.items():
        if name.endswith(".critics") and isinstance(entry.value, list):  # a user's has its class's name
            out[name] = entry._replace(value=[str(critic).rpartition(":")[2] for critic in entry.value])
    return out


def corners_of(text: str) -> list[list[float]] | None:
    """Return the corners that '[[x, y], ...]' tells [m], [] for none; None if it is something else."""
    try:
        corners = yaml.safe_load(text or "[]")
    except yaml.YAMLError:
        return None
    if corners == []:
        return []
    if not (isinstance(corners, list) and len(corners) > 2):
        return None
    if not all(isinstance(corner, list) and len(corner) == 2 for corner in corners):
        return None
    if not all(type(part) in (int, float) and math.isfinite(part) for corner in corners for part in corner):
        return None
    return [[float(part) for part in corner] for corner in corners]


def is_users(kind: Kind[Any], plugin: str) -> bool:
    """Whether a plugin is a user's: `module:Class`, or an entry point's name."""
    return ":" in plugin.replace("::", "") or (plugin in kind.names() and plugin not in kind.shipped)


def _is_triple(value: object) -> bool:
    return isinstance(value, list) and len(value) == 3 and all(type(v) in (int, float) for v in value)


def flat(values: dict[str, Value], known: tuple[str, ...]) -> dict[str, Value]:
    """Give layers' and behaviours' parameters the names that they have here, where most share one set."""
    plugins = {
        name.removesuffix(".plugin"): class_of(entry.value)
        for name, entry in values.items()
        if name.endswith(".plugin") and class_of(entry.value).endswith("Layer")
    }
    sections = {**dict.fromkeys(_LAYERS + _BEHAVIORS, ""), **plugins}

    def here(name: str) -> str:
        section, last = name.partition(".")[0], name.rpartition(".")[2]
        if section not in sections or name in known:
            return name
        own = {"range_layer": "range_sensor_layer.", "voxel_layer": "voxel_layer."}.get(section)
        own = _SECTION_OF.get(sections[section], own)
        fitting = [other for other in known if own is not None and other.startswith(own)]
        if own != "range_sensor_layer.":  # what a voxel layer shares with an obstacle layer is here once
            fitting += [other for other in known if not other.startswith(_OWN_SECTIONS)]
        return next((other for other in fitting if other.rpartition(".")[2] == last), name)

    return {here(name): entry for name, entry in values.items()}


def class_of(plugin: object) -> str:
    """Return a plugin's class without its package, which stands before '::' or, until Iron, before '/'."""
    return re.split("::|/", str(plugin))[-1]


def is_same(plugin: str, config: Any) -> bool:
    """Whether a plugin is of a config's kind, as RegulatedPurePursuitController is."""
    kind = type(config).__name__.removesuffix("Config").casefold()
    name = class_of(plugin)
    brought = getattr(config, "plugin", None)
    if brought is not None:
        return bool(brought.name == plugin)
    if kind == "docktype":
        return name in _DOCKS
    same = PLANNERS.get(name, "").replace("_", "").replace("smac", "")
    return kind in name.casefold() or kind in ("planner", same)


def _first(plugins: object) -> str:
    """Return the first of a list of plugins, or the only one."""
    if isinstance(plugins, list) and plugins:
        return str(plugins[0])
    return plugins if isinstance(plugins, str) else ""
