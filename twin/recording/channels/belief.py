"""What the robot believes about its pose, beside where it truly is.

`map` -> `odom` comes from localisation, `odom` -> `base_footprint` from odometry (REP-105). Before the first
localisation, and in runs without one, `odom` is anchored where the robot truly was at the first odometry, so
that odometry is drawn in the right place and its drift can be seen.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import rerun as rr

from twin.geometry import Array, Pose2, Pose3, wrap_angles
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
_NOWHERE = (math.nan, math.nan, math.nan)

_Point = tuple[float, float, float]
_Numbers = tuple[float, float, float, float, float, float, float]


class Link(NamedTuple):
    """Two frames of the robot's belief."""

    parent: str
    """Of the recording, as `child` is."""
    child: str
    is_odometry: bool = False
    is_correction: bool = False
    """`map` -> `odom`."""
    body: str | None = None
    """That odometry moves."""


class Seen(NamedTuple):
    """A transform of the robot's belief."""

    time_ns: int
    link: Link
    pose: _Numbers
    """x, y, z [m], and quaternion (x, y, z, w)."""
    truth: Pose3 | None = None
    """Of the body that odometry moves, in `world`."""


class BeliefChannel(Channel[Seen]):
    """tf2_msgs/TFMessage: estimated pose, trails and localisation error of one robot.

    Only what hangs below `map` and `odom`: the robot's links are drawn where they truly are.
    """

    def __init__(self, context: Context, namespace: str, topic: str) -> None:
        """Start without knowing anything."""
        super().__init__(context, namespace, topic)
        self._next_ns = 0
        self._links: dict[tuple[str, str], Link | None] = {}
        self._anchor: Array | None = None
        self._T_map_odom = np.full((1, 3), np.nan)
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
            frames = stamped.header.frame_id, stamped.child_frame_id
            if frames not in self._links:
                self._links[frames] = self._link(*frames)
            link = self._links[frames]
            if link is None:
                continue
            truth = None
            if link.is_odometry:
                if sample.time_ns < self._next_ns:
                    continue
                self._next_ns = next_due(self.context.period, sample.time_ns)
                truth = None if link.body is None else self.context.true_pose(link.body)
            t, q = stamped.transform.translation, stamped.transform.rotation
            self.rows.append(Seen(sample.time_ns, link, (t.x, t.y, t.z, q.x, q.y, q.z, q.w), truth))

    def _link(self, parent: str, child: str) -> Link | None:
        """Return what is shown of a transform, if anything; frame ids are those of the message."""
        if _last(parent) not in BELIEF_FRAMES:
            return None
        frames = self.context.frames
        of, to = (frames.belief(self.namespace, frame_id) for frame_id in (parent, child))
        is_odometry = _last(parent) == "odom" != _last(child)
        body = frames.body(self.namespace, child) if is_odometry else None
        return Link(of, to, is_odometry, _last(child) == "odom", body)

    def chunks(self, rows: list[Seen]) -> Iterator[Chunk]:
        """Yield the transforms, and what follows from them."""
        if self._anchor is None:
            rows = self._begin(rows)
        times, links, poses, truths = zip(*rows, strict=True)
        numbers = np.array(poses)
        parents, children, *_ = zip(*links, strict=True)
        entity = f"/tf_belief/{self.robot}"
        yield transforms(entity, sim_time(times), parents, children, numbers[:, :3], numbers[:, 3:])

        T_map_odom = np.concatenate((self._T_map_odom, _planar(numbers[[x.is_correction for x in links]])))
        self._T_map_odom = T_map_odom[-1:]
        at = np.flatnonzero([link.is_odometry for link in links])
        if len(at) == 0 or self._anchor is None:
            return
        T_odom_base = _planar(numbers[at])
        newest = np.cumsum([link.is_correction for link in links])[at]
        times_at = [times[i] for i in at]
        walked = {
            "truth": np.array([_NOWHERE if truths[i] is None else truths[i].to_pose2() for i in at]),
            "odometry": _compose(self._anchor, T_odom_base),
            "estimate": _compose(T_map_odom[newest], T_odom_base),
        }
        for name, path in walked.items():
            segments = list(self._segments(name, zip(times_at, path.tolist(), strict=True)))
            if segments:
                when, ends = zip(*segments, strict=True)
                yield self._trails[name], sim_time(when), (STRIPS.column(ends),)
        error = walked["estimate"] - walked["truth"]
        known = np.isfinite(error[:, 0])
        if known.any():
            values = np.hypot(*error[known, :2].T), wrap_angles(error[known, 2])
            when = np.array(times_at)[known]
            yield from scalars(sim_time(when), dict(zip(self._errors, values, strict=True)))

    def _segments(self, name: str, path: Iterable[tuple[int, list[float]]]) -> Iterator[tuple[int, Array]]:
        """Yield when a path has become a step longer, and the ends of the step."""
        for time_ns, (x, y, _) in path:
            if math.isnan(x):
                continue
            point = (x, y, _LEVELS[name])
            end = self._ends.setdefault(name, point)
            if math.dist(point, end) >= self.context.trail_step_m:
                yield time_ns, np.array((end, point))
                self._ends[name] = point

    def _begin(self, rows: list[Seen]) -> list[Seen]:
        """Draw the ghost at the first odometry, and see where it began: `odom` in `map`."""
        i = next((i for i, row in enumerate(rows) if row.link.is_odometry), None)
        if i is None:
            return rows
        first = rows[i]
        self._draw_ghost(first)
        corrections = [row for row in rows[:i] if row.link.is_correction]
        T_map_odom = _planar(np.array([corrections[-1].pose])) if corrections else self._T_map_odom
        is_localised = bool(np.isfinite(T_map_odom).all())
        if first.truth is not None:
            T_odom_base = Pose2(*_planar(np.array([first.pose]))[0].tolist())
            T_map_odom = np.array([first.truth.to_pose2() @ T_odom_base.inverse()])
        self._anchor = np.nan_to_num(T_map_odom)
        if is_localised:
            return rows
        x, y, yaw = self._anchor[0].tolist()
        link = Link(self.context.frames.belief(self.namespace, "map"), first.link.parent)
        anchor = Seen(first.time_ns, link, (x, y, 0.0, 0.0, 0.0, math.sin(yaw / 2.0), math.cos(yaw / 2.0)))
        return [*rows[:i], anchor, *rows[i:]]

    def _draw_ghost(self, first: Seen) -> None:
        """Draw the ring and its arrow on the floor."""
        radius = self.context.radii.get(self.robot, _RING_RADIUS)
        angles = np.linspace(0.0, 2.0 * math.pi, 33)
        ring = radius * np.stack((np.cos(angles), np.sin(angles), np.zeros(33)), axis=1)
        floor = (0.0, 0.0, FLOOR_HEIGHT - first.pose[2])
        self._placed.attach(first.link.child, first.time_ns)
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


def _planar(poses: Array) -> Array:
    """Return x, y [m] and yaw [rad] of poses, shape (n, 7)."""
    x, y, _, i, j, k, w = poses.T
    return np.stack((x, y, np.arctan2(2.0 * (w * k + i * j), 1.0 - 2.0 * (j * j + k * k))), axis=1)


def _compose(a: Array, b: Array) -> Array:
    """Return `T_a @ T_b` of poses in the plane, shapes (n, 3) or (1, 3); yaws are not wrapped."""
    (ax, ay, yaw), (bx, by, turn) = a.T, b.T
    c, s = np.cos(yaw), np.sin(yaw)
    return np.stack((ax + c * bx - s * by, ay + s * bx + c * by, yaw + turn), axis=1)


def _last(frame_id: str) -> str:
    """Return a frame's name without a namespace."""
    return frame_id.rsplit("/", 1)[-1]
