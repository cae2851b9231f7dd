"""What a scenario may override of a robot's navigation; names are Nav2's, those of planners of its plugins.

Every one is optional: `overrides()` holds only what the file gives, the rest keeps the node's default.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from functools import cache
from typing import Annotated, Any

from pydantic import Field, model_validator

from twin.navigation.costmaps.costmap_config import LAYERS as SHIPPED_LAYERS
from twin.navigation.costmaps.observation import ObservationSource
from twin.navigation.planning.config import CommitmentConfig, GoalAccessConfig
from twin.navigation.plugins import LAYERS, PLANNERS, SMOOTHERS, TREE_NODES, configs_of
from twin.nodes.navigation.bt_navigator_config import BtNavigatorConfig
from twin.nodes.navigation.costmaps.config import CostmapNodeConfig
from twin.nodes.navigation.planning.config import PlannerServerConfig
from twin.parameters import Hertz, Le, MetresPerSecond, Positive, RadiansPerSecond
from twin.parameters.placed import overridden
from twin.scenario.collision_monitor import CollisionMonitorParameters
from twin.scenario.controllers import ControllerId, ControllerParameters, FurtherControllerParameters
from twin.scenario.docking import DockingParameters
from twin.scenario.fields import NameOrPath
from twin.scenario.parameter_group import ParameterGroup, key_names, keys_of
from twin.scenario.plugin_groups import PluginGroup, PluginListGroup, plugin_name
from twin.strict_yaml import StrictModel
from twin.strict_yaml.later import Later


@keys_of(PlannerServerConfig, CommitmentConfig, GoalAccessConfig, later=True)
class PlannerServerParameters(ParameterGroup):
    """What holds for every planner."""

    plugin: plugin_name(PLANNERS) = "theta_star"  # type: ignore[valid-type]
    """8-connected A* (`grid_based`); any-angle Theta* (`theta_star`); Hybrid-A* for robots with a turning
    circle (`smac_hybrid`); or a plugin of yours, whose parameters stand beside it."""


@cache
def _keys() -> dict[str, tuple[str, ...]]:
    """Return the keys of the planners that ship, by name."""
    return {plugin: key_names(config) for plugin, config in configs_of(PLANNERS).items()}


@keys_of(*configs_of(PLANNERS).values(), later=True)
class PlannerParameters(PluginGroup, PlannerServerParameters):
    """Parameters of `/planner_server`: which planner `GridBased` is, and that planner's own."""

    of = PLANNERS

    @classmethod
    def beside(cls, data: Mapping[str, Any]) -> set[str]:
        """Return the keys of the server."""
        return set(PlannerServerParameters.whole().model_fields)

    @classmethod
    def _descriptions(cls) -> Mapping[str, str]:
        """Return what is told of the keys, and which plugins have them."""
        told = dict(super()._descriptions())
        for name in told:
            owners = [f"`{plugin}`" for plugin, own in _keys().items() if name in own]
            if 0 < len(owners) < len(_keys()):
                told[name] = f"{' and '.join(owners)}: {told[name]}"
        return told

    @model_validator(mode="after")
    def _belongs_to_the_plugin(self) -> PlannerParameters:
        if self.users is not None:
            return self
        valid = {*PlannerServerParameters.whole().model_fields, *_keys()[self.plugin]}
        for name in sorted(self.model_fields_set - valid):
            others = " or ".join(plugin for plugin, own in _keys().items() if name in own)
            raise ValueError(
                f"{name} is a parameter of {others}; {self.plugin} has {', '.join(sorted(valid))}"
            )
        return self


@keys_of(*configs_of(SMOOTHERS).values(), later=True)
class SmootherParameters(PluginGroup):
    """Parameters of `/smoother_server`: its first smoother, which also smooths what a planner has planned."""

    of = SMOOTHERS
    plugin: plugin_name(SMOOTHERS) = "simple_smoother"  # type: ignore[valid-type]
    """`simple_smoother`, `savitzky_golay`, or a plugin of yours, whose parameters stand beside it."""

    @classmethod
    def beside(cls, data: Mapping[str, Any]) -> set[str]:
        """Return the key that names the plugin."""
        return {"plugin"}


@keys_of(ObservationSource, whole=True)
class ObservationSourceParameters(ParameterGroup):
    """A topic of points for a layer of a costmap."""

    @model_validator(mode="after")
    def _can_be(self) -> ObservationSourceParameters:
        self.config()
        return self

    def config(self) -> ObservationSource:
        """Return the source."""
        return overridden(ObservationSource(topic=self.topic), self.overrides())


@keys_of(CostmapNodeConfig, later=True)
class CostmapParameters(PluginListGroup):
    """Parameters of a costmap; those of a layer of yours stand beside `plugins`, by the name of its class."""

    list_of, list_key = LAYERS, "plugins"
    observation_sources: Sequence[ObservationSourceParameters] | None = None
    """Topics of points, for the voxel layer and the obstacle layer."""

    @classmethod
    def ships(cls, data: Mapping[str, Any]) -> Collection[str]:
        """Return the names of the layers that ship."""
        return SHIPPED_LAYERS


@keys_of(BtNavigatorConfig, later=True)
class NavigatorParameters(PluginListGroup):
    """Parameters of `/bt_navigator`."""

    list_of, list_key = TREE_NODES, "plugins"
    plugins: Sequence[str] = ()
    """Nodes of yours that trees may have, by the names of their classes."""
    bt_loop_frequency: Annotated[Hertz, Positive, Le(1000)] | None = None
    """Rate of the tree's ticks [Hz]."""


class NavigationConfig(StrictModel):
    """The navigation of one robot; `navigation: {}` takes every default."""

    max_linear_speed: Annotated[MetresPerSecond, Positive] | None = None
    """Limit of the velocity smoother [m/s]; absent: the robot's own."""
    max_angular_speed: Annotated[RadiansPerSecond, Positive] | None = None
    """Limit of the velocity smoother [rad/s]; absent: the robot's own."""
    max_linear_acceleration: Annotated[float, Positive] | None = None
    """Limit of the velocity smoother when speeding up [m/s²]."""
    max_linear_deceleration: Annotated[float, Positive] | None = None
    """Limit of the velocity smoother when braking [m/s²]."""
    max_angular_acceleration: Annotated[float, Positive] | None = None
    """Limit of the velocity smoother, also when braking [rad/s²]."""
    collision_monitor: CollisionMonitorParameters | None = None
    """Stops or slows down every command that leads into what the sensors see; absent: with the defaults."""
    params_file: NameOrPath | None = None
    """A Nav2 parameter file; all other keys here go before its values."""
    navigator: Annotated[NavigatorParameters, Later(NavigatorParameters.whole)] = (
        NavigatorParameters.model_construct()
    )
    """Overrides of the navigator."""
    keepout_mask: NameOrPath | None = None
    """Mask of the zones that no path may cross: a YAML file of map_server."""
    speed_mask: NameOrPath | None = None
    """Mask of speed limits, in per cent of the cruise speed: a YAML file of map_server."""
    planner: Annotated[PlannerParameters, Later(PlannerParameters.whole)] = (
        PlannerParameters.model_construct()
    )
    """Overrides of the global planner."""
    smoother: Annotated[SmootherParameters, Later(SmootherParameters.whole)] = (
        SmootherParameters.model_construct()
    )
    """Overrides of the path smoother."""
    controller: Annotated[ControllerParameters, Later(ControllerParameters.whole)] = (
        ControllerParameters.model_construct()
    )
    """Overrides of the path follower."""
    controllers: dict[
        ControllerId, Annotated[FurtherControllerParameters, Later(FurtherControllerParameters.whole)]
    ] = Field(default_factory=dict)
    """More of them, for goals and behaviour trees that name a controller or a goal checker."""
    global_costmap: Annotated[CostmapParameters, Later(CostmapParameters.whole)] = (
        CostmapParameters.model_construct()
    )
    """Overrides of the costmap that plans are made on."""
    local_costmap: Annotated[CostmapParameters, Later(CostmapParameters.whole)] = (
        CostmapParameters.model_construct()
    )
    """Overrides of the rolling costmap around the robot."""
    docking: Annotated[DockingParameters, Later(DockingParameters.whole)] = (
        DockingParameters.model_construct()
    )
    """Docks, and overrides of the docking server."""
