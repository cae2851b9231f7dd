"""slam_toolbox's parameter files: what `/slam_toolbox` takes of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

from twin.errors import MapError
from twin.files.reading import read_bytes
from twin.geometry import Pose2
from twin.navigation.mapping.config import Mode
from twin.navigation.mapping.mapped_scans import unpack
from twin.nodes.navigation.mapping.config import SlamNodeConfig
from twin.nodes.navigation.robot_pose import Frames
from twin.parameters.declaration import names_of
from twin.runtime.parameter_files.absent import Absent
from twin.runtime.parameter_files.localisation import SLAM, differing, file_for
from twin.runtime.parameter_files.nav2.file import Nav2Parameters
from twin.scenario.localisation import SlamLocalisation
from twin.scenario.robots import RobotConfig

_SLAM = names_of(SlamNodeConfig)
_BY_ITSELF = (_SLAM.mode, _SLAM.map_file_name, _SLAM.map_start_pose)
"""Read together: the last means something only with a graph."""
_SUFFIX = ".posegraph"
_IDLE = frozenset(
    {
        *("solver_plugin", "ceres_linear_solver", "ceres_preconditioner", "ceres_trust_strategy"),
        *("ceres_dogleg_type", "debug_logging", "stack_size_to_use", "tf_buffer_duration"),
        *("enable_interactive_mode", "use_map_saver", "map_name", "scan_queue_size", "use_sim_time"),
        "paused_new_measurements",
    }
)
_HARMLESS = {
    "ceres_loss_function": "None",
    "use_scan_matching": True,
    "map_start_at_dock": False,
    "restamp_tf": False,
    "position_covariance_scale": 1.0,
    "yaw_covariance_scale": 1.0,
}
_MISSED = frozenset(
    {
        *("use_scan_barycenter", "minimum_time_interval", "link_scan_maximum_distance"),
        *("loop_match_maximum_variance_coarse", "fine_search_angle_offset", "coarse_angle_resolution"),
        *("use_response_expansion", "min_pass_through", "occupancy_threshold"),
        *("check_min_dist_and_heading_precisely", "transform_publish_period"),
    }
)


def slam_with_file(
    config: SlamNodeConfig, robot: RobotConfig, frames: Frames, namespace: str
) -> tuple[SlamNodeConfig, Pose2 | None, list[str]]:
    """Return the node's config with a file's values, its start in `map`, and what was not understood.

    Args:
        config: What holds without the file.
        robot: What the scenario says of the robot, whose localisation is SLAM; it goes before the file.
        frames: The robot's.
        namespace: Of the robot.

    Raises:
        NavigationError: the file is wrong.
    """
    found, localisation = file_for(SLAM, robot, namespace), robot.localisation
    assert isinstance(localisation, SlamLocalisation)
    if found is None:
        return config, None, []
    file, node = found
    values = file.effective(node)
    told = differing(
        file, node, {"map_frame": frames.map, "odom_frame": frames.odom, "base_frame": frames.base}
    )
    config, start = _graph(file, node, replace(config, mode=_mode(file, node, localisation)), localisation)
    given = frozenset(localisation.parameters.overrides())
    config = file.applied(
        node,
        config,
        keep=given | frozenset(_BY_ITSELF),
        absent=_absent(values),
    )
    config = replace(config, scan_topic=file.relative(config.scan_topic))
    return config, start, [*(file.finish() if localisation.params_file else file.ignored()), *told]


def _mode(file: Nav2Parameters, node: str, localisation: SlamLocalisation) -> Mode:
    said = file.effective(node).get(_SLAM.mode, localisation.mode)
    if _SLAM.mode in localisation.model_fields_set:
        return localisation.mode
    modes: tuple[Mode, ...] = get_args(Mode)
    if said in modes:
        return modes[modes.index(said)]
    file.wrong(node, _SLAM.mode, f"must be {' or '.join(modes)}, not {said!r}")
    return localisation.mode


def _graph(
    file: Nav2Parameters, node: str, config: SlamNodeConfig, localisation: SlamLocalisation
) -> tuple[SlamNodeConfig, Pose2 | None]:
    """Return the config with its pose graph, and where in it the robot starts."""
    values = file.effective(node)
    name = config.map_file_name
    if not name and values.get(_SLAM.map_file_name):
        name = str(_saved(file, node, str(values[_SLAM.map_file_name])))
    if not name and config.mode == "localization":
        said = "is localization, which needs map_file_name, or the scenario's pose_graph"
        file.wrong(node, _SLAM.mode, said)
    pose = values.get(_SLAM.map_start_pose)
    if not name or pose is None:
        return replace(config, map_file_name=name), None
    if not (isinstance(pose, list) and len(pose) == 3 and all(type(part) in (int, float) for part in pose)):
        file.wrong(node, _SLAM.map_start_pose, f"must be [x, y, yaw], not {pose!r}")
        return config, None
    return replace(config, map_file_name=name), Pose2(*map(float, pose))


def _saved(file: Nav2Parameters, node: str, name: str) -> Path:
    """Return the file of a pose graph, whose name slam_toolbox has without its suffix."""
    plain = file.path.parent / name
    path = plain if plain.suffix == _SUFFIX else plain.with_name(plain.name + _SUFFIX)
    try:
        unpack(read_bytes(path), str(path))
    except OSError as fault:
        file.wrong(node, _SLAM.map_file_name, f"is {name}, but {path}: {fault.strerror}")
    except MapError as fault:
        file.wrong(node, _SLAM.map_file_name, f"is {name}, but {fault}")
    return path


def _absent(values: Mapping[str, Any]) -> Absent:
    publishes = values.get("transform_publish_period") != 0
    idle = _IDLE | {"transform_publish_period"} if publishes else _IDLE
    return Absent(idle=idle, harmless=_HARMLESS, missed=_MISSED)
