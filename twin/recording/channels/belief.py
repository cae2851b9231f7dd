"""What the robot believes about its pose, beside where it truly is.

`map` -> `odom` comes from localisation, `odom` -> `base_footprint` from odometry (REP-105). Before the first
localisation, and in runs without one, `odom` is anchored where the robot truly was at the first odometry, so
that odometry is drawn in the right place and its drift can be seen.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import lru_cache, partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import rerun as rr

from twin.geometry import Pose2, Pose3, yaw_from_quat_wxyz
from twin.periods import next_due
from twin.recording.channels.channel import Channel, Context
from twin.recording.columns import STRIPS, Chunk, scalars, sim_time, transforms
from twin.recording.frames import BELIEF_FRAMES, WORLD
from twin.recording.placing import Placed

if TYPE_CHECKING:
    from twin.bridge.topics import Sample

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
_LEVELS = {"truth": FLOOR_HEIGHT - 0.01, "odometry": FLOOR_HEIGHT, "estimate": FLOOR_HEIGHT + 0.01}
_RING_RADIUS = 0.3
"""Around the estimated pose of a robot that has no body [m]."""

_Point = tuple[float, float, float]


class Link(NamedTuple):
    """A transform of the robot's belief."""

    time_ns: int
    parent: str
    """Frame id as in the message."""
    child: str
    xyz: tuple[float, float, float]
    quat_xyzw: tuple[float, float, float, float]
    truth: Pose3 | None = None
    """Of the body that odometry moves, in `world`."""

    @property
    def pose(self) -> Pose2:
        """In the plane."""
        x, y, z, w = self.quat_xyzw
        return Pose2(self.xyz[0], self.xyz[1], yaw_from_quat_wxyz((w, x, y, z)))


class BeliefChannel(Channel[Link]):
    """tf2_msgs/TFMessage: estimated pose, trails and localisation error of one robot.

    Only what hangs below `map` and `odom`: the robot's links are drawn where they truly are.
    """

    def __init__(self, context: Context, namespace: str, topic: str) -> None:
        """Start without knowing anything."""
        super().__init__(context, namespace, topic)
        self._next_ns = 0
        self._name = lru_cache(maxsize=256)(partial(context.frames.belief, namespace))
        self._anchor: Pose2 | None = None
        self._T_map_odom: Pose2 | None = None
        self._ghost = f"/estimate/{self.robot}"
        self._placed = Placed(self.recording, self._ghost, context.start_ns)
        self._trails = {name: f"/trails/{self.robot}/{name}" for name in TRAILS}
        self._ends: dict[str, _Point] = {}
        for name, (colour, width) in TRAILS.items():
            self.recording.log(
                self._trails[name],
                rr.LineStrips3D.from_fields(colors=[colour], radii=rr.Radius.ui_points(width)),
                rr.CoordinateFrame(WORLD),
                static=True,
            )
        self._errors = tuple(f"/localisation/{self.robot}/{kind}_error" for kind in ("position", "yaw"))
        looks = (("position error [m]", ESTIMATE_COLOUR), ("yaw error [rad]", ODOMETRY_COLOUR))
        for entity, (name, colour) in zip(self._errors, looks, strict=True):
            self.recording.log(entity, rr.SeriesLines(names=[name], colors=[colour]), static=True)

    def take(self, sample: Sample[Any]) -> None:
        """Keep transforms whose parent is `map` or `odom`; odometry when it is due."""
        for stamped in sample.message.transforms:
            parent, child = stamped.header.frame_id, stamped.child_frame_id
            if _last(parent) not in BELIEF_FRAMES:
                continue
            truth = None
            if _is_odometry(parent, child):
                if sample.time_ns < self._next_ns:
                    continue
                self._next_ns = next_due(self.context.period, sample.time_ns)
                body = self.context.frames.body(self.namespace, child)
                truth = None if body is None else self.context.true_pose(body)
            t, q = stamped.transform.translation, stamped.transform.rotation
            self.rows.append(
                Link(sample.time_ns, parent, child, (t.x, t.y, t.z), (q.x, q.y, q.z, q.w), truth)
            )

    def chunks(self, rows: list[Link]) -> Iterator[Chunk]:
        """Yield the transforms, and what follows from them."""
        links: list[Link] = []
        errors: list[tuple[int, float, float]] = []
        segments: dict[str, list[tuple[int, _Point, _Point]]] = {name: [] for name in TRAILS}
        for link in rows:
            if _is_odometry(link.parent, link.child):
                if self._anchor is None:
                    self._anchor = self._start(link)
                    if self._T_map_odom is None:
                        links.append(_map_to_odom(link, self._anchor))
                poses = self._poses(link, self._anchor)
                for name, pose in poses.items():
                    self._extend(segments[name], name, link.time_ns, pose)
                if "truth" in poses and "estimate" in poses:
                    error = poses["truth"].inverse() @ poses["estimate"]
                    errors.append((link.time_ns, math.hypot(error.x, error.y), error.yaw))
            elif _last(link.child) == "odom":
                self._T_map_odom = link.pose
            links.append(link)
        times, parents, children, xyz, quat_xyzw, _ = zip(*links, strict=True)
        parents, children = (tuple(map(self._name, frame_ids)) for frame_ids in (parents, children))
        yield transforms(f"/tf_belief/{self.robot}", sim_time(times), parents, children, xyz, quat_xyzw)
        for name, segment in segments.items():
            if segment:
                times, *points = zip(*segment, strict=True)
                yield self._trails[name], sim_time(times), [STRIPS.column(np.stack(points, axis=1))]
        if errors:
            times, *values = zip(*errors, strict=True)
            yield from scalars(sim_time(times), dict(zip(self._errors, values, strict=True)))

    def _poses(self, link: Link, T_map_anchor: Pose2) -> dict[str, Pose2]:
        """Return where the robot was, as far as that is known, by the name of the trail."""
        T_odom_base = link.pose
        poses = {"odometry": T_map_anchor @ T_odom_base}
        if self._T_map_odom is not None:
            poses["estimate"] = self._T_map_odom @ T_odom_base
        if link.truth is not None:
            poses["truth"] = link.truth.to_pose2()
        return poses

    def _extend(
        self, segments: list[tuple[int, _Point, _Point]], name: str, time_ns: int, pose: Pose2
    ) -> None:
        """Add to a path travelled, unless the pose is less than a step away from its end."""
        point = (pose.x, pose.y, _LEVELS[name])
        end = self._ends.setdefault(name, point)
        if math.dist(point, end) >= self.context.trail_step_m:
            segments.append((time_ns, end, point))
            self._ends[name] = point

    def _start(self, link: Link) -> Pose2:
        """Draw the ghost, and return where odometry began: `odom` in `map`."""
        self._draw_ghost(link)
        if link.truth is None:
            return self._T_map_odom or Pose2(0.0, 0.0, 0.0)
        return link.truth.to_pose2() @ link.pose.inverse()

    def _draw_ghost(self, link: Link) -> None:
        """Draw the ring and its arrow on the floor."""
        radius = self.context.radii.get(self.robot, _RING_RADIUS)
        angles = np.linspace(0.0, 2.0 * math.pi, 33)
        ring = radius * np.stack((np.cos(angles), np.sin(angles), np.zeros(33)), axis=1)
        floor = (0.0, 0.0, FLOOR_HEIGHT - link.xyz[2])
        self._placed.attach(self._name(link.child), link.time_ns)
        self.recording.log(
            self._ghost,
            rr.LineStrips3D([ring + floor], colors=[ESTIMATE_COLOUR], radii=[0.03 * radius]),
            rr.Arrows3D(
                vectors=[(1.6 * radius, 0.0, 0.0)],
                origins=[floor],
                colors=[ESTIMATE_COLOUR],
                radii=[0.08 * radius],
            ),
        )


def _map_to_odom(link: Link, T_map_odom: Pose2) -> Link:
    """Return the anchor as a transform at the time of the first odometry."""
    half = T_map_odom.yaw / 2.0
    xyz, quat_xyzw = (T_map_odom.x, T_map_odom.y, 0.0), (0.0, 0.0, math.sin(half), math.cos(half))
    return Link(link.time_ns, "map", link.parent, xyz, quat_xyzw)


def _is_odometry(parent: str, child: str) -> bool:
    return _last(parent) == "odom" != _last(child)


@lru_cache(maxsize=256)
def _last(frame_id: str) -> str:
    """Return a frame's name without a namespace."""
    return frame_id.rsplit("/", 1)[-1]
