"""robot_localization's parameter files: what `/ekf_filter_node` takes of them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from twin.navigation.localisation.ekf import SIZE
from twin.nodes.navigation.localisation.ekf_config import SOURCE, EkfNodeConfig, EkfSource
from twin.parameters.declaration import names_of
from twin.runtime.parameter_files.absent import Absent
from twin.runtime.parameter_files.localisation import EKF, corrects_map, differing, file_for
from twin.scenario.robots import RobotConfig

_OUTPUT = "odometry/filtered"
_EKF = names_of(EkfNodeConfig)
_FRAMES = (_EKF.map_frame, _EKF.odom_frame, _EKF.base_link_frame, _EKF.world_frame)
_CONTROL = frozenset(
    {
        *("control_config", "control_timeout", "stamped_control"),
        *("acceleration_limits", "acceleration_gains", "deceleration_limits", "deceleration_gains"),
    }
)
_IDLE = frozenset(
    {
        *("nodelay", "print_diagnostics", "debug", "debug_out_file", "silent_tf_failure"),
        # The filter here predicts to the present at every output, and waits for no transform.
        *("sensor_timeout", "predict_to_current_time", "permit_corrected_publication", "transform_timeout"),
        *("use_sim_time", "diagnostics_updater.period"),
    }
)
_HARMLESS = {
    "publish_acceleration": False,
    "dynamic_process_noise_covariance": False,
    "use_control": False,
    "reset_on_time_jump": False,
    "disabled_at_startup": False,
    "pose_use_child_frame": False,
    "gravitational_acceleration": 9.80665,
    "initial_state": [0.0] * SIZE,
}
_MISSED = frozenset({"base_link_frame_output", "tf_prefix"})


def ekf_with_file(
    config: EkfNodeConfig, robot: RobotConfig, namespace: str, bias_stddevs: Mapping[str, float]
) -> tuple[EkfNodeConfig, list[str]]:
    """Return the filter's config with a file's values, and what of them was not understood.

    Sources are those of the file alone; what else it does not say stays as it is.

    Args:
        config: What holds without the file.
        robot: What the scenario says of the robot.
        namespace: Of the robot.
        bias_stddevs: Topic of an IMU -> standard deviation of its gyroscope's bias [rad/s].

    Raises:
        NavigationError: the file is wrong.
    """
    found = file_for(EKF, robot, namespace)
    if found is None:
        return config, []
    file, node = found
    values = file.effective(node)
    own = {name: getattr(config, name) for name in _FRAMES}
    frames = differing(file, node, own)
    if corrects_map(values):
        said = f"is {values[_EKF.world_frame]}, but a filter of odometry publishes odom → base; valid is odom"
        file.wrong(node, _EKF.world_frame, said)
    nothing = (False,) * SIZE
    named = [name for name in values if re.fullmatch(SOURCE, name)]
    config = file.applied(
        node,
        replace(config, sources={name: EkfSource(topic=name, config=nothing) for name in named}),
        keep=frozenset(_FRAMES),
        rename=_renamed,
        absent=_absent(values),
    )
    sources = {}
    for name, source in config.sources.items():
        topic = file.relative(source.topic)
        if topic == _OUTPUT:
            file.wrong(node, name, f"is {topic}, which the filter itself publishes")
        sources[name] = replace(source, topic=topic, bias_stddev=bias_stddevs.get(topic, source.bias_stddev))
    idle = [name for name, source in sources.items() if not any(source.config)]
    told = [f"{file.path.name}: {node} takes nothing from {', '.join(idle)}: config is false"] if idle else []
    # Of navigation's file other nodes are told elsewhere.
    missed = file.finish() if getattr(robot.odometry, "params_file", None) else file.ignored()
    return replace(config, sources=sources), [*missed, *frames, *told]


def _renamed(name: str) -> str:
    """Return 'pose0_pose_rejection_threshold' for 'pose0_rejection_threshold', as twist0 has its own, too."""
    return re.sub(r"^((pose|twist)\d+)_rejection_threshold$", r"\1_\2_rejection_threshold", name)


def _absent(values: Mapping[str, Any]) -> Absent:
    controls = values.get("use_control") is True
    sections = ["", *(f"{name}_" for name in values if re.fullmatch(SOURCE, name))]
    idle = _IDLE if controls else _IDLE | _CONTROL
    return Absent(
        idle=frozenset(section + name for section in sections for name in idle),
        harmless={section + name: value for section in sections for name, value in _HARMLESS.items()},
        missed=_MISSED | _CONTROL,
    )
