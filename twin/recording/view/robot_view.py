"""A robot alone in the viewer: its layers once, and where its joints stand as often as they move."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path

import numpy as np
import pyarrow as pa  # type: ignore[import-untyped]
import rerun as rr
import rerun.blueprint as rrb

from twin.geometry import Array, matrix_from_quat_wxyz, xyzw_from_wxyz
from twin.models.description import RobotDescription
from twin.models.kinematics import joint_motion, link_poses
from twin.models.solids import Shape
from twin.recording.blueprint import DARK, orbit
from twin.recording.extents import span
from twin.recording.stream import FLUSH_TIMEOUT_S, end_recording, open_recording, whole_recording
from twin.recording.view.posture import Posture
from twin.recording.view.robot_layers import LAYERS, Canvas

APPLICATION_ID = "twin-view"
TIMELINE = "posture"
"""The one timeline: the postures that were shown, counted."""
FLOOR_FRAME = "floor of twin view"
"""Parent of the root link, and where it is: the screen does not depend on what a robot calls its root."""
SHOWN = ("visual",)
"""Layers that can be seen at first."""
LEAST_SIZE_M = 0.1
"""Of what the camera looks at."""


class RobotView:
    """Draws one robot into a recording."""

    def __init__(self, recording: rr.RecordingStream, description: RobotDescription) -> None:
        """Draw all layers; the posture comes with `move`.

        Args:
            recording: Where to.
            description: The robot.
        """
        self._recording = recording
        self._count = 0
        recording.log("/", rr.ViewCoordinates.RIGHT_HAND_Z_UP, rr.CoordinateFrame(FLOOR_FRAME), static=True)
        recording.log(
            "/tf_static",
            rr.Transform3D(
                translation=(0.0, 0.0, 0.0), parent_frame=FLOOR_FRAME, child_frame=description.root
            ),
            static=True,
        )
        self._joints = tuple(description.joints.values())
        low, high = extent(description, Posture(description))
        canvas = Canvas(recording=recording, size=float(np.max(high - low)))
        for draw in LAYERS.values():
            draw(canvas, description)

    def move(self, posture: Posture) -> None:
        """Show a posture.

        All joints are sent, not only those that moved: a viewer that connects late finds the last posture in
        one piece, whatever the server has dropped to save memory.
        """
        joints, positions = self._joints, posture.positions
        if joints:
            poses = [joint.T_parent_joint @ joint_motion(joint, positions[joint.name]) for joint in joints]
            self._recording.send_columns(
                "/tf",
                [rr.TimeColumn(TIMELINE, sequence=[self._count] * len(poses))],
                rr.Transform3D.columns(
                    translation=np.array([pose.xyz for pose in poses], dtype=np.float32),
                    quaternion=np.array([xyzw_from_wxyz(pose.quat_wxyz) for pose in poses], dtype=np.float32),
                    parent_frame=pa.array([joint.parent for joint in joints], pa.string()),
                    child_frame=pa.array([joint.child for joint in joints], pa.string()),
                ),
            )
        self._recording.flush(timeout_sec=FLUSH_TIMEOUT_S)
        self._count += 1

    def close(self) -> None:
        """Send what waits and end the recording."""
        self._recording.disconnect()


def save(path: Path, posture: Posture, description: RobotDescription, show: Collection[str] = SHOWN) -> None:
    """Write a recording of a robot in one posture.

    Args:
        path: The `.rrd` file to write.
        posture: Where the joints stand.
        description: The robot.
        show: Layers that can be seen at first, of `LAYERS`.

    Raises:
        RecordingError: The file cannot be written.
    """
    blueprint = robot_layout(description, posture, show)
    with whole_recording(path) as new:
        recording = open_recording(new, APPLICATION_ID, description.name, blueprint)
        view = RobotView(recording, description)
        view.move(posture)
        end_recording(recording, new)


def robot_layout(
    description: RobotDescription, posture: Posture, show: Collection[str] = SHOWN
) -> rrb.Blueprint:
    """Return the screen: one 3-D view of the whole robot, with the layers beside it."""
    low, high = extent(description, posture)
    centre, size = (low + high) / 2.0, float(np.max(high - low))
    view = rrb.Spatial3DView(
        name="Robot",
        origin="/",
        contents="/**",
        overrides={f"/{layer}": rrb.EntityBehavior(visible=layer in show) for layer in LAYERS},
        background=DARK,
        line_grid=rrb.LineGrid3D(visible=True, spacing=_grid_spacing(size), color=(110, 110, 110, 110)),
        spatial_information=rrb.SpatialInformation(target_frame=FLOOR_FRAME),
        eye_controls=orbit(centre + size * np.array((0.95, -0.95, 0.55)), centre),
    )
    return rrb.Blueprint(
        view,
        rrb.BlueprintPanel(state="expanded"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="hidden", timeline=TIMELINE),
        auto_views=False,
        auto_layout=False,
    )


def extent(description: RobotDescription, posture: Posture) -> tuple[Array, Array]:
    """Return the corners of a box around the robot [m], shapes (3,), in the root frame."""
    poses = link_poses(description, posture.positions)
    corners: list[Array] = [pose.xyz for pose in poses.values()]
    for name, link in description.links.items():
        shapes: tuple[Shape, ...] = (*link.visuals, *link.collisions)
        for shape in shapes:
            pose = poses[name] @ shape.T_link_geometry
            near, far = span(shape.geometry, matrix_from_quat_wxyz(pose.quat_wxyz))
            corners += [pose.xyz + near, pose.xyz + far]
    low, high = np.min(corners, axis=0), np.max(corners, axis=0)
    return low - LEAST_SIZE_M / 2.0, high + LEAST_SIZE_M / 2.0


def _grid_spacing(size: float, steps: Sequence[float] = (0.01, 0.1, 1.0)) -> float:
    """Return the distance of the grid's lines [m]: the power of ten that a robot of a size fits best."""
    return next((step for step in steps if size < 12.0 * step), 10.0)
