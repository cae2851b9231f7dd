"""The controller server's parameters: defaults for a robot's limits, under the scenario's overrides."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from twin.controllers.velocity_smoother import VelocitySmootherConfig
from twin.navigation.control.dwb.config import DWBConfig
from twin.navigation.control.goal_checker import GoalCheckerConfig
from twin.navigation.control.maneuver_config import ManeuverConfig
from twin.navigation.control.mppi.config import (
    GoalAngleCriticConfig,
    GoalCriticConfig,
    MPPIConfig,
    PathAlignCriticConfig,
)
from twin.navigation.control.regulated_pure_pursuit.config import RegulatedPurePursuitConfig
from twin.navigation.control.rotation_shim_config import RotationShimConfig
from twin.navigation.plugins import CONTROLLERS, CRITICS, GOAL_CHECKERS, PROGRESS_CHECKERS, config_of
from twin.nodes.navigation.controller_server.config import ControllerServerConfig
from twin.parameters.declaration import names_of
from twin.scenario.controllers import ControllerParameters
from twin.scenario.plugin_groups import config_of_use
from twin.scenario.plugins import PluginUse

_FIRST, _GOAL_CHECKER = "FollowPath", "general_goal_checker"
_PERIOD_NS = 60_000_000
_PATIENCE_NS = 4_000_000_000
"""How long somebody in the way is waited for: until they have walked past, or are planned around."""
_TOLERANCE = 0.05
"""Of position [m] and heading [rad]: what docking can start from."""
_TOLERANCE_BUFFER = 0.25
"""A robot that is farther off while it turns at the goal was carried away, or localised anew [m]."""
_TURN = 1.2
"""Rate [rad/s] and acceleration [rad/s²] of turns in place."""


def controller_server_config(
    parameters: ControllerParameters,
    smoother: VelocitySmootherConfig,
    further: Mapping[str, ControllerParameters] | None = None,
) -> ControllerServerConfig:
    """Return the server's parameters for a robot that the velocity smoother limits.

    Args:
        parameters: Of the server, and of the controller `FollowPath`.
        smoother: Its limits are the controllers'.
        further: More controllers, by id; each brings a goal checker of the same id.
    """
    by_id = {_FIRST: parameters, **(further or {})}
    server = ControllerServerConfig(
        controllers={},
        goal_checkers={
            _GOAL_CHECKER if name == _FIRST else name: _goal_checker(by_id[name]) for name in by_id
        },
        progress_checkers={"progress_checker": _progress_checker(parameters)},
        controller_period_ns=_PERIOD_NS,
        failure_tolerance_ns=_PATIENCE_NS,
    )
    server = with_scenario(server, by_id)
    controllers = {name: _controller(name, one, smoother, server) for name, one in by_id.items()}
    return with_scenario(replace(server, controllers=controllers), by_id)


def with_scenario(
    server: ControllerServerConfig, by_id: Mapping[str, ControllerParameters]
) -> ControllerServerConfig:
    """Return the server's parameters with what a scenario gives of them.

    Args:
        server: The server.
        by_id: What the scenario says of `FollowPath`, and of further controllers.
    """

    def given(configs: Mapping[str, Any]) -> dict[str, Any]:
        return {name: by_id.get(name, first).over(one) for name, one in configs.items()}

    first = by_id[_FIRST]
    if first.maneuvers is not None:
        reach = ManeuverConfig().reach if first.maneuvers else 0.0
        server = replace(server, maneuver=replace(server.maneuver, reach=reach))
    return replace(
        first.over(server),
        controllers=given(server.controllers),
        goal_checkers=given(server.goal_checkers),
        progress_checkers=given(server.progress_checkers),
    )


def _controller(
    name: str,
    parameters: ControllerParameters,
    smoother: VelocitySmootherConfig,
    server: ControllerServerConfig,
) -> Any:
    controller: Any
    if parameters.users is not None:
        controller = config_of_use(CONTROLLERS, parameters.users)
    elif parameters.chosen == "mppi":
        controller = _mppi(parameters, smoother, server.controller_period_ns * 1e-9)
    elif parameters.chosen == "dwb":
        controller = _dwb(parameters, smoother)
    else:
        checker = server.goal_checkers[_GOAL_CHECKER if name == _FIRST else name]
        tolerance = getattr(checker, names_of(GoalCheckerConfig).xy_goal_tolerance, _TOLERANCE)
        controller = _pure_pursuit(smoother, tolerance)
    if parameters.listed:
        own = {name: config_of_use(CRITICS, used) for name, used in parameters.listed.items()}
        controller = replace(controller, own_critics=own)
    if not parameters.shim:
        return controller
    return RotationShimConfig(
        primary_controller=controller,
        rotate_to_heading_angular_vel=min(_TURN, smoother.angular.max_velocity),
        max_angular_accel=_TURN,
        rotate_to_goal_heading=True,
    )


def _pure_pursuit(smoother: VelocitySmootherConfig, tolerance: float) -> RegulatedPurePursuitConfig:
    """Return a lookahead that grows with speed."""
    return RegulatedPurePursuitConfig(
        desired_linear_vel=smoother.linear.max_velocity,
        use_velocity_scaled_lookahead_dist=True,
        min_lookahead_dist=0.35,
        max_lookahead_dist=1.0,
        lookahead_time=1.0,
        rotate_to_heading_angular_vel=min(_TURN, smoother.angular.max_velocity),
        max_angular_accel=_TURN,
        rotate_to_heading_min_angle=0.6,
        approach_velocity_scaling_dist=0.8,
        xy_goal_tolerance=tolerance,
        max_linear_decel=smoother.linear.braking,
        max_linear_accel=smoother.linear.max_acceleration,
        cost_scaling_dist=0.7,
    )


def _mppi(parameters: ControllerParameters, smoother: VelocitySmootherConfig, period: float) -> MPPIConfig:
    """Return a horizon of 2.4 s, and critics that end within centimetres.

    Fewer rollouts than Nav2's, of slower noise: they reach as far aside, in a third of the time.
    """
    linear, angular = smoother.linear, smoother.angular
    speed, model_dt = parameters.vx_max or linear.max_velocity, parameters.model_dt or min(period, 10.0)
    steps = parameters.time_steps or min(1000, max(8, round(2.4 / model_dt)))
    return MPPIConfig(
        batch_size=600,
        time_steps=steps,
        model_dt=model_dt,
        vx_max=speed,
        vx_min=-0.15,
        wz_max=angular.max_velocity,
        ax_max=linear.max_acceleration,
        ax_min=-linear.braking,
        az_max=angular.max_acceleration,
        vx_std=max(0.2, 0.2 * speed),
        noise_time_constant=0.6,
        prune_distance=max(1.7, speed * steps * model_dt),
        # The rotation shim turns to the goal's heading; until there the path is kept to.
        GoalCritic=GoalCriticConfig(cost_weight=15.0),
        GoalAngleCritic=GoalAngleCriticConfig(enabled=False),
        PathAlignCritic=PathAlignCriticConfig(offset_from_furthest=2, threshold_to_consider=0.05),
    )


def _dwb(parameters: ControllerParameters, smoother: VelocitySmootherConfig) -> DWBConfig:
    """Return a local path as long as a sample drives: a farther end is driven to across the corners."""
    linear, angular = smoother.linear, smoother.angular
    speed, sim_time = parameters.max_vel_x or linear.max_velocity, parameters.sim_time or 1.2
    return DWBConfig(
        sim_time=sim_time,
        prune_distance=max(0.6, speed * sim_time),
        max_vel_x=linear.max_velocity,
        max_vel_theta=angular.max_velocity,
        acc_lim_x=linear.max_acceleration,
        decel_lim_x=-linear.braking,
        acc_lim_theta=angular.max_acceleration,
        decel_lim_theta=-angular.braking,
    )


def _goal_checker(parameters: ControllerParameters) -> Any:
    chosen = parameters.goal_checker or "simple"
    if isinstance(chosen, PluginUse):
        return config_of_use(GOAL_CHECKERS, chosen)
    near = config_of(GOAL_CHECKERS.find(chosen))(
        xy_goal_tolerance=_TOLERANCE, xy_goal_tolerance_buffer=_TOLERANCE_BUFFER
    )
    if isinstance(near, GoalCheckerConfig):
        near = replace(near, yaw_goal_tolerance=_TOLERANCE)
    return near


def _progress_checker(parameters: ControllerParameters) -> Any:
    chosen = parameters.progress_checker or "simple"
    if isinstance(chosen, PluginUse):
        return config_of_use(PROGRESS_CHECKERS, chosen)
    return config_of(PROGRESS_CHECKERS.find(chosen))()
