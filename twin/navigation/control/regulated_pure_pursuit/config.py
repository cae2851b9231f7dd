"""Parameters of regulated pure pursuit."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class RegulatedPurePursuitConfig:
    """Parameters; names and defaults are those of nav2_regulated_pure_pursuit_controller."""

    desired_linear_vel: float = 0.5
    """[m/s]"""
    lookahead_dist: float = 0.6
    """[m]"""
    min_lookahead_dist: float = 0.3
    """[m]"""
    max_lookahead_dist: float = 0.9
    """[m]"""
    lookahead_time: float = 1.5
    """[s]"""
    use_velocity_scaled_lookahead_dist: bool = False
    use_regulated_linear_velocity_scaling: bool = True
    regulated_linear_scaling_min_radius: float = 0.9
    """Turns tighter than this are driven slower [m]."""
    regulated_linear_scaling_min_speed: float = 0.25
    """[m/s]"""
    use_cost_regulated_linear_velocity_scaling: bool = True
    cost_scaling_dist: float = 0.6
    """Closer to an obstacle than this the robot slows down [m]."""
    cost_scaling_gain: float = 1.0
    use_rotate_to_heading: bool = True
    rotate_to_heading_angular_vel: float = 1.8
    """[rad/s]"""
    rotate_to_heading_min_angle: float = 0.785
    """[rad]"""
    max_angular_accel: float = 3.2
    """[rad/s²]"""
    approach_velocity_scaling_dist: float = 0.6
    """[m]"""
    min_approach_linear_velocity: float = 0.05
    """[m/s]"""
    use_collision_detection: bool = True
    max_allowed_time_to_collision_up_to_carrot: float = 1.0
    """[s]"""
    turn_before_collision: bool = False
    """Where the arc to the lookahead point is blocked: whether to turn towards that point on the spot, or to
    creep along the arc, before giving up (ours, not Nav2's)."""
    creep_speed: float = 0.15
    """Of that creeping [m/s]."""
    xy_goal_tolerance: float = 0.25
    """The goal checker's: closer than this the robot only turns to the goal's heading [m]."""
    max_robot_pose_search_dist: float = 3.0
    """How far along the path the nearest pose is searched each time [m]."""
    use_fixed_curvature_lookahead: bool = False
    """Whether curvature is that of the arc to a point curvature_lookahead_dist ahead."""
    curvature_lookahead_dist: float = 0.6
    """[m]"""
    interpolate_curvature_after_goal: bool = False
    """Whether that point may lie beyond the goal, in the path's last direction."""
    allow_reversing: bool = False
    """Whether parts of the path whose headings point backwards are driven backwards, from cusp to cusp."""
    inversion_xy_tolerance: float = 0.2
    """How near a cusp is reached [m]."""
    inversion_yaw_tolerance: float = 0.4
    """[rad]"""
    use_cancel_deceleration: bool = False
    """Whether a cancelled robot follows the path until it stands."""
    cancel_deceleration: float = 3.2
    """[m/s²]"""
    min_distance_to_obstacle: float = -1.0
    """Shortest way that is checked for collisions, also where it takes longer; negative: none [m]."""
    max_linear_decel: float = 0.0
    """Of the robot: the way to a stop from the present speed is always checked; 0: it is not [m/s²]."""
    reaction_time: float = 0.3
    """Part of the way to a stop: age of what the costmap shows, and a command's way to the wheels [s]."""
