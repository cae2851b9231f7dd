"""What the robot believes about its pose, beside where it truly is.

`map` -> `odom` comes from localisation, `odom` -> `base_footprint` from odometry (REP-105). Before the first
localisation, and in runs without one, `odom` is anchored where the robot truly was at the first odometry, so
that odometry is drawn in the right place and its drift can be seen.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import rerun as rr

from twin.geometry import Pose2, yaw_from_quat_wxyz
from twin.periods import Period, next_due
from twin.recording.columns import Columns, TrailColumns, TransformColumns, scalars
from twin.recording.frames import WORLD
from twin.recording.placing import Placed

if TYPE_CHECKING:
    from twin.recording.channels.channel import Context

TRUTH_COLOUR = (90, 200, 120, 255)
ESTIMATE_COLOUR = (255, 150, 40, 255)
ODOMETRY_COLOUR = (160, 120, 220, 255)
TRAILS = {
    "truth": (TRUTH_COLOUR, 2.0),
    "odometry": (ODOMETRY_COLOUR, 0.8),
    "estimate": (ESTIMATE_COLOUR, 0.8),
}
"""Colour, and radius in points of the screen: the truth shows on both sides of what covers it."""
FLOOR_HEIGHT = 0.03
"""Above the floor, so that what is drawn there lies on the map [m]; each trail has its own level."""

Numbers = tuple[float, ...]


class Belief:
    """Estimated pose, trails and localisation error of one robot."""

    def __init__(
        self, context: Context, namespace: str, *, period: Period, trail_step_m: float, radius: float
    ) -> None:
        """Start without knowing anything.

        Args:
            context: What channels need; its recording gets the static parts: the ghost, colours.
            namespace: Of the robot's topics.
            period: Trails and errors are sampled in the first transform at or after its multiples [ns].
            trail_step_m: Length of a segment of a trail [m].
            radius: Of the ring around the estimated pose [m].
        """
        recording, frames = context.recording, context.frames
        self._recording, self._frames = recording, frames
        self._namespace = namespace
        self._true_pose = context.true_pose
        self._period = period
        self._next_ns = 0
        self._base: str | None = None
        self._names: dict[tuple[str, str], tuple[str, str]] = {}
        self._anchor: Pose2 | None = None
        self._T_map_odom: Pose2 | None = None
        self._radius = radius
        robot = frames.robot(namespace)
        self._ghost = f"/estimate/{robot}"
        self._placed = Placed(recording, self._ghost, context.start_ns)
        self._transforms = TransformColumns(f"/tf_belief/{robot}")
        self._trails = {name: TrailColumns(f"/trails/{robot}/{name}", trail_step_m) for name in TRAILS}
        for name, (colour, width) in TRAILS.items():
            recording.log(
                self._trails[name].entity,
                rr.LineStrips3D.from_fields(colors=[colour], radii=rr.Radius.ui_points(width)),
                rr.CoordinateFrame(WORLD),
                static=True,
            )
        self._error_xy = Columns(f"/localisation/{robot}/position_error", scalars)
        self._error_yaw = Columns(f"/localisation/{robot}/yaw_error", scalars)
        for columns, name, colour in (
            (self._error_xy, "position error [m]", ESTIMATE_COLOUR),
            (self._error_yaw, "yaw error [rad]", ODOMETRY_COLOUR),
        ):
            recording.log(columns.entity, rr.SeriesLines(names=[name], colors=[colour]), static=True)

    def on_transform(self, time_ns: int, parent: str, child: str, transform: Any) -> None:
        """Take one transform of `/tf` whose parent is `map` or `odom`.

        Args:
            time_ns: Of publication [ns].
            parent: Frame id as in the message.
            child: Frame id as in the message.
            transform: A geometry_msgs/Transform.
        """
        if child.rsplit("/", 1)[-1] == "odom":
            self._T_map_odom = _pose2(transform)
        elif parent.rsplit("/", 1)[-1] == "odom":
            if time_ns < self._next_ns:
                return
            self._next_ns = next_due(self._period, time_ns)
            self._on_odometry(time_ns, parent, child, transform)
        t, q = transform.translation, transform.rotation
        self._add(time_ns, parent, child, (t.x, t.y, t.z), (q.x, q.y, q.z, q.w))

    def send(self, recording: rr.RecordingStream) -> None:
        """Send the block."""
        for columns in (self._transforms, *self._trails.values(), self._error_xy, self._error_yaw):
            columns.send(recording)

    def _add(self, time_ns: int, parent: str, child: str, xyz: Numbers, quat_xyzw: Numbers) -> None:
        names = self._names.get((parent, child))
        if names is None:
            belief = self._frames.belief
            names = (belief(self._namespace, parent), belief(self._namespace, child))
            self._names[parent, child] = names
        self._transforms.append(time_ns, names[0], [names[1]], [xyz], [quat_xyzw])

    def _on_odometry(self, time_ns: int, odom: str, child: str, transform: Any) -> None:
        T_odom_base = _pose2(transform)
        if self._anchor is None:
            self._anchor = self._start(time_ns, odom, child, T_odom_base)
            self._draw_ghost(time_ns, self._frames.belief(self._namespace, child), transform.translation.z)
        odometry = self._anchor @ T_odom_base
        self._trails["odometry"].visit(time_ns, odometry.x, odometry.y, FLOOR_HEIGHT)
        estimate = None if self._T_map_odom is None else self._T_map_odom @ T_odom_base
        if estimate is not None:
            self._trails["estimate"].visit(time_ns, estimate.x, estimate.y, FLOOR_HEIGHT + 0.01)
        if self._base is not None:
            truth = self._true_pose(self._base).to_pose2()
            self._trails["truth"].visit(time_ns, truth.x, truth.y, FLOOR_HEIGHT - 0.01)
            if estimate is not None:
                error = truth.inverse() @ estimate
                self._error_xy.append(time_ns, math.hypot(error.x, error.y))
                self._error_yaw.append(time_ns, error.yaw)

    def _start(self, time_ns: int, odom: str, child: str, T_odom_base: Pose2) -> Pose2:
        self._base = self._frames.body(self._namespace, child)
        if self._base is None:
            anchor = self._T_map_odom or Pose2(0.0, 0.0, 0.0)
        else:
            anchor = self._true_pose(self._base).to_pose2() @ T_odom_base.inverse()
        if self._T_map_odom is None:
            half = anchor.yaw / 2.0
            self._add(
                time_ns, "map", odom, (anchor.x, anchor.y, 0.0), (0.0, 0.0, math.sin(half), math.cos(half))
            )
        return anchor

    def _draw_ghost(self, time_ns: int, frame: str, height: float) -> None:
        """Draw the ring and its arrow on the floor, `height` [m] below the frame."""
        angles = np.linspace(0.0, 2.0 * math.pi, 33)
        ring = self._radius * np.stack((np.cos(angles), np.sin(angles), np.zeros(33)), axis=1)
        floor = (0.0, 0.0, FLOOR_HEIGHT - height)
        self._placed.attach(frame, time_ns)
        self._recording.log(
            self._ghost,
            rr.LineStrips3D([ring + floor], colors=[ESTIMATE_COLOUR], radii=[0.03 * self._radius]),
            rr.Arrows3D(
                vectors=[(1.6 * self._radius, 0.0, 0.0)],
                origins=[floor],
                colors=[ESTIMATE_COLOUR],
                radii=[0.08 * self._radius],
            ),
        )


def _pose2(transform: Any) -> Pose2:
    t, q = transform.translation, transform.rotation
    return Pose2(t.x, t.y, yaw_from_quat_wxyz((q.w, q.x, q.y, q.z)))
