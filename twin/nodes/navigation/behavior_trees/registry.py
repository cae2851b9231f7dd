"""Every type of node that a navigator's tree may have, by its name in the XML."""

from __future__ import annotations

from collections.abc import Mapping

from twin.navigation.behavior_trees.factory import BASIC_NODES, Registry
from twin.navigation.behavior_trees.node import TreeNode
from twin.navigation.behavior_trees.ports import Port
from twin.navigation.plugins import checked
from twin.nodes.navigation.behavior_trees import (
    actions,
    conditions,
    decorators,
    goals,
    paths,
    services,
    state_conditions,
)
from twin.nodes.navigation.behavior_trees.cancelling import CANCEL_NODES
from twin.nodes.navigation.behavior_trees.selectors import SELECTORS
from twin.plugins import Plugin

_CLASSES: tuple[type[TreeNode], ...] = (
    actions.ComputePathToPose,
    actions.ComputePathThroughPoses,
    actions.SmoothPath,
    actions.FollowPath,
    actions.Spin,
    actions.BackUp,
    actions.DriveOnHeading,
    actions.Wait,
    actions.AssistedTeleop,
    actions.NavigateToPose,
    actions.NavigateThroughPoses,
    actions.DockRobot,
    actions.UndockRobot,
    services.ClearEntireCostmap,
    services.ClearCostmapExceptRegion,
    services.ClearCostmapAroundRobot,
    services.ClearCostmapAroundPose,
    services.IsPathValid,
    services.ReinitializeGlobalLocalization,
    services.ToggleCollisionMonitor,
    goals.RemovePassedGoals,
    goals.RemoveInCollisionGoals,
    goals.GetNextFewGoals,
    goals.AppendGoalPoseToGoals,
    paths.TruncatePath,
    paths.TruncatePathLocal,
    paths.ConcatenatePaths,
    paths.GetPoseFromPath,
    paths.GetCurrentPose,
    conditions.AreErrorCodesPresent,
    conditions.WouldAControllerRecoveryHelp,
    conditions.WouldAPlannerRecoveryHelp,
    conditions.WouldASmootherRecoveryHelp,
    conditions.GoalUpdated,
    conditions.GlobalUpdatedGoal,
    conditions.GoalReached,
    conditions.ArePosesNear,
    conditions.DistanceTraveled,
    conditions.TimeExpired,
    conditions.PathExpiringTimer,
    conditions.IsGoalNearby,
    conditions.IsWithinPathTrackingBounds,
    state_conditions.InitialPoseReceived,
    state_conditions.TransformAvailable,
    state_conditions.IsBatteryLow,
    state_conditions.IsBatteryCharging,
    state_conditions.IsStuck,
    decorators.DistanceController,
    decorators.SpeedController,
    decorators.GoalUpdatedController,
    decorators.GoalUpdater,
    decorators.PathLongerOnApproach,
)
_OTHER_NAMES: dict[str, type[TreeNode]] = {
    "ValidatePath": services.IsPathValid,
    "GloballyUpdatedGoal": conditions.GlobalUpdatedGoal,
}

NAVIGATOR_NODES: Registry = {
    **BASIC_NODES,
    **{cls.__name__: cls for cls in _CLASSES},
    **CANCEL_NODES,
    **SELECTORS,
    **_OTHER_NAMES,
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
