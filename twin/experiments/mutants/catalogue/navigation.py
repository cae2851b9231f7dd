"""Costmaps, planners, controllers and guards that are set wrongly, or missing."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from twin.experiments.mutants.catalogue import edits, installs
from twin.experiments.mutants.mutant import NotHere, Site
from twin.runtime.defaults import from_description


@edits
def small_inflation(data: dict[str, Any]) -> None:
    """Obstacles are hardly inflated: paths touch them."""
    for navigation in navigating(data):
        for name in ("global_costmap", "local_costmap"):
            group(navigation, name).update(inflation_radius="5 cm", cost_scaling_factor=100.0)


@installs
def small_footprint(site: Site) -> None:
    """The robot takes itself to be half as long and wide as it is."""
    real = from_description.footprint
    site.patch(from_description, "footprint", lambda *args, **options: 0.5 * real(*args, **options))


@edits
def no_collision_monitor(data: dict[str, Any]) -> None:
    """Nobody looks at commands that lead into obstacles."""
    for navigation in navigating(data):
        group(navigation, "collision_monitor")["enabled"] = False


@edits
def stale_costmap(data: dict[str, Any]) -> None:
    """The costmap around the robot is made anew only every 5 s."""
    for navigation in navigating(data):
        group(navigation, "local_costmap")["update_frequency"] = "0.2 Hz"


@edits
def blind_costmap(data: dict[str, Any]) -> None:
    """No costmap takes in what the lidar sees."""
    for navigation in navigating(data):
        group(navigation, "global_costmap")["plugins"] = ["static_layer", "inflation_layer"]
        group(navigation, "local_costmap")["plugins"] = ["inflation_layer"]


@edits
def blind_planner(data: dict[str, Any]) -> None:
    """Paths are planned without the map."""
    for navigation in navigating(data):
        group(navigation, "global_costmap")["plugins"] = ["inflation_layer"]


@edits
def coarse_goal(data: dict[str, Any]) -> None:
    """Half a metre and 60 degrees before its goal the robot takes itself to be there."""
    for navigation in navigating(data):
        group(navigation, "controller").update(xy_goal_tolerance="0.5 m", yaw_goal_tolerance="60 deg")


@edits
def no_recovery(data: dict[str, Any]) -> None:
    """A robot that is stuck does nothing about it."""
    for navigation in navigating(data):
        group(navigation, "controller")["maneuvers"] = False
        group(navigation, "navigator")["default_nav_to_pose_bt_xml"] = "navigate_w_replanning"


@edits
def hasty_controller(data: dict[str, Any]) -> None:
    """The controller cuts curves at full speed, and looks for no collision."""
    for navigation in navigating(data):
        group(navigation, "controller").update(
            use_regulated_linear_velocity_scaling=False,
            use_cost_regulated_linear_velocity_scaling=False,
            use_collision_detection=False,
            lookahead_dist="1.5 m",
            min_lookahead_dist="1.5 m",
            max_lookahead_dist="1.5 m",
        )


def navigating(data: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield the navigation of each robot that has it, to be changed in place."""
    robots = [robot for robot in data["robots"] if "navigation" in robot]
    if not robots:
        raise NotHere("no robot navigates")
    for robot in robots:
        yield group(robot, "navigation")


def group(holder: dict[str, Any], key: str) -> dict[str, Any]:
    """Return a group of keys, made if it is missing or empty."""
    holder[key] = group = holder.get(key) or {}
    return group
