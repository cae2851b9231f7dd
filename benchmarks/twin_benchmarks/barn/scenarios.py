"""A BARN world as arena and scenario files: what `twin run` takes."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from twin.files.writing import write_whole
from twin_benchmarks.barn.worlds import BarnSet, BarnWorld

ROBOT = "jackal"
_MARGIN = 3.0
"""Of the floor around all that matters [m]."""


@dataclass(frozen=True, kw_only=True)
class BarnOptions:
    """What may be different from one benchmark run to the next."""

    seed: int = 1
    """Of all noise, in the first run of a world."""
    runs: int = 1
    """Of each world; each has the seed after the one before."""
    max_speed: float = 2.0
    """Of the robot [m/s]."""
    noise: bool = True
    """Whether the lidar is noisy."""
    command_latency: float = 0.06
    """Between a command and the motors [s]."""
    overrides: tuple[tuple[str, str], ...] = ()
    """More changes of the scenario: dotted path and YAML text."""


def write(folder: Path, world: BarnWorld, rules: BarnSet, options: BarnOptions) -> Path:
    """Write `arena.yaml` and `scenario.yaml` of a world into a folder; return the scenario's path."""
    folder.mkdir(parents=True, exist_ok=True)
    _dump(folder / "arena.yaml", arena(world, rules))
    path = folder / "scenario.yaml"
    _dump(path, scenario(world, rules, options))
    return path


def arena(world: BarnWorld, rules: BarnSet) -> dict[str, Any]:
    """Return the arena file's content."""
    xs = [x for x, _ in world.obstacles] + [rules.start.x, rules.goal[0]]
    ys = [y for _, y in world.obstacles] + [rules.start.y, rules.goal[1]]
    content: dict[str, Any] = {
        "name": f"barn_{world.id:03d}",
        "hall": {
            "x": [min(xs) - _MARGIN, max(xs) + _MARGIN],
            "y": [min(ys) - _MARGIN, max(ys) + _MARGIN],
            "walls": False,
        },
        "poses": {"start": list(rules.start), "goal": [*rules.goal, rules.start.yaw]},
    }
    if world.obstacles:
        content["cylinders"] = {
            "cylinders": {
                "radius": rules.radius,
                "height": rules.height,
                "colour": "orange",
                "centres": [list(centre) for centre in world.obstacles],
            }
        }
    return content


def scenario(world: BarnWorld, rules: BarnSet, options: BarnOptions) -> dict[str, Any]:
    """Return the scenario file's content."""
    robot: dict[str, Any] = {
        "model": ROBOT,
        "start": "start",
        "command_latency": options.command_latency,
        "localisation": {"type": "odometry", "use_imu": True},
        "navigation": navigation(options),
    }
    if not options.noise:
        robot["args"] = {"lidar_noise": "0.0"}
    return {
        "name": f"barn_{world.id:03d}",
        "description": f"World {world.id} of BARN: ten metres ahead through cylinders, without a map.",
        "seed": options.seed,
        "duration": 2.0 * round((rules.timeout_s + 10.0) / 2.0),
        "world": {"arena": "./arena.yaml"},
        "robots": [robot],
        "mission": {
            "type": "behaviors",
            "robot": ROBOT,
            "steps": [
                {
                    "navigate_to_pose": {
                        "x": rules.goal[0],
                        "y": rules.goal[1],
                        "yaw": rules.start.yaw,
                    }
                }
            ],
        },
        "checks": [
            {"mission_succeeded": None},
            {"time_limit": {"limit": rules.timeout_s}},
            {"no_collision": None},
        ],
    }


def navigation(options: BarnOptions) -> dict[str, Any]:
    """Return the navigation's parameters: rolling costmaps, plans that are made anew all the time."""
    return {
        "max_linear_speed": options.max_speed,
        "max_angular_speed": 3.0,
        "max_linear_acceleration": 2.0,
        "max_linear_deceleration": 3.0,
        "max_angular_acceleration": 8.0,
        "navigator": {"default_nav_to_pose_bt_xml": "navigate_w_replanning", "bt_loop_frequency": 50.0},
        # What is tuned for this benchmark: nothing there moves, and time is all that counts.
        "collision_monitor": {"enabled": False},
        "planner": {
            "plugin": "grid_based",
            "tolerance": 0.5,
            "allow_unknown": True,
            "cost_factor": 6.0,
            "commitment_cost": 20,
        },
        "global_costmap": {
            "rolling_window": True,
            "resolution": 0.04,
            "robot_radius": 0.27,
            "width": 10.0,
            "height": 22.0,
            "inflation_radius": 0.8,
            "cost_scaling_factor": 4.0,
            "update_frequency": 10.0,
            "obstacle_max_range": 10.0,
            "raytrace_max_range": 10.0,
        },
        "local_costmap": {
            "resolution": 0.025,
            "width": 4.5,
            "height": 4.5,
            "inflation_radius": 0.6,
            "cost_scaling_factor": 4.0,
            "update_frequency": 25.0,
            "obstacle_max_range": 3.5,
            "raytrace_max_range": 3.5,
        },
        "controller": {
            "controller_frequency": 25.0,
            "desired_linear_vel": min(1.4, options.max_speed),
            "min_lookahead_dist": 0.35,
            "max_lookahead_dist": 1.0,
            "lookahead_time": 0.65,
            "regulated_linear_scaling_min_radius": 0.9,
            "regulated_linear_scaling_min_speed": 0.3,
            "cost_scaling_dist": 0.6,
            "cost_scaling_gain": 1.0,
            "turn_before_collision": True,
            "max_linear_decel": 0.0,
            "failure_tolerance": 0.3,
            "progress_checker": "pose",
            "required_movement_radius": 0.2,
            "movement_time_allowance": 2.5,
            "rotate_to_heading_min_angle": 1.2,
            "rotate_to_heading_angular_vel": 2.0,
            "max_angular_accel": 6.0,
            "xy_goal_tolerance": 0.25,
            "yaw_goal_tolerance": 3.14,
        },
    }


def _dump(path: Path, content: dict[str, Any]) -> None:
    write_whole(path, yaml.safe_dump(content, sort_keys=False, default_flow_style=None))
