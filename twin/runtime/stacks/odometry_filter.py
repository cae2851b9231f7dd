"""The filter that fuses wheels and IMU, if a scenario's `odometry` asks for it."""

from __future__ import annotations

from dataclasses import replace

from twin.errors import ScenarioError
from twin.nodes.navigation.localisation.ekf import EkfNode
from twin.nodes.navigation.localisation.ekf_config import EkfNodeConfig, EkfSource, for_robot
from twin.nodes.navigation.localisation.ekf_sources import KINDS
from twin.nodes.navigation.robot_pose import Frames
from twin.runtime.parameter_files.ekf import ekf_with_file
from twin.runtime.parameter_files.unpublished_topics import warn_of_unpublished
from twin.runtime.stacks.context import StackContext
from twin.scenario.estimators.ekf import EkfParameters
from twin.sensors.imu import ImuSpec


def odometry_filter(context: StackContext, frames: Frames) -> tuple[EkfNodeConfig, list[str]]:
    """Return the filter that the scenario asks for, and what of its parameter file was not understood.

    Raises:
        ScenarioError: the robot has no drive, or no IMU where no parameter file names other sources.
        NavigationError: the parameter file is wrong.
    """
    odometry = context.config.odometry
    assert odometry.type == "ekf"
    description = context.handle.description
    imus = _imus(context)
    imu = (imus[0].topic, imus[0].gyro_bias_stddev) if imus else ("imu", 1e-3)
    default = for_robot(frames.odom, frames.base, context.control_period_ns, *imu)
    stddevs = {spec.topic: spec.gyro_bias_stddev for spec in imus}
    config, told = ekf_with_file(default, context.config, context.namespace, stddevs)
    lacks = "drive" if description.drive is None else "IMU" if not imus and config is default else ""
    if lacks:
        raise ScenarioError(
            f"robot '{context.handle.name}' has no {lacks}; "
            "odometry of type ekf needs both, type wheels needs no IMU"
        )
    return _with_overrides(config, odometry.parameters), told


def warn_of_unpublished_sources(context: StackContext, node: EkfNode) -> None:
    """Warn of sources that nobody publishes, once all nodes of the robot are there."""
    own = {"odom", *(spec.topic for spec in _imus(context))}
    warn_of_unpublished(
        node.node,
        {
            name: (source.topic, KINDS[name.rstrip("0123456789")])
            for name, source in node.config.sources.items()
            if source.topic not in own
        },
    )


def _imus(context: StackContext) -> list[ImuSpec]:
    return [spec for spec in context.handle.description.sensors if isinstance(spec, ImuSpec)]


def _with_overrides(config: EkfNodeConfig, parameters: EkfParameters) -> EkfNodeConfig:
    """Return a filter's config with the scenario's overrides, sources by name."""
    sources = dict(config.sources)
    for name, given in parameters.sources.items():
        changes = {key: value for key, value in given.overrides().items() if value is not None}
        try:
            sources[name] = replace(sources[name], **changes) if name in sources else EkfSource(**changes)
        except TypeError:
            raise ScenarioError(f"source {name} of odometry of type ekf needs a topic and a config") from None
    return replace(parameters.over(config), sources=sources)
