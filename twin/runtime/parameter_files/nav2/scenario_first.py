"""What a scenario gives, by the names of Nav2's parameter files: there the scenario goes first."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from twin.controllers.limiter import AxisLimits
from twin.navigation.control.maneuver_config import ManeuverConfig
from twin.nodes.navigation.bt_navigator_config import BtNavigatorConfig
from twin.nodes.navigation.controller_server.config import ControllerServerConfig
from twin.parameters.declaration import fields_of, names_of
from twin.scenario.controllers import ControllerParameters
from twin.scenario.docking import DockingParameters
from twin.scenario.navigation import CostmapParameters, NavigationConfig, NavigatorParameters
from twin.scenario.parameter_group import ParameterGroup

_AXIS = names_of(AxisLimits)
_OF_SERVER = frozenset(declaration.name for declaration in fields_of(ControllerServerConfig).values())
"""Keys under `controller` that belong to the server itself ..."""
_SECTIONS = ("FollowPath.", "general_goal_checker.", "progress_checker.")
"""... and where the others may belong."""
_CHOICES = frozenset({"goal_checker", "plugin", "progress_checker", "rotation_shim"})
"""What a scenario chooses; the chosen ones' parameters may come from the file."""
_DOCKS = frozenset({"docks", "pose", "type", "frame"})
"""Of a dock: these are read together."""


def for_smoother(config: NavigationConfig) -> frozenset[str]:
    """Return the limits that the scenario gives, by axis as the smoother here has them."""
    names = {
        f"linear.{_AXIS.max_velocity}": config.max_linear_speed,
        f"linear.{_AXIS.max_acceleration}": config.max_linear_acceleration,
        f"linear.{_AXIS.max_deceleration}": config.max_linear_deceleration,
        f"angular.{_AXIS.max_velocity}": config.max_angular_speed,
        f"angular.{_AXIS.max_acceleration}": config.max_angular_acceleration,
        f"angular.{_AXIS.max_deceleration}": config.max_angular_acceleration,
    }
    return frozenset(name for name, limit in names.items() if limit is not None)


def for_planner(group: ParameterGroup) -> frozenset[str]:
    """Return what the scenario gives of `GridBased`."""
    return frozenset(f"GridBased.{key}" for key in _keys(group))


def for_controllers(config: NavigationConfig) -> frozenset[str]:
    """Return what the scenario gives of `/controller_server`, of FollowPath and of controllers by id."""
    keys = set(_chosen_keys(config.controller))
    own = (keys & _OF_SERVER) | {f"{section}{key}" for section in _SECTIONS for key in keys - _OF_SERVER}
    if config.controller.maneuvers is not None:
        own.add(f"maneuver.{names_of(ManeuverConfig).reach}")
    further = {f"{name}.{key}" for name, one in config.controllers.items() for key in _chosen_keys(one)}
    return frozenset(own | further)


def for_docking(group: DockingParameters) -> frozenset[str]:
    """Return what the scenario gives of `/docking_server`, and of types of docks by name."""
    types = {f"{name}.{key}" for name, one in group.types.items() for key in _keys(one)}
    return frozenset({*_keys(group), *types}) | _DOCKS


def for_navigator(group: NavigatorParameters) -> frozenset[str]:
    """Return what the scenario gives of `/bt_navigator`, whose loop has a duration there."""
    loop = [] if group.bt_loop_frequency is None else [names_of(BtNavigatorConfig).bt_loop_duration]
    return frozenset([*_keys(group), *loop])


def for_costmap(group: CostmapParameters) -> frozenset[str]:
    """Return what the scenario gives of a costmap."""
    return frozenset(_keys(group))


def _chosen_keys(group: ControllerParameters) -> Iterator[str]:
    return (key for key in _keys(group) if key not in _CHOICES)


def _keys(group: ParameterGroup) -> Iterator[str]:
    """Yield the keys that are given; those of a critic as 'CostCritic.cost_weight'."""
    for key, value in group.overrides().items():
        if isinstance(value, Mapping):
            yield from (f"{key}.{inner}" for inner, one in value.items() if one is not None)
        elif value is not None:
            yield key
