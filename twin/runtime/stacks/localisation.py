"""The nodes that tell a robot where it is."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from twin.geometry import Pose2
from twin.nodes.navigation.mapping.config import SlamNodeConfig
from twin.nodes.navigation.robot_pose import RobotPose
from twin.runtime.stacks.context import StackContext
from twin.scenario.localisation import AmclLocalisation, SlamLocalisation
from twin.sim.noise import NoiseStream

if TYPE_CHECKING:
    from twin.nodes.navigation.mapping.slam_toolbox import SlamToolboxNode

_MAP_UPDATE_INTERVAL_NS = 2_000_000_000
"""Time between two maps that a robot plans on while it makes them; slam_toolbox's own is 5 s."""


def build_localisation(context: StackContext, pose: RobotPose) -> SlamToolboxNode | None:
    """Create the nodes that the scenario's `localisation` asks for; return the one that maps, if any."""
    config = context.config.localisation
    if config is None or config.type == "none":
        return None
    if config.type == "slam":
        return _slam(context, config, pose)
    guess = _initial_guess(context.start, config.initial_pose_error, context.seed, context.handle.name)
    if config.type == "odometry":
        from twin.nodes.navigation.localisation.static import StaticLocalisationNode

        StaticLocalisationNode(context.bus, pose.frames, guess, namespace=context.namespace)
        return None
    from twin.nodes.navigation.mapping.map_server import MapSaverNode, MapServerNode

    assert context.map is not None
    MapServerNode(context.bus, context.map, namespace=context.namespace)
    MapSaverNode(context.bus, namespace=context.namespace)
    _amcl(context, config, pose, guess)
    return None


def _amcl(context: StackContext, config: AmclLocalisation, pose: RobotPose, guess: Pose2) -> None:
    from twin.nodes.navigation.localisation.amcl import AmclNode, InitialPose
    from twin.runtime.parameter_files.nav2.parameters import amcl_with_file

    navigation = context.config.navigation
    file = navigation.params_file if navigation is not None else None
    error = (config.initial_pose_error.xy, config.initial_pose_error.yaw)
    parameters, not_understood = amcl_with_file(config.parameters, file, context.namespace)
    node = AmclNode(
        context.bus,
        pose,
        parameters.filter,
        None if config.initial_pose == "global" else InitialPose.from_error(guess, *error),
        seed=context.seed,
        config=parameters.node,
        namespace=context.namespace,
    )
    for sentence in not_understood:
        node.node.get_logger().warn(sentence)


def _slam(context: StackContext, config: SlamLocalisation, pose: RobotPose) -> SlamToolboxNode:
    """Create `/slam_toolbox`; its map's frame is the world's, unless the scenario gives another start."""
    from twin.nodes.navigation.mapping.slam_toolbox import SlamToolboxNode
    from twin.runtime.parameter_files.slam import slam_with_file

    node_config = SlamNodeConfig(
        mode=config.mode,
        map_file_name=config.pose_graph or "",
        map_update_interval_ns=_MAP_UPDATE_INTERVAL_NS,
    )
    node_config = config.parameters.over(node_config)
    node_config, in_map, told = slam_with_file(node_config, context.config, pose.frames, context.namespace)
    start = config.map_start_pose.pose if config.map_start_pose else in_map or context.start
    guess = _initial_guess(start, config.initial_pose_error, context.seed, context.handle.name)
    node_config = replace(node_config, map_start_pose=(guess.x, guess.y, guess.yaw))
    node = SlamToolboxNode(context.bus, pose, node_config, namespace=context.namespace)
    for sentence in told:
        node.node.get_logger().warn(sentence)
    return node


def _initial_guess(start: Pose2, error: Any, seed: int, name: str) -> Pose2:
    """Return the start as a person would click it: off by `error` in a direction drawn from the seed."""
    draw = NoiseStream(seed, f"{name}/initial_pose").uniform(0, 2)
    direction = 2.0 * math.pi * float(draw[0])
    sign = 1.0 if draw[1] < 0.5 else -1.0
    return Pose2(
        start.x + error.xy * math.cos(direction),
        start.y + error.xy * math.sin(direction),
        start.yaw + sign * error.yaw,
    )
