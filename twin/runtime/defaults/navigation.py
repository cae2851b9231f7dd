"""A robot's navigation parameters: defaults for its drive and footprint, under the scenario's overrides."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, TypeVar

from twin.controllers.limiter import AxisLimits
from twin.controllers.velocity_smoother import VelocitySmootherConfig
from twin.geometry import Array
from twin.models.specs import DriveSpec
from twin.navigation.costmaps.layered_costmap import CostmapConfig
from twin.navigation.planning.config import CommitmentConfig, GoalAccessConfig
from twin.navigation.plugins import LAYERS, PLANNERS, SMOOTHERS, config_of, configs_of
from twin.navigation.recovery import BehaviorConfig
from twin.nodes.navigation.bt_navigator_config import BtNavigatorConfig
from twin.nodes.navigation.controller_server.config import ControllerServerConfig
from twin.nodes.navigation.costmaps.config import CostmapNodeConfig
from twin.nodes.navigation.docking.config import DockingServerConfig
from twin.nodes.navigation.planning.config import PlannerServerConfig
from twin.nodes.navigation.planning.smoother_server import SmootherServerConfig
from twin.nodes.navigation.robot_pose import Frames
from twin.nodes.navigation.waypoint_follower import WaypointFollowerConfig
from twin.runtime.defaults import controllers, docking
from twin.scenario.navigation import (
    CostmapParameters,
    NavigationConfig,
    NavigatorParameters,
    PlannerParameters,
    SmootherParameters,
)
from twin.scenario.plugin_groups import config_of_use

C = TypeVar("C")

_MISSED_SCANS = 3.5
"""After so many scan periods without a scan the robot stops: three in a row are missing."""


@dataclass(frozen=True, kw_only=True)
class NavigationParameters:
    """What each navigation node is built with."""

    smoother: VelocitySmootherConfig
    global_costmap: CostmapNodeConfig
    local_costmap: CostmapNodeConfig
    planner: Any
    planner_server: PlannerServerConfig
    commitment: CommitmentConfig
    goal_access: GoalAccessConfig
    controller_server: ControllerServerConfig
    path_smoother: SmootherServerConfig
    behaviors: BehaviorConfig
    docking: DockingServerConfig
    navigator: BtNavigatorConfig
    waypoints: WaypointFollowerConfig


def navigation_parameters(
    config: NavigationConfig,
    drive: DriveSpec,
    footprint: Array,
    frames: Frames,
    *,
    mapping: bool = False,
    scan_rate: float | None = None,
) -> NavigationParameters:
    """Return the parameters for a robot.

    Args:
        config: What the scenario overrides.
        drive: Whose limits hold where the scenario gives none.
        footprint: Corners in the base frame, shape (n, 2) [m].
        frames: The robot's.
        mapping: Whether the map is made on the way: paths may lead through what is unknown.
        scan_rate: How often its lidar scans [Hz]; None: it has none.
    """
    polygon = tuple((float(x), float(y)) for x, y in footprint)
    in_map = CostmapConfig(
        footprint=polygon,
        footprint_padding=0.0,  # it is in the footprint already
        inflation_radius=0.8,
        cost_scaling_factor=4.0,
        obstacle_max_range=4.0,
        raytrace_max_range=5.0,
    )
    around = replace(
        in_map,
        rolling_window=True,
        width=4.0,
        height=4.0,
        obstacle_max_range=3.0,
        expected_update_rate=0.0 if scan_rate is None else _MISSED_SCANS / scan_rate,
    )
    smoother = _smoother(config, drive)
    defaults = NavigationParameters(
        smoother=smoother,
        # A whole hall is a big message, and changes slowly: it is published at half of Nav2's rate.
        global_costmap=CostmapNodeConfig(
            name="global_costmap",
            frame=frames.map,
            layers=_with_own(in_map, config.global_costmap),
            update_period_ns=500_000_000,
            publish_period_ns=2_000_000_000,
        ),
        local_costmap=CostmapNodeConfig(
            name="local_costmap", frame=frames.odom, layers=_with_own(around, config.local_costmap)
        ),
        planner=_planner(config.planner, mapping=mapping),
        planner_server=PlannerServerConfig(),
        commitment=CommitmentConfig(),
        goal_access=GoalAccessConfig(),
        controller_server=controllers.controller_server_config(
            config.controller, smoother, config.controllers
        ),
        behaviors=BehaviorConfig(footprint=polygon),
        path_smoother=_path_smoother(config.smoother),
        docking=docking.docking_config(config.docking),
        navigator=BtNavigatorConfig(),
        waypoints=WaypointFollowerConfig(),
    )
    return with_scenario(defaults, config)


def with_scenario(parameters: NavigationParameters, config: NavigationConfig) -> NavigationParameters:
    """Return parameters with what a scenario gives: it goes before a robot's defaults, and before a file."""
    smoothers = parameters.path_smoother.smoothers
    first = next(iter(smoothers))
    by_id = {"FollowPath": config.controller, **config.controllers}
    return replace(
        parameters,
        global_costmap=_costmap(parameters.global_costmap, config.global_costmap),
        local_costmap=_costmap(parameters.local_costmap, config.local_costmap),
        planner=config.planner.over(parameters.planner),
        planner_server=config.planner.over(parameters.planner_server),
        commitment=config.planner.over(parameters.commitment),
        goal_access=config.planner.over(parameters.goal_access),
        controller_server=controllers.with_scenario(parameters.controller_server, by_id),
        path_smoother=replace(
            parameters.path_smoother, smoothers={**smoothers, first: config.smoother.over(smoothers[first])}
        ),
        docking=docking.with_scenario(parameters.docking, config.docking),
        navigator=_navigator(parameters.navigator, config.navigator),
    )


def _planner(parameters: PlannerParameters, *, mapping: bool) -> Any:
    if parameters.users is not None:
        return config_of_use(PLANNERS, parameters.users)
    return config_of(PLANNERS.find(parameters.plugin))(tolerance=0.1, allow_unknown=mapping)


def _path_smoother(parameters: SmootherParameters) -> SmootherServerConfig:
    """Return the smoothers, the chosen one first."""
    shipped = {name: config() for name, config in configs_of(SMOOTHERS).items()}
    if parameters.users is not None:
        chosen = config_of_use(SMOOTHERS, parameters.users)
        name = parameters.users.reference.rpartition(":")[2]
    else:
        name = parameters.plugin
        chosen = shipped[name]
    shipped.pop(name, None)
    return SmootherServerConfig(smoothers={name: chosen, **shipped})


def _smoother(config: NavigationConfig, drive: DriveSpec) -> VelocitySmootherConfig:
    """Return the limits of what is commanded.

    No more than the drive does: what is asked beyond that leaves the curve that was checked for collisions.
    """
    return VelocitySmootherConfig(
        linear=_limits(
            config.max_linear_speed or drive.max_linear_velocity or 1.0,
            config.max_linear_acceleration or 0.8,
            config.max_linear_deceleration or 1.2,
            drive.max_linear_acceleration,
        ),
        angular=_limits(
            config.max_angular_speed or drive.max_angular_velocity or 1.5,
            config.max_angular_acceleration or 2.0,
            config.max_angular_acceleration or 3.0,
            drive.max_angular_acceleration,
        ),
        scale_velocities=True,
    )


def _navigator(config: BtNavigatorConfig, group: NavigatorParameters) -> BtNavigatorConfig:
    config, frequency = group.over(config), group.bt_loop_frequency
    return config if frequency is None else replace(config, bt_loop_duration=max(1, round(1e3 / frequency)))


def _limits(speed: float, acceleration: float, deceleration: float, drive: float | None) -> AxisLimits:
    return AxisLimits(
        max_velocity=speed,
        max_acceleration=min(acceleration, drive or acceleration),
        max_deceleration=min(deceleration, drive or deceleration),
    )


def _with_own(layers: CostmapConfig, group: CostmapParameters) -> CostmapConfig:
    return replace(
        layers, own_layers={name: config_of_use(LAYERS, used) for name, used in group.listed.items()}
    )


def _costmap(config: CostmapNodeConfig, group: CostmapParameters) -> CostmapNodeConfig:
    if group.robot_radius is not None:
        config = replace(config, layers=replace(config.layers, footprint=()))
    config = group.over(config)
    if group.observation_sources is not None:
        sources = tuple(source.config() for source in group.observation_sources)
        config = replace(config, observation_sources=sources)
    return config
