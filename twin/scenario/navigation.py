"""What a scenario may override of a robot's navigation; names are Nav2's.

Every one is optional: `overrides()` holds only what the file gives, the rest keeps the node's default.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from twin.nodes.navigation.bt_navigator_config import BtNavigatorConfig
from twin.parameters import (
    Hertz,
    Le,
    Metres,
    MetresPerSecond,
    NotNegative,
    Positive,
    RadiansPerSecond,
    Seconds,
)
from twin.scenario.collision_monitor import CollisionMonitorParameters
from twin.scenario.controllers import ControllerId, ControllerParameters, FurtherControllerParameters
from twin.scenario.docking import DockingParameters
from twin.scenario.fields import NameOrPath
from twin.scenario.parameter_group import ParameterGroup, keys_of
from twin.scenario.planners import PlannerParameters
from twin.strict_yaml import StrictModel


class CostmapParameters(ParameterGroup):
    """Parameters of a costmap."""

    resolution: Annotated[Metres, Positive] | None = None
    """Cell size [m]."""
    width: Annotated[Metres, Positive] | None = None
    """Of a rolling costmap, along x [m]."""
    height: Annotated[Metres, Positive] | None = None
    """Of a rolling costmap, along y [m]."""
    footprint_padding: Annotated[Metres, NotNegative] | None = None
    """Added to the footprint on every side [m]; the robot's own has 0.01 m already."""
    inflation_radius: Annotated[Metres, NotNegative] | None = None
    """Distance from obstacles within which cells cost [m]."""
    cost_scaling_factor: Annotated[float, Positive] | None = None
    """Decay of that cost [1/m]."""
    update_frequency: Annotated[Hertz, Positive] | None = None
    """Rate of updates [Hz]."""
    obstacle_min_range: Annotated[Metres, NotNegative] | None = None
    """Range from which a beam marks obstacles [m]."""
    obstacle_max_range: Annotated[Metres, Positive] | None = None
    """Range within which a beam marks obstacles [m]."""
    expected_update_rate: Annotated[Seconds, NotNegative] | None = None
    """Longest time between two scans of use [s]; later nobody drives by it. 0: none need come."""
    raytrace_min_range: Annotated[Metres, NotNegative] | None = None
    """Range from which a beam clears cells [m]."""
    raytrace_max_range: Annotated[Metres, Positive] | None = None
    """Range within which a beam clears cells [m]."""
    inf_is_valid: bool | None = None
    """Whether a beam without return (inf) clears cells."""
    footprint_clearing_enabled: bool | None = None
    """Whether the cells under the robot are free."""
    keepout_before_inflation: bool | None = None
    """Whether keep-out zones are inflated, so that no part of the robot enters them."""
    scan_topics: tuple[str, ...] | None = None
    """Topics of sensor_msgs/LaserScan for the obstacle layer; absent: `scan`."""
    range_topics: tuple[str, ...] | None = None
    """Topics of sensor_msgs/Range for the range sensor layer."""
    robot_radius: Annotated[Metres, Positive] | None = None
    """Takes the robot as a circle of this radius instead of by its footprint [m]."""
    rolling_window: bool | None = None
    """Whether the grid follows the robot, without a static map."""


@keys_of(BtNavigatorConfig)
class NavigatorParameters(ParameterGroup):
    """Parameters of `/bt_navigator`."""

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
    navigator: NavigatorParameters = NavigatorParameters()
    """Overrides of the navigator."""
    keepout_mask: NameOrPath | None = None
    """Mask of the zones that no path may cross: a YAML file of map_server."""
    speed_mask: NameOrPath | None = None
    """Mask of speed limits, in per cent of the cruise speed: a YAML file of map_server."""
    planner: PlannerParameters = PlannerParameters()
    """Overrides of the global planner."""
    controller: ControllerParameters = ControllerParameters()
    """Overrides of the path follower."""
    controllers: dict[ControllerId, FurtherControllerParameters] = Field(default_factory=dict)
    """More of them, for goals and behaviour trees that name a controller or a goal checker."""
    global_costmap: CostmapParameters = CostmapParameters()
    """Overrides of the costmap that plans are made on."""
    local_costmap: CostmapParameters = CostmapParameters()
    """Overrides of the rolling costmap around the robot."""
    docking: DockingParameters = DockingParameters()
    """Docks, and overrides of the docking server."""
