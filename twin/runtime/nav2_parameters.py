"""Nav2's parameter files: what a node here has by the same name is taken, what it lacks is told."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from twin.nodes.navigation.costmap import CostmapNodeConfig
from twin.runtime.nav2_file import PLANNERS, Nav2Parameters
from twin.runtime.navigation_config import NavigationParameters
from twin.scenario.navigation import NavigationConfig
from twin.scenario.parameter_group import ParameterGroup

_CONTROLLER_NAMES = dict.fromkeys(
    ("controllers", "goal_checkers", "progress_checkers", "primary_controller"), ""
)
_CONTROLLERS = {
    "RegulatedPurePursuitController": "regulated_pure_pursuit",
    "DWBLocalPlanner": "dwb",
    "MPPIController": "mppi",
}


def with_plugins(config: NavigationConfig, namespace: str) -> NavigationConfig:
    """Return a scenario's navigation with the file's controller and planner, unless it names its own.

    Raises:
        NavigationError: the file is no parameter file.
    """
    if config.params_file is None:
        return config
    file = Nav2Parameters(Path(config.params_file), namespace)
    controller, planner = config.controller, config.planner
    chosen = file.plugin("controller_server", "FollowPath")
    if chosen == "RotationShimController":
        primary = file.plugin("controller_server", "FollowPath", "primary_controller")
        update = {"rotation_shim": True, "plugin": _CONTROLLERS.get(primary)}
    else:
        update = {"rotation_shim": False, "plugin": _CONTROLLERS.get(chosen)}
    if update["plugin"] and not {"plugin", "rotation_shim"} & controller.model_fields_set:
        controller = controller.model_copy(update=update)
    found = PLANNERS.get(file.plugin("planner_server", "GridBased"))
    if found and "plugin" not in planner.model_fields_set:
        planner = planner.model_copy(update={"plugin": found})
    return config.model_copy(update={"controller": controller, "planner": planner})


def with_file(
    parameters: NavigationParameters, config: NavigationConfig, namespace: str
) -> tuple[NavigationParameters, list[str]]:
    """Return a robot's parameters with those of its file, and what of the file was not understood.

    Raises:
        NavigationError: the file is wrong.
    """
    if config.params_file is None:
        return parameters, []
    file = Nav2Parameters(Path(config.params_file), namespace)
    speeds = {
        "linear.max_velocity": config.max_linear_speed,
        "angular.max_velocity": config.max_angular_speed,
    }
    given = frozenset(name for name, speed in speeds.items() if speed is not None)
    changed = replace(
        parameters,
        smoother=file.applied("velocity_smoother", parameters.smoother, keep=given),
        global_costmap=_costmap(file, parameters.global_costmap, config.global_costmap),
        local_costmap=_costmap(file, parameters.local_costmap, config.local_costmap),
        planner=file.applied(
            "planner_server", parameters.planner, prefix="GridBased.", keep=_given(config.planner)
        ),
        controller_server=file.applied(
            "controller_server",
            parameters.controller_server,
            _CONTROLLER_NAMES,
            keep=_given(config.controller),
        ),
        behaviors=file.applied("behavior_server", parameters.behaviors),
        navigator=file.applied("bt_navigator", parameters.navigator, keep=_given(config.navigator)),
        waypoints=file.applied("waypoint_follower", parameters.waypoints),
    )
    return changed, file.finish()


def _given(group: ParameterGroup) -> frozenset[str]:
    """Return the names that the scenario gives, which go before the file's."""
    return frozenset(group.overrides())


def _costmap(file: Nav2Parameters, config: CostmapNodeConfig, group: ParameterGroup) -> CostmapNodeConfig:
    return file.applied(f"{config.name}/{config.name}", config, {"layers": ""}, keep=_given(group))
