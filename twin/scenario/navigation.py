"""What a scenario may override of a robot's navigation; names are Nav2's.

Every one is optional: `overrides()` holds only what the file gives, the rest keeps the node's default.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Annotated, Any

from pydantic import Field

from twin.navigation.costmaps.costmap_config import LAYERS as SHIPPED_LAYERS
from twin.navigation.plugins import LAYERS, TREE_NODES
from twin.nodes.navigation.bt_navigator_config import BtNavigatorConfig
from twin.nodes.navigation.costmaps.config import CostmapNodeConfig
from twin.parameters import Hertz, Le, MetresPerSecond, Positive, RadiansPerSecond
from twin.scenario.collision_monitor import CollisionMonitorParameters
from twin.scenario.controllers import ControllerId, ControllerParameters, FurtherControllerParameters
from twin.scenario.docking import DockingParameters
from twin.scenario.fields import NameOrPath
from twin.scenario.parameter_group import keys_of
from twin.scenario.planners import PlannerParameters, SmootherParameters
from twin.scenario.plugin_groups import PluginListGroup
from twin.strict_yaml import StrictModel


@keys_of(CostmapNodeConfig)
class CostmapParameters(PluginListGroup):
    """Parameters of a costmap; those of a layer of yours stand beside `plugins`, by the name of its class."""

    list_of, list_key = LAYERS, "plugins"

    @classmethod
    def ships(cls, data: Mapping[str, Any]) -> Collection[str]:
        """Return the names of the layers that ship."""
        return SHIPPED_LAYERS


@keys_of(BtNavigatorConfig)
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
    navigator: NavigatorParameters = NavigatorParameters.model_construct()
    """Overrides of the navigator."""
    keepout_mask: NameOrPath | None = None
    """Mask of the zones that no path may cross: a YAML file of map_server."""
    speed_mask: NameOrPath | None = None
    """Mask of speed limits, in per cent of the cruise speed: a YAML file of map_server."""
    planner: PlannerParameters = PlannerParameters.model_construct()
    """Overrides of the global planner."""
    smoother: SmootherParameters = SmootherParameters.model_construct()
    """Overrides of the path smoother."""
    controller: ControllerParameters = ControllerParameters.model_construct()
    """Overrides of the path follower."""
    controllers: dict[ControllerId, FurtherControllerParameters] = Field(default_factory=dict)
    """More of them, for goals and behaviour trees that name a controller or a goal checker."""
    global_costmap: CostmapParameters = CostmapParameters.model_construct()
    """Overrides of the costmap that plans are made on."""
    local_costmap: CostmapParameters = CostmapParameters.model_construct()
    """Overrides of the rolling costmap around the robot."""
    docking: DockingParameters = DockingParameters.model_construct()
    """Docks, and overrides of the docking server."""
