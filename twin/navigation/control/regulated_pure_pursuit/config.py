"""Parameters of regulated pure pursuit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from twin.parameters import (
    Derived,
    Metres,
    MetresPerSecond,
    MetresPerSecondSquared,
    NotNegative,
    Positive,
    Radians,
    RadiansPerSecond,
    RadiansPerSecondSquared,
    Seconds,
)


@dataclass(frozen=True, kw_only=True)
class RegulatedPurePursuitConfig:
    """Parameters of regulated pure pursuit; names and defaults are Nav2's."""

    desired_linear_vel: Annotated[MetresPerSecond, Positive] = 0.5
    """Cruise speed."""
    lookahead_dist: Annotated[Metres, Positive] = 0.6
    """Distance of the point that is followed."""
    min_lookahead_dist: Annotated[Metres, Positive] = 0.3
    """Its lower bound when scaled by speed."""
    max_lookahead_dist: Annotated[Metres, Positive] = 0.9
    """Its upper bound when scaled by speed."""
    lookahead_time: Annotated[Seconds, Positive] = 1.5
    """Time that the point lies ahead when scaled by speed."""
    use_velocity_scaled_lookahead_dist: bool = False
    """Whether that distance is scaled by speed."""
    use_regulated_linear_velocity_scaling: bool = True
    """Whether tight turns are driven slower."""
    regulated_linear_scaling_min_radius: Annotated[Metres, Positive] = 0.9
    """Turns tighter than this are."""
    regulated_linear_scaling_min_speed: Annotated[MetresPerSecond, Positive] = 0.25
    """But not slower than this."""
    use_cost_regulated_linear_velocity_scaling: bool = True
    """Whether the robot slows down near obstacles."""
    cost_scaling_dist: Annotated[Metres, Positive] = 0.6
    """Closer to an obstacle than this it does."""
    cost_scaling_gain: Annotated[float, Positive] = 1.0
    """Above 1: less."""
    use_rotate_to_heading: bool = True
    """Whether the robot turns in place to a path behind it, and at the goal."""
    rotate_to_heading_angular_vel: Annotated[RadiansPerSecond, Positive] = 1.8
    """Turn rate on the spot."""
    rotate_to_heading_min_angle: Annotated[Radians, Positive] = 0.785
    """Off the path's direction by more than this the robot turns in place."""
    max_angular_accel: Annotated[RadiansPerSecondSquared, Positive] = 3.2
    """Its acceleration there."""
    approach_velocity_scaling_dist: Annotated[Metres, Positive] = 0.6
    """Nearer to the goal the robot slows down."""
    min_approach_linear_velocity: Annotated[MetresPerSecond, Positive] = 0.05
    """But not below this."""
    use_collision_detection: bool = True
    """Whether commands are checked for collisions."""
    max_allowed_time_to_collision_up_to_carrot: Annotated[Seconds, Positive] = 1.0
    """How far ahead a command is checked for collisions."""
    turn_before_collision: bool = False
    """Where the arc to the lookahead point is blocked: whether to turn towards that point on the spot, or to
    creep along the arc, before giving up (ours, not Nav2's)."""
    creep_speed: Annotated[MetresPerSecond, Positive] = 0.15
    """Of that creeping."""
    xy_goal_tolerance: Annotated[Metres, Positive, Derived] = 0.25
    """The goal checker's: closer than this the robot only turns to the goal's heading."""
    max_robot_pose_search_dist: Annotated[Metres, Positive] = 3.0
    """How far along the path the nearest pose is searched each time."""
    use_fixed_curvature_lookahead: bool = False
    """Whether curvature is that of the arc to a point curvature_lookahead_dist ahead."""
    curvature_lookahead_dist: Annotated[Metres, Positive] = 0.6
    """Distance of the point for the curvature."""
    interpolate_curvature_after_goal: bool = False
    """Whether that point may lie beyond the goal, in the path's last direction."""
    allow_reversing: bool = False
    """Whether parts of the path whose headings point backwards are driven backwards, from cusp to cusp."""
    inversion_xy_tolerance: Annotated[Metres, Positive] = 0.2
    """How near a cusp is reached."""
    inversion_yaw_tolerance: Annotated[Radians, Positive] = 0.4
    """And in which heading."""
    use_cancel_deceleration: bool = False
    """Whether a cancelled robot follows the path until it stands."""
    cancel_deceleration: Annotated[MetresPerSecondSquared, Positive] = 3.2
    """Its deceleration then."""
    min_distance_to_obstacle: Metres = -1.0
    """Shortest way that is checked for collisions, also where it takes longer; negative: none."""
    max_linear_decel: Annotated[MetresPerSecondSquared, NotNegative] = 0.0
    """Of the robot: the way to a stop from the present speed is always checked; 0: it is not."""
    max_linear_accel: Annotated[MetresPerSecondSquared, NotNegative] = 0.0
    """Of the robot: it is commanded no faster than it can be after its reaction time, and so turns along the
    arc while it speeds up, not past it; 0: any speed may be commanded at once."""
    reaction_time: Annotated[Seconds, NotNegative] = 0.3
    """Part of the way to a stop: age of what the costmap shows, and a command's way to the wheels."""
