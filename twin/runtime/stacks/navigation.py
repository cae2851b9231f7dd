"""The nodes that drive a robot to a goal, in the order in which they run."""

from __future__ import annotations

from dataclasses import replace

from twin.controllers.velocity_smoother import VelocitySmootherConfig
from twin.geometry import Array
from twin.models.specs import DriveSpec
from twin.navigation.plugins import TREE_NODES
from twin.navigation.warm_up import warm_up_controller
from twin.nodes.navigation.behavior_server import BehaviorServerNode
from twin.nodes.navigation.behavior_trees.registry import nodes_with
from twin.nodes.navigation.bt_navigator import BtNavigatorNode
from twin.nodes.navigation.controller_server.server import ControllerServerNode
from twin.nodes.navigation.costmaps.costmap import CostmapNode
from twin.nodes.navigation.docking.server import DockingServerNode
from twin.nodes.navigation.planning.planner_server import PlannerServerNode
from twin.nodes.navigation.planning.smoother_server import SmootherServerNode
from twin.nodes.navigation.robot_pose import Frames, RobotPose
from twin.nodes.navigation.velocity.velocity_smoother import VelocitySmootherNode
from twin.nodes.navigation.waypoint_follower import WaypointFollowerNode
from twin.runtime.defaults.from_description import scan_lidar
from twin.runtime.defaults.navigation import NavigationParameters, navigation_parameters
from twin.runtime.parameter_files.localisation import localisation_nodes
from twin.runtime.parameter_files.nav2.parameters import monitor_with_file, with_file, with_plugins
from twin.runtime.stacks.commands import build_commands
from twin.runtime.stacks.context import StackContext
from twin.runtime.stacks.zones import build_zones, with_filters
from twin.scenario.navigation import NavigationConfig
from twin.warehouse.docks import TOTE_POSES


def build_navigation(
    context: StackContext, config: NavigationConfig, pose: RobotPose, footprint: Array
) -> BtNavigatorNode:
    """Create the navigation nodes; return the navigator.

    Args:
        context: What the robot's nodes are built from.
        config: What the scenario overrides.
        pose: What the robot believes about its pose.
        footprint: Corners in the base frame, shape (n, 2) [m].
    """
    bus, namespace, drive = context.bus, context.namespace, context.handle.description.drive
    assert drive is not None
    config = with_plugins(config, namespace)
    lidar = scan_lidar(context.handle.description)
    parameters, not_understood = parameters_of(context, config, pose.frames, footprint)
    period_ns = context.control_period_ns
    limits = _drive_limits(parameters.smoother, drive)
    build_commands(context, monitor_with_file(config, namespace), pose, footprint, limits)
    VelocitySmootherNode(bus, parameters.smoother, period_ns=period_ns, namespace=namespace)
    build_zones(bus, config, pose.frames.map, namespace=namespace)
    in_map = with_filters(parameters.global_costmap, config, speed=False)
    global_costmap = CostmapNode(bus, pose, in_map, namespace=namespace)
    around = with_filters(parameters.local_costmap, config, speed=True)
    local_costmap = CostmapNode(bus, pose, around, namespace=namespace)
    smoothers = parameters.path_smoother.smoothers
    PlannerServerNode(
        bus,
        pose,
        global_costmap,
        config=parameters.planner,
        server=parameters.planner_server,
        commitment=parameters.commitment,
        goal_access=parameters.goal_access,
        # One that is asked for smooths what is planned, too.
        smoother=next(iter(smoothers.values())) if config.smoother.model_fields_set else None,
        namespace=namespace,
    )
    SmootherServerNode(bus, global_costmap, parameters.path_smoother, namespace=namespace)
    server = ControllerServerNode(
        bus, pose, local_costmap, footprint, parameters.controller_server, namespace=namespace
    )
    for controller in server.controllers.values():
        warm_up_controller(controller)
    BehaviorServerNode(
        bus, pose, parameters.behaviors, costmap=local_costmap, period_ns=period_ns, namespace=namespace
    )
    if lidar is not None:
        DockingServerNode(
            bus,
            pose,
            parameters.docking,
            costmap=local_costmap,
            footprint=footprint,
            boxes=TOTE_POSES,
            namespace=namespace,
        )
    brought = {name: TREE_NODES.find(used.reference) for name, used in config.navigator.listed.items()}
    navigator = BtNavigatorNode(
        bus, pose, parameters.navigator, tree_nodes=nodes_with(brought), namespace=namespace
    )
    WaypointFollowerNode(bus, parameters.waypoints, namespace=namespace)
    for sentence in not_understood:
        navigator.node.get_logger().warn(sentence)
    return navigator


def parameters_of(
    context: StackContext, config: NavigationConfig, frames: Frames, footprint: Array
) -> tuple[NavigationParameters, list[str]]:
    """Return the parameters of the navigation nodes, and sentences on what a file has that is none.

    Args:
        context: What the robot's nodes are built from; it has a drive.
        config: What the scenario overrides.
        frames: Of the robot.
        footprint: Corners in the base frame, shape (n, 2) [m].
    """
    drive, localisation = context.handle.description.drive, context.config.localisation
    assert drive is not None
    lidar = scan_lidar(context.handle.description)
    parameters = navigation_parameters(
        config,
        drive,
        footprint,
        frames,
        mapping=localisation is not None and localisation.type == "slam",
        scan_rate=None if lidar is None else lidar.rate_hz,
    )
    names = localisation_nodes(context.config, context.namespace)
    return with_file(parameters, config, context.namespace, names)


def _drive_limits(smoother: VelocitySmootherConfig, drive: DriveSpec) -> VelocitySmootherConfig:
    """Return what people may ask for, too: the smoother's accelerations at the drive's own speeds."""
    linear, angular = drive.max_linear_velocity, drive.max_angular_velocity
    return replace(
        smoother,
        linear=replace(smoother.linear, max_velocity=linear or smoother.linear.max_velocity),
        angular=replace(smoother.angular, max_velocity=angular or smoother.angular.max_velocity),
    )
