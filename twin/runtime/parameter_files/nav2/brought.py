"""Plugins of a user in Nav2's parameter files: `module:Class`, or the name of an entry point."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from twin.errors import PluginError
from twin.navigation.costmaps.costmap_config import LAYERS as SHIPPED_LAYERS
from twin.navigation.costmaps.costmap_config import CostmapConfig
from twin.navigation.plugins import CRITICS, LAYERS, SMOOTHERS
from twin.plugins import Kind
from twin.runtime.parameter_files.nav2.file import Nav2Parameters
from twin.runtime.parameter_files.nav2.names import is_users
from twin.scenario.plugin_groups import config_of_use
from twin.scenario.plugins import PluginUse


def brought(file: Nav2Parameters, node: str, name: str, plugin: str, kind: Kind[Any]) -> PluginUse | None:
    """Return the use of a user's plugin; None: it is none, or cannot be found, which the file notes.

    Args:
        file: That names it.
        node: Of whose parameters.
        name: Of the parameter.
        plugin: Its value.
        kind: What it must be.
    """
    if not is_users(kind, plugin):
        return None
    try:
        kind.find(plugin)
    except PluginError as wrong:
        file.wrong(node, name, f"cannot be used: {wrong}")
        return None
    return PluginUse(reference=plugin)


def _configs(file: Nav2Parameters, node: str, key: str, kind: Kind[Any]) -> dict[str, Any]:
    """Return the parameters of a user's plugins by the names that a list has for them."""
    names = file.values(node).get(key)
    listed = names if isinstance(names, list) else []
    uses = {name: brought(file, node, f"{name}.plugin", file.plugin(node, name), kind) for name in listed}
    return {name: config_of_use(kind, use) for name, use in uses.items() if use is not None}


def with_smoothers(file: Nav2Parameters, smoothers: Mapping[str, Any]) -> dict[str, Any]:
    """Return smoothers with those of a user; the file's first one is the first."""
    own = _configs(file, "smoother_server", "smoother_plugins", SMOOTHERS)
    first = next(iter(file.values("smoother_server").get("smoother_plugins") or ()), None)
    return {**own, **smoothers} if first in own else {**smoothers, **own}


def with_layers(file: Nav2Parameters, node: str, config: CostmapConfig) -> CostmapConfig:
    """Return a costmap with a user's layers, each before the one that ships which it is listed before."""
    own, plugins = _configs(file, node, "plugins", LAYERS), list(config.plugins)
    before = len(plugins)
    for name in reversed(file.values(node).get("plugins") or ()):
        if name in own:
            plugins.insert(before, name)
        elif (ships := _layer(file.plugin(node, name), name)) in plugins:
            before = plugins.index(ships)
    return replace(config, plugins=tuple(plugins), own_layers={**config.own_layers, **own})


def _layer(plugin: str, name: str) -> str:
    """Return what a layer of Nav2's is called here."""
    of_class = {ships.replace("_", ""): ships for ships in SHIPPED_LAYERS} | {"voxellayer": "obstacle_layer"}
    return of_class.get(plugin.casefold(), name)


def with_critics(file: Nav2Parameters, section: str, controller: Any) -> Any:
    """Return a controller's parameters with those of a user's critics; the file's list has their names."""
    primary = getattr(controller, "primary_controller", None)
    if primary is not None:
        return replace(controller, primary_controller=with_critics(file, section, primary))
    name, node = f"{section}.critics", "controller_server"
    listed = file.effective(node).get(name)
    if not hasattr(controller, "own_critics") or not isinstance(listed, list):
        return controller
    uses = [brought(file, node, name, str(critic), CRITICS) for critic in listed]
    own = {use.reference.rpartition(":")[2]: config_of_use(CRITICS, use) for use in uses if use is not None}
    return replace(controller, own_critics={**controller.own_critics, **own})
