"""The frames of a graph as a recording has them: every frame has a way to `world`, and moves as tf says."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from twin.bridge.msgs import TFMessage, ns
from twin.bridge.tf.core import BufferCore
from twin.bridge.tf.errors import TransformError
from twin.geometry import Array, Pose3
from twin.models.description import RobotDescription
from twin.models.kinematics import joint_motion, joint_positions
from twin.recording.columns import Chunk, sim_time, transforms
from twin.recording.frames import BELIEF_FRAMES, WORLD, Frames
from twin.recording.watch.graph_time import GraphTime

_KEPT_NS = 40_000_000
"""Of a frame, one pose is kept in each interval of so long, and its latest."""
_AGAIN_NS = 10_000_000_000
"""How often all frames are told again: who looks later must find them, and servers forget what is old."""

_Numbers = tuple[float, ...]
"""x, y, z [m], and quaternion (x, y, z, w)."""
_STILL: _Numbers = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


class GraphFrames(Frames):
    """Names of frames for the messages of a graph: all are what robots believe, there is no truth.

    A robot with a `tf` topic of its own in a namespace has frames of its own, too, as with Nav2.
    """

    def __init__(self) -> None:
        """Begin without a robot."""
        super().__init__(())
        self.used: set[str] = set()
        """Frames that something is drawn in."""

    def add(self, namespace: str) -> None:
        """Take note of a namespace whose frames are its own."""
        if namespace not in self.robots:
            self.robots = (*self.robots, namespace)

    def robot(self, namespace: str) -> str:
        """Return what the robot of a namespace is called."""
        return namespace or "robot"

    def body(self, namespace: str, frame_id: str) -> str | None:
        """Return the frame that something is fixed to when it is measured, if it is on a robot.

        Its messages stay where they were measured; what is in a map moves with the map.
        """
        name = self.belief(namespace, frame_id)
        return None if name.rsplit("/", 1)[-1] in (*BELIEF_FRAMES, WORLD) else name

    def belief(self, namespace: str, frame_id: str) -> str:
        """Return the frame's name on the screen."""
        name = super().belief(namespace, frame_id) or WORLD
        self.used.add(name)
        return name


class FrameTree:
    """Transforms of a graph in `/tf`.

    A frame that is nobody's child is in `world`; frames of a robot that nobody publishes follow from its
    description and joint states.
    """

    def __init__(self, frames: GraphFrames) -> None:
        self._frames = frames
        self._buffer = BufferCore()
        self._edges: dict[str, tuple[str, _Numbers]] = {}
        """By child: its parent, and its pose there."""
        self._sent: dict[str, tuple[str, _Numbers]] = {}
        self._moved: dict[tuple[str, int], tuple[int, str, str, _Numbers]] = {}
        self._times: dict[str, int] = {}
        """By child: of its latest pose; one that comes late is not hidden by it."""
        self._published: set[str] = set()
        self._again_ns = 0
        self.stamp_ns = 0
        """Of the message that is being drawn, by the graph's clock [ns]."""

    def forget(self) -> None:
        """Begin anew, with a clock that leapt."""
        self._buffer = BufferCore()

    def take_transforms(self, namespace: str, message: TFMessage, time: GraphTime, *, static: bool) -> None:
        """Take transforms; those that cannot be are left out, as by tf2."""
        for stamped in message.transforms:
            parent, child = (
                Frames.belief(self._frames, namespace, name)
                for name in (stamped.header.frame_id, stamped.child_frame_id)
            )
            stamp_ns = ns(stamped.header.stamp)
            t, q = stamped.transform.translation, stamped.transform.rotation
            value = (t.x, t.y, t.z, q.w, q.x, q.y, q.z)
            try:
                self._buffer.set_rigid(parent, child, stamp_ns, value, static=static)
            except ValueError:
                continue
            self._published.add(child)
            self._put(parent, child, (t.x, t.y, t.z, q.x, q.y, q.z, q.w), time.shown(stamp_ns))

    def take_joints(
        self, robot: RobotDescription, prefix: str, positions: Mapping[str, float], time_ns: int
    ) -> None:
        """Move the links of a robot that nobody publishes; positions [rad or m] of some joints."""
        joints = [joint for joint in robot.joints.values() if prefix + joint.child not in self._published]
        every = joint_positions(robot, positions) if joints else {}
        for joint in joints:
            pose = joint.T_parent_joint @ joint_motion(joint, every[joint.name])
            w, x, y, z = pose.quat_wxyz.tolist()
            self._put(prefix + joint.parent, prefix + joint.child, (*pose.xyz.tolist(), x, y, z, w), time_ns)

    def __contains__(self, frame: object) -> bool:
        return frame in self._edges or any(parent == frame for parent, _ in self._edges.values())

    def pose(self, frame: str) -> Pose3:
        """Return where a frame was at `stamp_ns`, in `world`; as near to that as is known."""
        root = self._root(frame)
        buffer = self._buffer
        for time_ns in (self.stamp_ns or None, None):
            try:
                return buffer.lookup(root.removeprefix("/"), frame.removeprefix("/"), time_ns)
            except TransformError:
                pass
        return self._latest(frame)

    def _latest(self, frame: str) -> Pose3:
        """Return a frame's pose in `world` by what is drawn now."""
        pose = Pose3.from_xyz_rpy()
        for _ in range(len(self._edges)):
            if frame not in self._edges:
                break
            frame, (x, y, z, i, j, k, w) = self._edges[frame]
            pose = Pose3(np.array((x, y, z)), np.array((w, i, j, k))) @ pose
        return pose

    def _root(self, frame: str) -> str:
        for _ in range(len(self._edges)):  # frames in a ring have no root
            if frame not in self._edges:
                break
            frame = self._edges[frame][0]
        return frame

    def take_chunks(self, now_ns: int) -> Iterator[Chunk]:
        """Yield what moved; all there is, if that was long ago."""
        everything = now_ns >= self._again_ns
        if everything:
            self._again_ns = now_ns + _AGAIN_NS
        known = {parent for parent, _ in self._edges.values()} | self._frames.used
        roots = sorted(known - self._edges.keys() - {WORLD})
        rows = list(self._moved.values())
        self._moved.clear()
        latest = {**dict.fromkeys(roots, (WORLD, _STILL)), **self._edges}
        moved = {child for _, _, child, _ in rows}
        for child, edge in latest.items():
            if child not in moved and (everything or self._sent.get(child) != edge):
                rows.append((now_ns, edge[0], child, edge[1]))
                self._times[child] = now_ns
        self._sent = latest
        if rows:
            times, parents, children, poses = zip(*rows, strict=True)
            numbers: Array = np.array(poses)
            yield transforms("/tf", sim_time(times), parents, children, numbers[:, :3], numbers[:, 3:])

    def _put(self, parent: str, child: str, pose: _Numbers, time_ns: int) -> None:
        if self._edges.get(child) != (parent, pose):
            self._edges[child] = (parent, pose)
            self._times[child] = time_ns = max(time_ns, self._times.get(child, 0))
            self._moved[child, time_ns // _KEPT_NS] = (time_ns, parent, child, pose)
