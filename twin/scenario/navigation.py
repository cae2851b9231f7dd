"""What a scenario may override of a robot's navigation; names are Nav2's.

Every one is optional: `overrides()` holds only what the file gives, the rest keeps the node's default.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from twin.scenario.controllers import ControllerParameters
from twin.scenario.fields import NotNegative, Positive
from twin.scenario.parameter_group import ParameterGroup
from twin.strict_yaml import Hertz, Metres, MetresPerSecond, RadiansPerSecond, StrictModel


class PlannerParameters(ParameterGroup):
    """Parameters of `/planner_server`."""

    tolerance: Annotated[Metres, NotNegative] | None = None
    """How far from the requested goal a plan may end [m]."""
    allow_unknown: bool | None = None
    """Whether a plan may cross unknown cells."""
    commitment_cost: Annotated[int, Field(ge=0, le=252)] | None = None
    """Added to the cost of each cell off the last path, so that routes are not changed lightly."""
    commitment_width: Annotated[Metres, Positive] | None = None
    """To each side of the last path that counts as on it [m]."""
    cost_factor: Annotated[float, NotNegative] | None = None
    """A metre at cost 252 counts as 1 + cost_factor metres of free space."""


class CostmapParameters(ParameterGroup):
    """Parameters of a costmap."""

    resolution: Annotated[Metres, Positive] | None = None
    """Cell size [m]."""
    inflation_radius: Annotated[Metres, NotNegative] | None = None
    """Distance from obstacles within which cells cost [m]."""
    cost_scaling_factor: Annotated[float, Positive] | None = None
    """Decay of that cost [1/m]."""
    update_frequency: Annotated[Hertz, Positive] | None = None
    """Rate of updates [Hz]."""
    obstacle_max_range: Annotated[Metres, Positive] | None = None
    """Range within which a beam marks obstacles [m]."""
    raytrace_max_range: Annotated[Metres, Positive] | None = None
    """Range within which a beam clears cells [m]."""
    robot_radius: Annotated[Metres, Positive] | None = None
    """Takes the robot as a circle of this radius instead of by its footprint [m]."""
    rolling_window: bool | None = None
    """Whether the grid follows the robot, without a static map."""
    width: Annotated[Metres, Positive] | None = None
    """Extent of a rolling grid [m]."""
    height: Annotated[Metres, Positive] | None = None
    """Extent of a rolling grid [m]."""


class NavigatorParameters(ParameterGroup):
    """Parameters of `/bt_navigator`."""

    bt_loop_frequency: Annotated[Hertz, Positive] | None = None
    """Rate of the behaviour tree's ticks [Hz]."""
    replanning_frequency: Annotated[Hertz, Positive] | None = None
    """How often the path is looked at, or planned anew [Hz]."""
    keep_valid_path: bool | None = None
    """Whether a path is kept while it is free; otherwise it is planned anew each time."""


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
    navigator: NavigatorParameters = NavigatorParameters()
    """Overrides of the navigator."""
    planner: PlannerParameters = PlannerParameters()
    """Overrides of the global planner."""
    controller: ControllerParameters = ControllerParameters()
    """Overrides of the path follower."""
    global_costmap: CostmapParameters = CostmapParameters()
    """Overrides of the costmap that plans are made on."""
    local_costmap: CostmapParameters = CostmapParameters()
    """Overrides of the rolling costmap around the robot."""
