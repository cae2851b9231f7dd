"""What a scenario may override of a robot's navigation; names are Nav2's.

Every one is optional: `overrides()` holds only what the file gives, the rest keeps the node's default.
"""

from __future__ import annotations

from typing import Annotated

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


class NavigationConfig(StrictModel):
    """The navigation of one robot; `navigation: {}` takes every default."""

    max_linear_speed: Annotated[MetresPerSecond, Positive] | None = None
    """Limit of the velocity smoother [m/s]; absent: the robot's own."""
    max_angular_speed: Annotated[RadiansPerSecond, Positive] | None = None
    """Limit of the velocity smoother [rad/s]; absent: the robot's own."""
    planner: PlannerParameters = PlannerParameters()
    """Overrides of the global planner."""
    controller: ControllerParameters = ControllerParameters()
    """Overrides of the path follower."""
    global_costmap: CostmapParameters = CostmapParameters()
    """Overrides of the costmap that plans are made on."""
    local_costmap: CostmapParameters = CostmapParameters()
    """Overrides of the rolling costmap around the robot."""
