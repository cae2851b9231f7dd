"""The node that finds what a gripper is to take: in the scans of its palm, or in the images of a camera."""

from __future__ import annotations

from typing import TYPE_CHECKING

from twin.errors import ScenarioError, nearest
from twin.nodes.navigation.robot_pose import RobotPose
from twin.runtime.stacks.context import StackContext

if TYPE_CHECKING:
    from twin.scenario.picture_detectors import PictureDetectorEntry


def build_tote_detector(context: StackContext, robot_pose: RobotPose) -> None:
    """Create `/tote_detector`.

    Raises:
        ScenarioError: The robot has no camera that its detector can look through.
        SimulationError: Its camera cannot make images on this computer.
    """
    config = context.config
    if config.picture_detector is not None:
        _build_for_pictures(context, robot_pose, config.picture_detector)
        return
    from twin.nodes.tote_detector import ToteDetectorNode

    detector = None if config.detector is None else config.detector.build()
    ToteDetectorNode(context.bus, robot_pose, detector, namespace=context.namespace)


def _build_for_pictures(context: StackContext, robot_pose: RobotPose, entry: PictureDetectorEntry) -> None:
    from twin.nodes.cameras.tote_detector import PictureToteDetectorNode

    detector, handle = entry.build(), context.handle
    wants_colours = detector.wants_colours
    what = "images of depth and colours" if wants_colours else "images of depth"
    cameras = {
        spec.name: spec
        for spec in handle.description.cameras
        if spec.depth and (spec.colour or not wants_colours)
    }
    name = getattr(detector.config, "camera", "") or (next(iter(cameras)) if len(cameras) == 1 else "")
    if not cameras:
        raise ScenarioError(f"robot '{handle.name}' has no camera that makes {what} in which to find boxes")
    if not name:
        raise ScenarioError(
            f"robot '{handle.name}' has several cameras that make {what}; picture_detector must say which: "
            f"camera is one of {', '.join(cameras)}"
        )
    if name not in cameras:
        raise ScenarioError(
            f"robot '{handle.name}' has no camera '{name}' that makes {what}; {nearest(name, cameras)}"
        )
    if context.config.cameras is None:
        # Told now, not when the robot has come to the shelf.
        for camera in handle.cameras:
            if camera.spec.name == name:
                camera.open()
    PictureToteDetectorNode(
        context.bus, robot_pose, detector, cameras[name].topics, namespace=context.namespace
    )
