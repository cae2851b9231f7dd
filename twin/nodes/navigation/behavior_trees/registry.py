"""Every type of node that a navigator's tree may have, by its name in the XML."""

from __future__ import annotations

from collections.abc import Mapping

from twin.navigation.behavior_trees.factory import BASIC_NODES, Registry, nodes_of
from twin.navigation.behavior_trees.node import TreeNode
from twin.navigation.behavior_trees.ports import Port
from twin.navigation.plugins import checked
from twin.nodes.navigation.behavior_trees import actions, conditions, decorators, goals, paths, services
from twin.nodes.navigation.behavior_trees.families import CANCEL_NODES, SELECTORS
from twin.plugins import Plugin

NAVIGATOR_NODES: Registry = {
    **BASIC_NODES,
    **nodes_of(actions, services, goals, paths, conditions, decorators),
    **CANCEL_NODES,
    **SELECTORS,
    "ValidatePath": services.IsPathValid,
    "GloballyUpdatedGoal": conditions.GlobalUpdatedGoal,
}
"""BehaviorTree.CPP's nodes, and Nav2's."""


def nodes_with(plugins: Mapping[str, Plugin[TreeNode]]) -> Registry:
    """Return these, and nodes of a user by their names in the XML.

    Raises:
        PluginError: one cannot be used, or has a name that is taken.
    """
    registry = dict(NAVIGATOR_NODES)
    for name, plugin in plugins.items():
        node = checked(plugin)
        if name in registry:
            raise plugin.error(f"has the name of a node that ships; call it otherwise than {name}")
        if not all(isinstance(port, Port) for port in node.PORTS):
            raise plugin.error("has PORTS that are none; they are made by inputs(...) and outputs(...)")
        registry[name] = node
    return registry
