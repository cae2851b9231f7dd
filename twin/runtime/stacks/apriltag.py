"""The node that finds tags, if a scenario's `apriltag` asks for it."""

from __future__ import annotations

from twin.errors import ScenarioError, nearest
from twin.nodes.cameras.apriltag import AprilTagNode, AprilTagNodeConfig
from twin.runtime.stacks.context import StackContext
from twin.scenario.apriltag import AprilTagParameters


def build_apriltag(context: StackContext, parameters: AprilTagParameters) -> None:
    """Create `/apriltag` for one camera of a robot.

    Raises:
        ScenarioError: The robot has no such camera; OpenCV is not installed.
    """
    robot = context.handle.name
    cameras = {spec.name: spec for spec in context.handle.description.cameras if spec.colour}
    if not cameras:
        raise ScenarioError(f"robot '{robot}' has no camera that makes images in which to find tags")
    name = parameters.camera or next(iter(cameras))
    if name not in cameras:
        raise ScenarioError(f"robot '{robot}' has no camera '{name}'; {nearest(name, cameras)}")
    topics = cameras[name].topics
    AprilTagNode(
        context.bus,
        parameters.over(AprilTagNodeConfig()),
        image=topics.image,
        info=topics.info,
        namespace=context.namespace,
    )
