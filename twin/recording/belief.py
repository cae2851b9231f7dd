"""What the robot believes about its pose, beside where it truly is.

`map` -> `odom` comes from localisation, `odom` -> `base_footprint` from odometry (REP-105). Before the first
localisation, and in runs without one, `odom` is anchored where the robot truly was at the first odometry, so
that odometry is drawn in the right place and its drift can be seen.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import rerun as rr

from twin.geometry import Pose2, Pose3, xyzw_from_wxyz
from twin.recording.columns import ScalarColumns, TrailColumns, TransformColumns
from twin.recording.frames import Frames

TRUTH_COLOUR = (90, 200, 120, 255)
ESTIMATE_COLOUR = (255, 150, 40, 255)
ODOMETRY_COLOUR = (160, 120, 220, 255)
GHOST_RADIUS = 0.35
"""Of the ring around the estimated pose [m]."""
TRAIL_HEIGHT = 0.03
"""Above the floor, so that trails lie on the map [m]."""

TruePose = Callable[[str], Pose3]
"""Returns the pose of a body in `world`, now."""


class Belief:
    """Estimated pose, trails and localisation error of one robot."""

    def __init__(
        self,
        recording: rr.RecordingStream,
        frames: Frames,
        namespace: str,
        true_pose: TruePose,
        *,
        period_ns: int,
        trail_step_m: float,
    ) -> None:
        """Start without knowing anything.

        Args:
            recording: Gets the static parts: the ghost, colours.
            frames: Names of the run's frames.
            namespace: Of the robot's topics.
            true_pose: Reads the simulator.
            period_ns: Trails and errors are sampled at most this often [ns].
            trail_step_m: Length of a segment of a trail [m].
        """
        self._recording = recording
        self._frames = frames
        self._namespace = namespace
        self._true_pose = true_pose
        self._period_ns = period_ns
        self._next_ns = 0
        self._base: str | None = None
        self._anchor: Pose2 | None = None
        self._T_map_odom: Pose2 | None = None
        robot = frames.robot(namespace)
        self._transforms = TransformColumns(f"/tf_belief/{robot}")
        self._trails = {
            name: TrailColumns(f"/trails/{robot}/{name}", trail_step_m)
            for name in ("truth", "odometry", "estimate")
        }
        colours = (TRUTH_COLOUR, ODOMETRY_COLOUR, ESTIMATE_COLOUR)
        for trail, colour in zip(self._trails.values(), colours, strict=True):
            recording.log(
                trail.entity,
                rr.LineStrips3D.from_fields(colors=[colour], radii=rr.Radius.ui_points(1.0)),
                rr.CoordinateFrame("world"),
                static=True,
            )
        self._error_xy = ScalarColumns(f"/localisation/{robot}/position_error")
        self._error_yaw = ScalarColumns(f"/localisation/{robot}/yaw_error")
        recording.log(
            self._error_xy.entity,
            rr.SeriesLines(names=["position error [m]"], colors=[ESTIMATE_COLOUR]),
            static=True,
        )
        recording.log(
            self._error_yaw.entity,
            rr.SeriesLines(names=["yaw error [rad]"], colors=[ODOMETRY_COLOUR]),
            static=True,
        )

    def on_transform(self, time_ns: int, parent: str, child: str, T_parent_child: Pose3) -> None:
        """Take one transform of `/tf` whose parent is `map` or `odom`; frame ids as in the message."""
        link = child.rsplit("/", 1)[-1]
        if link == "odom":
            self._T_map_odom = T_parent_child.to_pose2()
        elif parent.rsplit("/", 1)[-1] == "odom":
            self._on_odometry(time_ns, parent, child, T_parent_child.to_pose2())
        self._add(time_ns, parent, child, T_parent_child)

    def send(self, recording: rr.RecordingStream) -> None:
        """Send the block."""
        for columns in (self._transforms, *self._trails.values(), self._error_xy, self._error_yaw):
            columns.send(recording)

    def _add(self, time_ns: int, parent: str, child: str, pose: Pose3) -> None:
        self._transforms.append(
            time_ns,
            self._frames.belief(self._namespace, parent),
            [self._frames.belief(self._namespace, child)],
            np.array([pose.xyz]),
            np.array([xyzw_from_wxyz(pose.quat_wxyz)]),
        )

    def _on_odometry(self, time_ns: int, odom: str, child: str, T_odom_base: Pose2) -> None:
        if self._anchor is None:
            self._start(time_ns, odom, child, T_odom_base)
        if time_ns < self._next_ns or self._anchor is None:
            return
        self._next_ns = time_ns + self._period_ns
        odometry = self._anchor @ T_odom_base
        self._trails["odometry"].append(time_ns, odometry.x, odometry.y, TRAIL_HEIGHT)
        estimate = None if self._T_map_odom is None else self._T_map_odom @ T_odom_base
        if estimate is not None:
            self._trails["estimate"].append(time_ns, estimate.x, estimate.y, TRAIL_HEIGHT)
        if self._base is not None:
            truth = self._true_pose(self._base).to_pose2()
            self._trails["truth"].append(time_ns, truth.x, truth.y, TRAIL_HEIGHT)
            if estimate is not None:
                error = truth.inverse() @ estimate
                self._error_xy.append(time_ns, math.hypot(error.x, error.y))
                self._error_yaw.append(time_ns, error.yaw)

    def _start(self, time_ns: int, odom: str, child: str, T_odom_base: Pose2) -> None:
        self._base = self._frames.body(self._namespace, child)
        if self._base is None:
            self._anchor = self._T_map_odom or Pose2(0.0, 0.0, 0.0)
        else:
            self._anchor = self._true_pose(self._base).to_pose2() @ T_odom_base.inverse()
        if self._T_map_odom is None:
            self._add(time_ns, "map", odom, Pose3.from_pose2(self._anchor))
        self._draw_ghost(self._frames.belief(self._namespace, child))

    def _draw_ghost(self, frame: str) -> None:
        angles = np.linspace(0.0, 2.0 * math.pi, 33)
        ring = np.stack(
            (GHOST_RADIUS * np.cos(angles), GHOST_RADIUS * np.sin(angles), np.full(33, TRAIL_HEIGHT)), axis=1
        )
        nose = (1.6 * GHOST_RADIUS, 0.0, 0.0)
        # Not static: before this time the frame has no pose and a static shape would be an error in the view.
        self._recording.log(
            f"/estimate/{self._frames.robot(self._namespace)}",
            rr.CoordinateFrame(frame),
            rr.LineStrips3D([ring], colors=[ESTIMATE_COLOUR], radii=[0.015]),
            rr.Arrows3D(
                vectors=[nose], origins=[(0.0, 0.0, TRAIL_HEIGHT)], colors=[ESTIMATE_COLOUR], radii=[0.03]
            ),
        )
