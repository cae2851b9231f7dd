"""The node of odometry from clouds, if a scenario's `lidar_odometry` asks for it."""

from __future__ import annotations

from dataclasses import replace

from twin.bridge.msgs import PointCloud2
from twin.bridge.tf import TransformBuffer
from twin.errors import ScenarioError
from twin.nodes.lidar_odometry import LidarOdometryConfig, LidarOdometryNode
from twin.runtime.parameter_files.unpublished_topics import warn_of_unpublished
from twin.runtime.stacks.context import StackContext
from twin.sensors.clouds.cloud_lidar import CloudLidarSpec


def build_lidar_odometry(context: StackContext, buffer: TransformBuffer, base_frame: str) -> None:
    """Create `/lidar_odometry`.

    Raises:
        ScenarioError: The robot has no lidar that makes clouds, and the scenario names no topic.
        CloudError: What registers clouds is not installed.
    """
    asked = context.config.lidar_odometry
    assert asked is not None
    own = [spec for spec in context.handle.description.sensors if isinstance(spec, CloudLidarSpec)]
    config = asked.over(LidarOdometryConfig(base_frame=base_frame))
    if not config.topic:
        if not own:
            raise ScenarioError(
                f"robot '{context.handle.name}' has no lidar that makes clouds; valid is one, or a topic"
            )
        config = replace(config, topic=own[0].topic)
    node = LidarOdometryNode(context.bus, buffer, config, namespace=context.namespace)
    warn_of_unpublished(node.node, {"topic": (config.topic, PointCloud2)})
