"""Plugins of a user in Nav2's parameter files: `module:Class`, or the name of an entry point."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from twin.errors import PluginError
from twin.navigation.costmaps.costmap_config import CostmapConfig
from twin.navigation.plugins import CRITICS, LAYERS, SMOOTHERS
from twin.plugins import Kind
from twin.runtime.parameter_files.nav2.file import Nav2Parameters
from twin.runtime.parameter_files.nav2.names import is_users
from twin.scenario.plugin_groups import config_of_use
from twin.scenario.plugins import PluginUse

_LAYERS = {"StaticLayer": "static_layer", "ObstacleLayer": "obstacle_layer", "VoxelLayer": "voxel_layer"}
_LAYERS |= {"RangeSensorLayer": "range_sensor_layer", "InflationLayer": "inflation_layer"}
"""Classes of Nav2's layers -> what they are here."""


def brought(file: Nav2Parameters, node: str, name: str, plugin: str, kind: Kind[Any]) -> PluginUse | None:
    """Return the use of a user's plugin that a parameter names; None: it is none, or cannot be found."""
    if not is_users(kind, plugin):
        return None
    try:
        kind.find(plugin)
    except PluginError as wrong:
        file.wrong(node, name, f"cannot be used: {wrong}")
        return None
    return PluginUse(reference=plugin)


def _listed(file: Nav2Parameters, node: str, key: str, kind: Kind[Any]) -> tuple[list[str], dict[str, Any]]:
    """Return a list of plugins, and of those that are a user's the parameters."""
    names = file.values(node).get(key)
    listed = names if isinstance(names, list) else []
    uses = {name: brought(file, node, f"{name}.plugin", file.plugin(node, name), kind) for name in listed}
    return listed, {name: config_of_use(kind, use) for name, use in uses.items() if use is not None}


def with_smoothers(file: Nav2Parameters, smoothers: Mapping[str, Any]) -> dict[str, Any]:
    """Return smoothers with those of a user; the file's first one is the first."""
    listed, own = _listed(file, "smoother_server", "smoother_plugins", SMOOTHERS)
    return {**own, **smoothers} if own and listed[0] in own else {**smoothers, **own}


def with_layers(file: Nav2Parameters, node: str, config: CostmapConfig) -> CostmapConfig:
    """Return a costmap with a user's layers, each before the one that ships which it is listed before."""
    listed, own = _listed(file, node, "plugins", LAYERS)
    plugins, before = list(config.plugins), len(config.plugins)
    for name in reversed(listed):
        ships = _LAYERS.get(file.plugin(node, name), name)
        if name in own:
            plugins.insert(before, name)
        elif ships in plugins:
            before = plugins.index(ships)
    return replace(config, plugins=tuple(plugins), own_layers={**config.own_layers, **own})


def with_critics(file: Nav2Parameters, section: str, controller: Any) -> Any:
    """Return a controller's parameters with those of a user's critics; the file's list has their names."""
    if (primary := getattr(controller, "primary_controller", None)) is not None:
        return replace(controller, primary_controller=with_critics(file, section, primary))
    name, node = f"{section}.critics", "controller_server"
    listed = file.effective(node).get(name)
    if not hasattr(controller, "own_critics") or not isinstance(listed, list):
        return controller
    uses = [brought(file, node, name, str(critic), CRITICS) for critic in listed]
    own = {use.reference.rpartition(":")[2]: config_of_use(CRITICS, use) for use in uses if use is not None}
    return replace(controller, own_critics={**controller.own_critics, **own})
