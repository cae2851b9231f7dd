"""Costmaps, planners, controllers and guards that are set wrongly, or missing."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from twin.experiments.mutants.catalogue import edits, installs
from twin.experiments.mutants.mutant import Mutant, NotHere, Site
from twin.runtime.defaults import from_description


def _sets(says: str, **groups: Mapping[str, Any]) -> type[Mutant]:
    """Make a mutant that sets keys in groups of every robot's navigation."""

    def change(data: dict[str, Any]) -> None:
        for navigation in navigating(data):
            for name, keys in groups.items():
                group(navigation, name).update(keys)

    change.__doc__ = says
    return edits(change)


@installs
def small_footprint(site: Site) -> None:
    """The robot takes itself to be half as long and wide as it is."""
    real = from_description.footprint
    site.patch(from_description, "footprint", lambda *args, **options: 0.5 * real(*args, **options))


_THIN = {"inflation_radius": "5 cm", "cost_scaling_factor": 100.0}
_BLIND = {"plugins": ["inflation_layer"]}

small_inflation = _sets(
    "Obstacles are hardly inflated: paths touch them.", global_costmap=_THIN, local_costmap=_THIN
)
no_collision_monitor = _sets(
    "Nobody looks at commands that lead into obstacles.", collision_monitor={"enabled": False}
)
stale_costmap = _sets(
    "The costmap around the robot is made anew only every 5 s.", local_costmap={"update_frequency": "0.2 Hz"}
)
blind_costmap = _sets(
    "No costmap takes in what the lidar sees.",
    global_costmap={"plugins": ["static_layer", "inflation_layer"]},
    local_costmap=_BLIND,
)
blind_planner = _sets("Paths are planned without the map.", global_costmap=_BLIND)
coarse_goal = _sets(
    "Half a metre and 60 degrees before its goal the robot takes itself to be there.",
    controller={"xy_goal_tolerance": "0.5 m", "yaw_goal_tolerance": "60 deg"},
)
no_recovery = _sets(
    "A robot that is stuck does nothing about it.",
    controller={"maneuvers": False},
    navigator={"default_nav_to_pose_bt_xml": "navigate_w_replanning"},
)
hasty_controller = _sets(
    "The controller cuts curves at full speed, and looks for no collision.",
    controller={
        "use_regulated_linear_velocity_scaling": False,
        "use_cost_regulated_linear_velocity_scaling": False,
        "use_collision_detection": False,
        **dict.fromkeys(("lookahead_dist", "min_lookahead_dist", "max_lookahead_dist"), "1.5 m"),
    },
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
