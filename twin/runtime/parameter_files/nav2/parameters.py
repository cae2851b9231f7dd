"""Nav2's parameter files: what a node here has by the same name is taken, what it lacks is told."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

from twin.controllers.limiter import AxisLimits
from twin.navigation import plugins
from twin.navigation.localisation.amcl_config import AmclConfig
from twin.navigation.plugins import CONTROLLERS
from twin.nodes.navigation.costmaps.config import CostmapNodeConfig
from twin.nodes.navigation.localisation.amcl import AmclNodeConfig
from twin.parameters import Flat
from twin.parameters.declaration import names_of
from twin.plugins import Kind
from twin.runtime.defaults.navigation import NavigationParameters, with_scenario
from twin.runtime.parameter_files.nav2.brought import brought, with_critics, with_layers, with_smoothers
from twin.runtime.parameter_files.nav2.file import Nav2Parameters
from twin.runtime.parameter_files.nav2.lists import clouds_of, database_of, sources_of
from twin.runtime.parameter_files.nav2.monitor import monitor_of
from twin.runtime.parameter_files.nav2.names import PLANNERS
from twin.runtime.parameter_files.nav2.trees import with_trees
from twin.scenario.collision_monitor import CollisionMonitorParameters
from twin.scenario.estimators.amcl import AmclParameters as AmclGroup
from twin.scenario.navigation import CostmapParameters, NavigationConfig

_DOCKS = frozenset({"docks", "pose", "type", "frame"})
"""Of a dock: these are read together, by `database_of`."""


def with_plugins(config: NavigationConfig, namespace: str) -> NavigationConfig:
    """Return a scenario's navigation with the file's plugins, unless it names its own.

    Raises:
        NavigationError: the file is no parameter file.
    """
    if config.params_file is None:
        return config
    file = Nav2Parameters(Path(config.params_file), namespace)
    controller, planner = config.controller, config.planner
    chosen, key = file.plugin("controller_server", "FollowPath"), "plugin"
    if shim := _shipped(CONTROLLERS, chosen) == "rotation_shim":
        key = "primary_controller"
        chosen = file.plugin("controller_server", "FollowPath", key)
    used = brought(file, "controller_server", f"FollowPath.{key}", chosen, CONTROLLERS)
    update = {"rotation_shim": shim, "plugin": used.reference if used else _shipped(CONTROLLERS, chosen)}
    given = controller.model_fields_set
    may_be = "plugin" not in given or controller.plugin == update["plugin"]
    if update["plugin"] and may_be and "rotation_shim" not in given:
        controller = controller.model_copy(update=update)
    for key, section, kind in (
        ("goal_checker", "general_goal_checker", plugins.GOAL_CHECKERS),
        ("progress_checker", "progress_checker", plugins.PROGRESS_CHECKERS),
    ):
        said = file.plugin("controller_server", section)
        checker = brought(file, "controller_server", f"{section}.plugin", said, kind) or _shipped(kind, said)
        if checker and key not in controller.model_fields_set:
            controller = controller.model_copy(update={key: checker})
    chosen = file.plugin("planner_server", "GridBased")
    used = brought(file, "planner_server", "GridBased.plugin", chosen, plugins.PLANNERS)
    found = used.reference if used else PLANNERS.get(chosen)
    file.ignored()
    if found and "plugin" not in planner.model_fields_set:
        planner = planner.model_copy(update={"plugin": found})
    return config.model_copy(update={"controller": controller, "planner": planner})


def _shipped(kind: Kind[Any], plugin: str) -> str | None:
    """Return the name of what ships for a plugin of Nav2, whose class begins as the one here does."""
    classes = ((name, target.rpartition(":")[2]) for name, target in kind.shipped.items())
    return next((name for name, own in classes if plugin.startswith(own)), None)


@dataclass(frozen=True, kw_only=True)
class AmclParameters:
    """All of `/amcl`."""

    filter: Annotated[AmclConfig, Flat]
    node: Annotated[AmclNodeConfig, Flat]


def amcl_with_file(
    group: AmclGroup, params_file: str | None, namespace: str
) -> tuple[AmclParameters, list[str]]:
    """Return the parameters of `/amcl` with those of a file, and what of them was not understood.

    Args:
        group: What the scenario gives: it goes before the file.
        params_file: Absent: there is none.
        namespace: Of the robot.

    Raises:
        NavigationError: the file is wrong.
    """
    parameters = AmclParameters(filter=group.over(AmclConfig()), node=AmclNodeConfig())
    if params_file is None:
        return parameters, []
    file = Nav2Parameters(Path(params_file), namespace)
    parameters = group.over(file.applied("amcl", parameters))
    return parameters, file.ignored()


def monitor_with_file(config: NavigationConfig, namespace: str) -> CollisionMonitorParameters:
    """Return the collision monitor: the scenario's, else the file's, else the default.

    Raises:
        NavigationError: the file is wrong.
    """
    if config.collision_monitor is not None:
        return config.collision_monitor
    if config.params_file is None:
        return CollisionMonitorParameters()
    file = Nav2Parameters(Path(config.params_file), namespace)
    monitor = monitor_of(file)
    file.ignored()
    return monitor or CollisionMonitorParameters()


def with_file(
    parameters: NavigationParameters,
    config: NavigationConfig,
    namespace: str,
    elsewhere: Collection[str] = (),
) -> tuple[NavigationParameters, list[str]]:
    """Return a robot's parameters with those of its file, and what of the file was not understood.

    Args:
        parameters: What holds without the file.
        config: What the scenario says.
        namespace: Of the robot.
        elsewhere: Further nodes of the file that are read on another occasion.

    Raises:
        NavigationError: the file is wrong.
    """
    if config.params_file is None:
        return parameters, []
    file = Nav2Parameters(Path(config.params_file), namespace)
    docking = parameters.docking
    docking = replace(docking, database=database_of(file, docking.database))
    server, smoothers = parameters.controller_server, parameters.path_smoother.smoothers
    if "critics" not in config.controller.model_fields_set:
        controllers = {name: with_critics(file, name, one) for name, one in server.controllers.items()}
        server = replace(server, controllers=controllers)
    if not config.smoother.model_fields_set:
        smoothers = with_smoothers(file, smoothers)
    changed = replace(
        parameters,
        smoother=file.applied("velocity_smoother", parameters.smoother, keep=_limits(config)),
        global_costmap=_costmap(file, parameters.global_costmap, config.global_costmap),
        local_costmap=_costmap(file, parameters.local_costmap, config.local_costmap),
        planner=file.applied("planner_server", parameters.planner, prefix="GridBased."),
        controller_server=file.applied("controller_server", server),
        behaviors=file.applied("behavior_server", parameters.behaviors),
        docking=file.applied("docking_server", docking, keep=_DOCKS),
        path_smoother=file.applied("smoother_server", replace(parameters.path_smoother, smoothers=smoothers)),
        navigator=file.applied("bt_navigator", parameters.navigator),
        waypoints=file.applied("waypoint_follower", parameters.waypoints),
    )
    navigator, told = with_trees(file, changed.navigator, frozenset(config.navigator.overrides()))
    changed = with_scenario(replace(changed, navigator=navigator), config)
    if config.collision_monitor is None:
        monitor_of(file)
    return changed, [*told, *file.finish(elsewhere=("amcl", "collision_monitor", *elsewhere))]


def _limits(config: NavigationConfig) -> frozenset[str]:
    """Return the limits that the scenario gives, by axis as the smoother here has them."""
    axis = names_of(AxisLimits)
    names = {
        f"linear.{axis.max_velocity}": config.max_linear_speed,
        f"linear.{axis.max_acceleration}": config.max_linear_acceleration,
        f"linear.{axis.max_deceleration}": config.max_linear_deceleration,
        f"angular.{axis.max_velocity}": config.max_angular_speed,
        f"angular.{axis.max_acceleration}": config.max_angular_acceleration,
        f"angular.{axis.max_deceleration}": config.max_angular_acceleration,
    }
    return frozenset(name for name, limit in names.items() if limit is not None)


def _costmap(file: Nav2Parameters, config: CostmapNodeConfig, group: CostmapParameters) -> CostmapNodeConfig:
    node = f"{config.name}/{config.name}"
    (scans, ranges), clouds = sources_of(file, node), clouds_of(file, node)
    if group.observation_sources is None and clouds:
        config = replace(config, observation_sources=clouds)
    config = replace(
        config,
        scan_topics=config.scan_topics if group.scan_topics is not None else scans or config.scan_topics,
        range_topics=config.range_topics if group.range_topics is not None else ranges or config.range_topics,
    )
    if group.plugins is None:
        config = replace(config, layers=with_layers(file, node, config.layers))
    changed = file.applied(node, config)
    if file.is_round(node) and group.robot_radius is None:
        changed = replace(changed, layers=replace(changed.layers, footprint=()))
    return changed
