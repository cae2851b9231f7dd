"""Records a run as one Rerun file, at a cost that a run does not notice."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType, SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from twin.errors import RecordingError
from twin.periods import next_due, period_of
from twin.recording.frames import WORLD, Frames

if TYPE_CHECKING:  # rerun takes 0.6 s to import: only a run that records pays for it
    import rerun as rr

    from twin.bridge.topics import Sample
    from twin.recording.belief import Belief
    from twin.recording.channels.channel import Channel, Context
    from twin.recording.columns import TransformColumns
    from twin.recording.extents import RobotBox, Stage
    from twin.sim.world import World

_NS = 1_000_000_000
_RING_RADIUS = 0.3
"""Around the estimated pose of a robot that has no body [m]."""
NO_WHEELS: Mapping[str, Collection[str]] = MappingProxyType({})


@dataclass(frozen=True, kw_only=True)
class RecordingConfig:
    """What a recording keeps."""

    poses_hz: float = 25.0
    """Rate at which poses of bodies, trails and errors are sampled; only what moved is kept."""
    block_s: float = 1.0
    """Simulated time between two writes to the file [s]; a killed run loses at most this much."""
    move_tolerance: float = 1e-4
    """A body has moved when a coordinate [m] or quaternion component differs by more from what was kept."""
    trail_step_m: float = 0.05
    """Length of a segment of a trail [m]."""
    max_particles: int = 500
    """Of a particle cloud."""

    def __post_init__(self) -> None:
        problems = [
            f"recording.{name} is {getattr(self, name)}; valid: a positive number"
            for name in ("poses_hz", "block_s", "trail_step_m", "max_particles")
            if not getattr(self, name) > 0
        ]
        if problems:
            raise RecordingError("; ".join(problems))


class RerunSink:
    """Turns a world and the samples of its bus into a Rerun recording.

    The simulator's truth is drawn in `world`; a lidar's points lie where it truly saw them; what the robot
    believes is a ghost with a trail of its own. Rows wait in buffers and go to the file once a block. Order:
    construct, `bus.tap(sink.on_sample)`, `declare(world)`, then `on_tick(world)` after every tick and
    `close(verdict)`.
    """

    def __init__(
        self,
        path: Path,
        *,
        config: RecordingConfig | None = None,
        application_id: str = "twin",
        recording_id: str = "run",
    ) -> None:
        """Prepare; the file is created by `declare`.

        Args:
            path: Of the `.rrd` file; its folder is created.
            config: What to keep.
            application_id: Under which the viewer stores changes to the layout.
            recording_id: Fixed by the caller, so that two equal runs write equal recordings.
        """
        self._path = Path(path)
        self._config = config or RecordingConfig()
        self._ids = (application_id, recording_id)
        self._world: World | None = None
        self._early: list[Any] = []
        self._channels: dict[tuple[str, str], Channel | None] = {}
        self._beliefs: dict[str, Belief] = {}
        self._period = period_of(self._config.poses_hz)
        self._block_ns = round(_NS * self._config.block_s)
        self._closed = False

    def declare(self, world: World, wheels: Mapping[str, Collection[str]] = NO_WHEELS) -> None:
        """Open the file, log what never changes and the poses at the start; samples that came earlier follow.

        Args:
            world: At the start.
            wheels: By robot: joints that turn without end, which are not plotted.

        Raises:
            RecordingError: The file cannot be written.
        """
        from twin.recording.blueprint import layout
        from twin.recording.channels.channel import Context
        from twin.recording.columns import TransformColumns
        from twin.recording.extents import Stage, robot_box
        from twin.recording.shapes import declare_shapes
        from twin.recording.stream import declare_frames, open_recording

        self._world = world
        self._names = np.array(world.body_names, dtype=object)
        shapes = world.shapes()
        xyz, _ = world.body_poses()
        self._frames = Frames(world.body_names)
        robots = [robot_box(world, shapes, name) for name in self._frames.robots]
        self._robots: dict[str, RobotBox] = {box.robot: box for box in robots}
        self._bases = [world.body_names.index(box.base) for box in robots]
        self._stage: Stage = Stage(world, shapes, robots)
        blueprint = layout(self._stage, robots)
        self._recording: rr.RecordingStream = open_recording(self._path, *self._ids, blueprint)
        self._poses: TransformColumns = TransformColumns("/tf")
        self._context: Context = Context(
            recording=self._recording,
            frames=self._frames,
            belief=self._belief,
            true_pose=world.pose,
            start_ns=world.time_ns,
            max_particles=self._config.max_particles,
            wheels=wheels,
        )
        declare_frames(self._recording, self._frames)
        self._set_stage()
        declare_shapes(self._recording, shapes, world.pose)
        self._last_xyz = np.full_like(xyz, np.inf)
        self._last_quat = np.zeros((len(xyz), 4))
        self._next_pose_ns = world.time_ns
        self._next_block_ns = world.time_ns + self._block_ns
        self.on_tick(world)
        self._send()
        early, self._early = self._early, []
        for sample in early:
            self.on_sample(sample)

    def on_sample(self, sample: Sample[Any]) -> None:
        """Keep what is shown of a message (a callback for `Bus.tap`)."""
        if self._world is None:
            # The bus lends a message only during the call.
            kept = {name: getattr(sample, name) for name in ("topic", "msgtype", "time_ns", "payload")}
            self._early.append(SimpleNamespace(**kept, message=deepcopy(sample.message)))
            return
        key = (sample.topic, sample.msgtype)
        if key not in self._channels:
            from twin.recording.channels.table import open_channel

            self._channels[key] = open_channel(self._context, sample.topic, sample.msgtype)
        channel = self._channels[key]
        if channel is not None and not self._closed:
            channel.take(sample)

    def on_tick(self, world: World) -> None:
        """Sample the poses when they are due, and write the block when it is full."""
        time_ns = world.time_ns
        if time_ns >= self._next_pose_ns:
            self._next_pose_ns = next_due(self._period, time_ns)
            self._sample_poses(time_ns, world)
        if time_ns >= self._next_block_ns:
            self._next_block_ns += self._block_ns * (1 + (time_ns - self._next_block_ns) // self._block_ns)
            self._send()
            if self._stage.grow():
                self._set_stage()

    def close(self, verdict: dict[str, Any] | None = None) -> None:
        """Write what waits, the verdict (as in `verdict.json`) and the footer; the rest is ignored.

        Raises:
            RecordingError: The file is not whole.
        """
        if self._world is None or self._closed:
            return
        from twin.recording.blueprint import layout
        from twin.recording.stream import end_recording, log_verdict

        self._closed = True
        self._sample_poses(self._world.time_ns, self._world)
        try:
            if verdict is not None:
                log_verdict(self._recording, verdict)
            self._stage.fit()
            self._set_stage()
            # A viewer takes the last screen of a file; that of the start is for runs that are killed.
            self._recording.send_blueprint(layout(self._stage, [*self._robots.values()], self._world.time_ns))
            self._send()
        finally:
            end_recording(self._recording, self._path)

    def _sample_poses(self, time_ns: int, world: World) -> None:
        xyz, quat = world.body_poses()
        tolerance = self._config.move_tolerance
        moved = (np.abs(xyz - self._last_xyz) > tolerance).any(axis=1)
        moved |= (np.abs(quat - self._last_quat) > tolerance).any(axis=1)
        rows = np.flatnonzero(moved)
        self._stage.visit(xyz[self._bases])
        if len(rows):
            self._last_xyz[rows] = xyz[rows]
            self._last_quat[rows] = quat[rows]
            names = self._names[rows].tolist()
            self._poses.append(time_ns, WORLD, names, xyz[rows], quat[rows][:, [1, 2, 3, 0]])

    def _send(self) -> None:
        from twin.recording.stream import flush

        self._poses.send(self._recording)
        for channel in self._channels.values():
            if channel is not None:
                channel.send(self._recording)
        flush(self._recording, self._path)

    def _set_stage(self) -> None:
        """Log what depends on how much floor there is to see; it takes the place of what was."""
        from twin.recording.map_eye import declare_map_eye
        from twin.recording.shapes import declare_floor

        declare_floor(self._recording, self._stage.low, self._stage.high)
        declare_map_eye(self._recording, self._stage.low, self._stage.high)

    def _belief(self, namespace: str) -> Belief:
        if namespace not in self._beliefs:
            from twin.recording.belief import Belief

            box = self._robots.get(self._frames.robot(namespace))
            self._beliefs[namespace] = Belief(
                self._context,
                namespace,
                period=self._period,
                trail_step_m=self._config.trail_step_m,
                radius=box.radius if box else _RING_RADIUS,
            )
        return self._beliefs[namespace]
