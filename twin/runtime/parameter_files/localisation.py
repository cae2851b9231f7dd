"""Which parameter files hold odometry's filter and SLAM: their own, else that of navigation."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from twin.errors import NavigationError, Problem
from twin.nodes.navigation.localisation.ekf_config import EkfNodeConfig
from twin.parameters.declaration import names_of
from twin.runtime.parameter_files.nav2.file import Nav2Parameters
from twin.scenario.robots import RobotConfig

EKF, SLAM = "ekf_filter_node", "slam_toolbox"
_PATTERNS = {EKF: r"(odom|pose|twist|imu)\d+", SLAM: "solver_plugin|max_laser_range|minimum_travel_distance"}
"""By what their sections are known, whatever these are called."""


def file_for(usual: str, config: RobotConfig, namespace: str) -> tuple[Nav2Parameters, str] | None:
    """Return the file for a node and what the node is called in it; None without a file.

    Args:
        usual: EKF or SLAM.
        config: The robot's.
        namespace: Of the robot.

    Raises:
        NavigationError: the file is none, its own file has no such node, or several and none of that name.
    """
    own = getattr(config.odometry if usual == EKF else config.localisation, "params_file", None)
    path = own or (config.navigation.params_file if config.navigation is not None else None)
    if path is None:
        return None
    file = Nav2Parameters(Path(path), namespace)
    names = file.nodes_with(_PATTERNS[usual], usual)
    if len(names) > 1 and usual == EKF:
        names = [name for name in names if not corrects_map(file.effective(name))] or names
    if not names and own is None:
        return None
    if len(names) != 1:
        held = f"several: {', '.join(names)}" if names else "none"
        said = f"one node is to be read as {usual}, and it has {held}; valid is one, or one of that name"
        raise NavigationError(Problem(said, file.path))
    return file, names[0]


def corrects_map(values: Mapping[str, object]) -> bool:
    """Whether a filter's parameters make it publish map → odom, as the second one of two does."""
    names = names_of(EkfNodeConfig)
    odom = values.get(names.odom_frame, "odom")
    return values.get(names.world_frame, odom) != odom


def localisation_nodes(config: RobotConfig, namespace: str) -> tuple[str, ...]:
    """Return which nodes of navigation's file are read for odometry and SLAM.

    Raises:
        NavigationError: as `file_for`.
    """
    odometry, localisation = config.odometry, config.localisation
    asked = [EKF] if odometry.type == "ekf" and odometry.params_file is None else []
    if localisation is not None and localisation.type == "slam" and localisation.params_file is None:
        asked.append(SLAM)
    return tuple(found[1] for usual in asked if (found := file_for(usual, config, namespace)) is not None)


def differing(file: Nav2Parameters, node: str, frames: Mapping[str, str]) -> list[str]:
    """Return a sentence if the file has other frames than the robot, whose own count.

    Args:
        file: What was read.
        node: Its name in the file.
        frames: Parameter -> the robot's frame.
    """
    file.understood(node, *frames)
    values = file.effective(node)
    others = [
        f"{name} is {own}, not {values[name]}"
        for name, own in frames.items()
        if name in values and values[name] != own
    ]
    return [f"{file.path.name}: {node}: the robot's own {', '.join(others)}"] if others else []
