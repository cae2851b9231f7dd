"""The frames that cameras' images are in: x to the right, y down, z forward (REP-103)."""

from __future__ import annotations

import numpy as np

from twin.geometry import Pose3
from twin.models.description import RobotDescription
from twin.models.specs import CameraSpec

T_CAMERA_OPTICAL = Pose3(np.zeros(3), np.array([0.5, -0.5, 0.5, -0.5]))
"""From the frame of a camera that looks along +x with +z up."""
_NEAR_M, _NEAR_COS = 1e-3, 0.9999
"""A link that is so near to where a camera looks from, and turned by so little, is its optical frame."""


def optical_frame(description: RobotDescription, camera: CameraSpec) -> tuple[str, bool]:
    """Return the frame that stamps a camera's images, and whether it is a link of the robot.

    It is what the file says; else the link that is fixed to the camera's in the right place; else
    `<name>_optical_frame`, which somebody has to publish.
    """
    if camera.optical_frame is not None:
        frame = camera.optical_frame.strip("/")
        return frame, frame in description.links
    right = camera.T_link_sensor @ T_CAMERA_OPTICAL
    found = [(camera.link, Pose3.from_xyz_rpy())]
    for link, T_link in found:
        off = right.inverse() @ T_link
        if float(np.linalg.norm(off.xyz)) < _NEAR_M and abs(off.quat_wxyz[0]) > _NEAR_COS:
            return link, True
        fixed = (joint for joint in description.children(link) if joint.type == "fixed")
        found += [(joint.child, T_link @ joint.T_parent_joint) for joint in fixed]
    return f"{camera.name}_optical_frame", False
