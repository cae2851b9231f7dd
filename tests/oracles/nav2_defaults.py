"""Nav2's own defaults, for tests of ours, read from a clone of navigation2:

    python tests/oracles/nav2_defaults.py navigation2        # writes tests/oracles/nav2_defaults.json

Of each component the parameters that its sources declare with a number or a truth value. A name that is
declared with several values is left out. The committed file is of Nav2's main branch at a3a97043ee93.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

OUTPUT = Path(__file__).with_suffix(".json")
_CRITICS = (
    "constraint",
    "cost",
    "goal",
    "goal_angle",
    "obstacles",
    "path_align",
    "path_angle",
    "path_follow",
)
_CRITICS = (*_CRITICS, "prefer_forward", "twirling", "velocity_deadband")
_COSTMAP, _CONTROLLER = "nav2_costmap_2d", "nav2_controller/plugins"
COMPONENTS = {
    "amcl": ("nav2_amcl/src",),
    "behaviors": ("nav2_behaviors/plugins", "nav2_behaviors/include"),
    "collision monitor": ("nav2_collision_monitor/src/polygon.cpp",),
    "costmap": (
        *(f"{_COSTMAP}/src/costmap_2d_ros.cpp", f"{_COSTMAP}/plugins/inflation_layer.cpp"),
        f"{_COSTMAP}/plugins/obstacle_layer.cpp",
    ),
    "docking controller": ("nav2_docking/opennav_docking/src/controller.cpp",),
    "dwb": ("nav2_dwb_controller",),
    "goal checker": tuple(
        f"{_CONTROLLER}/{name}_goal_checker.cpp" for name in ("position", "simple", "stopped")
    ),
    "keepout filter": (f"{_COSTMAP}/plugins/costmap_filters/keepout_filter.cpp",),
    "mppi": ("nav2_mppi_controller/src/optimizer.cpp",),
    **{f"mppi {name}": (f"nav2_mppi_controller/src/critics/{name}_critic.cpp",) for name in _CRITICS},
    "mppi visualizer": ("nav2_mppi_controller/src/trajectory_visualizer.cpp",),
    "path handler": (f"{_CONTROLLER}/feasible_path_handler.cpp",),
    "progress checker": (f"{_CONTROLLER}/*progress_checker.cpp",),
    "range sensor layer": (f"{_COSTMAP}/plugins/range_sensor_layer.cpp",),
    "regulated pure pursuit": ("nav2_regulated_pure_pursuit_controller/src",),
    "rotation shim": ("nav2_rotation_shim_controller/src",),
    "savitzky-golay smoother": ("nav2_smoother/src/savitzky_golay_smoother.cpp",),
    "simple smoother": ("nav2_smoother/src/simple_smoother.cpp",),
    "smac hybrid": ("nav2_smac_planner/include/nav2_smac_planner/smac_planner_hybrid_impl.hpp",),
    "navfn": ("nav2_navfn_planner/src/parameter_handler.cpp",),
    "theta star": ("nav2_theta_star_planner/src/parameter_handler.cpp",),
}
_DECLARED = re.compile(
    r'"(?:[a-z]\w*\.)?\.?(\w+)",\s*(?:rclcpp::ParameterValue\()?(-?\d[\d.]*(?:e-?\d+)?|true|false)f?\)'
)


def compared(component: str, config: Any) -> tuple[int, dict[str, Any]]:
    """Return how many parameters both have, and our defaults, by name, of those that are not Nav2's."""
    theirs = json.loads(OUTPUT.read_text("utf-8"))[component]
    ours = {name: getattr(config, name) for name in theirs if hasattr(config, name)}
    return len(ours), {name: value for name, value in ours.items() if value != theirs[name]}


def main() -> None:
    repository, found = sys.argv[1], {}
    for component, places in COMPONENTS.items():
        listed = ("git", "-C", repository, "grep", "-h", "", "HEAD", "--", *places, ":!*/test/*")
        text = subprocess.run(listed, capture_output=True, text=True, check=True).stdout
        values: dict[str, set[object]] = {}
        for name, value in _DECLARED.findall(text):
            values.setdefault(name, set()).add(json.loads(value.rstrip(".") if "." in value[-1:] else value))
        found[component] = {name: v.pop() for name, v in sorted(values.items()) if len(v) == 1}
    OUTPUT.write_text(json.dumps(found, indent=1) + "\n", "utf-8")


if __name__ == "__main__":
    main()
