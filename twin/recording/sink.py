"""Records a run as one Rerun file, at a cost that a run does not notice."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from time import monotonic_ns
from types import MappingProxyType, SimpleNamespace
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from twin.errors import RecordingError
from twin.periods import next_due, period_of
from twin.recording.frames import Frames
from twin.recording.rows import Rows

if TYPE_CHECKING:  # rerun takes 0.4 s to import: only a run that records pays for it
    import rerun as rr

    from twin.bridge.topics import Publisher, Sample
    from twin.recording.channels.channel import Context
    from twin.recording.extents import RobotBox, Stage
    from twin.recording.live_screen import LiveScreen
    from twin.recording.mounted import Mounted
    from twin.recording.poses import Poses
    from twin.sim.world import World

    _Take = Callable[[Sample[Any]], None]

_NS = 1_000_000_000
_PICTURE, _PACKED_DEPTHS = "sensor_msgs/msg/CompressedImage", "/compressedDepth"
_APPLICATION_ID = "twin"
"""Under which the viewer stores changes to the layout."""
_CLOUD = "sensor_msgs/msg/PointCloud2"
_COLLECTING = 0.9
"""Part of what a killed run loses during which rows are collected; in the rest of it they are written."""
NO_WHEELS: Mapping[str, Collection[str]] = MappingProxyType({})
NO_CAMERAS: Mapping[str, Mounted] = MappingProxyType({})


def _is_picture(publisher: Publisher[Any]) -> bool:
    return publisher.msgtype == _PICTURE and not publisher.name.endswith(_PACKED_DEPTHS)


class _Moment(NamedTuple):
    """A time that is over when both clocks say so, since a run may be slower or faster than the wall's."""

    simulated_ns: int
    wall_ns: int

    @classmethod
    def after(cls, time_ns: int, wait_ns: int) -> _Moment:
        """Return the moment so long [ns] after a simulated time [ns], which is now."""
        return cls(time_ns + wait_ns, monotonic_ns() + wait_ns)

    def is_over(self, time_ns: int) -> bool:
        """Whether it is over at a simulated time [ns], which is now."""
        return time_ns >= self.simulated_ns and monotonic_ns() >= self.wall_ns


@dataclass(frozen=True, kw_only=True)
class RecordingConfig:
    """What a recording keeps."""

    poses_hz: float = 25.0
    """Rate at which poses of bodies, trails and errors are sampled; only what moved is kept."""
    loss_s: float = 1.0
    """A killed run loses at most so much of its end [s]: simulated, or of wall time if it is faster."""
    move_tolerance: float = 1e-4
    """A body has moved when a coordinate [m] or quaternion component differs by more from what was kept."""
    trail_step_m: float = 0.05
    """Length of a segment of a trail [m]."""
    max_particles: int = 500
    """Of a particle cloud."""
    images_hz: float = 1.0
    """Rate of the pictures of each camera; 0 keeps none."""
    images: Literal["jpeg", "h264"] = "jpeg"
    """As what they are kept: each by itself, or as a video."""

    def __post_init__(self) -> None:
        problems = [
            f"recording.{name} is {getattr(self, name)}; valid: a positive number"
            for name in ("poses_hz", "loss_s", "trail_step_m", "max_particles")
            if not getattr(self, name) > 0
        ]
        if not self.images_hz >= 0:
            problems.append(f"recording.images_hz is {self.images_hz}; valid: 0 or more")
        if problems:
            raise RecordingError("; ".join(problems))


class RerunSink:
    """Turns a world and the samples of its bus into a Rerun recording.

    The simulator's truth is drawn in `world`; a lidar's points lie where it truly saw them; what the robot
    believes is a ghost with a trail of its own. The run puts rows aside, and makes columns of a block of
    time at once, which Rerun's threads encode and write while the run goes on. At most one block is
    under way: a run waits for a slow disk, and loses nothing. Order: construct, `bus.tap(sink.on_sample)`,
    `declare(world)`, then `on_tick(world)` after every tick and `close(verdict)`.
    """

    def __init__(
        self,
        target: Path | None,
        *,
        config: RecordingConfig | None = None,
        screen: LiveScreen | None = None,
        recording_id: str = "run",
        on_loss: Callable[[RecordingError], None] | None = None,
    ) -> None:
        """Prepare; the file is created by `declare`.

        Args:
            target: The `.rrd` file, whose folder is created; None if there is but the screen.
            config: What to keep.
            screen: Shows the recording while it is made; the run never waits for it.
            recording_id: Fixed by the caller, so that two equal runs write equal recordings.
            on_loss: Called once if the file cannot be written on, as the disk is full; the screen goes on.
                What can be read of it stays. None: it is raised.

        Raises:
            RecordingError: Pictures are to be a video, and PyAV is not installed.
        """
        self._target = target
        self._config = config or RecordingConfig()
        if self._config.images == "h264":
            from twin.recording.channels.video import check_installed

            check_installed()
        self._recording_id = recording_id
        self._screen = screen
        self._on_loss = on_loss
        self._world: World | None = None
        self._early: list[Any] = []
        self._sources: list[Rows[Any]] = []
        self._takers: dict[tuple[str, str], _Take | None] = {}
        self._period = period_of(self._config.poses_hz)
        self._images_period = period_of(self._config.images_hz) if self._config.images_hz else None
        self._pictures: dict[str, int] = {}
        """By topic: when the next picture is due [ns]."""
        self._block_ns = round(_NS * _COLLECTING * self._config.loss_s)
        self._writing_ns = round(_NS * (1.0 - _COLLECTING) * self._config.loss_s)
        self._block_end = self._written = _Moment(0, 0)
        self._under_way = False
        self._closed = False
        self.mirrors = False
        """Whether the screen is that of a mirror; to be set before the file is opened."""

    def declare(
        self,
        world: World,
        wheels: Mapping[str, Collection[str]] = NO_WHEELS,
        cameras: Mapping[str, Mounted] = NO_CAMERAS,
        depths: Collection[str] = (),
        truths: Collection[str] = (),
    ) -> None:
        """Open the file, log what never changes and the poses at the start; samples that came earlier follow.

        Args:
            world: At the start.
            wheels: By robot: joints that turn without end, which are not plotted.
            cameras: By topic: what makes the pictures there.
            depths: Topics of depth images that cameras make.
            truths: Topics of labels in colours, and of boxes, that cameras of ground truth make.

        Raises:
            RecordingError: The file cannot be written, or the screen is not there.
        """
        from twin.recording.blueprint import layout
        from twin.recording.channels.channel import Context
        from twin.recording.channels.images import depth_entity
        from twin.recording.channels.pictures import picture_entity
        from twin.recording.extents import Stage, robot_box
        from twin.recording.poses import Poses
        from twin.recording.shapes import declare_decals, declare_shapes
        from twin.recording.stream import UnwrittenError, declare_frames, open_recording

        shapes = world.shapes()
        frames = Frames(world.body_names)
        self._robots: list[RobotBox] = [robot_box(world, shapes, name) for name in frames.robots]
        self._stage: Stage = Stage(world, shapes, self._robots)
        shown = [*map(picture_entity, [*cameras, *truths]), *map(depth_entity, depths)]
        self._depths, self._truths = frozenset(depths), frozenset(truths)
        blueprint = layout(
            self._stage, self._robots, mirrors=self.mirrors, pictures=shown if self._images_period else ()
        )
        names = _APPLICATION_ID, self._recording_id
        try:
            self._recording: rr.RecordingStream = open_recording(
                self._target, *names, blueprint, self._screen
            )
        except UnwrittenError as fault:
            self._lose(fault)
            if self._closed:  # without a screen
                return
            self._recording = open_recording(None, *names, blueprint, self._screen)
        self._poses: Poses = Poses(
            world.body_names,
            self._stage,
            [world.body_names.index(box.base) for box in self._robots],
            self._config.move_tolerance,
        )
        self._world = world
        self._sources.append(self._poses)
        self._context: Context = Context(
            recording=self._recording,
            frames=frames,
            true_pose=world.pose,
            start_ns=world.time_ns,
            period=self._period,
            trail_step_m=self._config.trail_step_m,
            max_particles=self._config.max_particles,
            radii={box.robot: box.radius for box in self._robots},
            wheels=wheels,
            cameras=cameras,
            truths=self._truths,
            images_period=self._images_period,
            images=self._config.images,
        )
        declare_frames(self._recording, frames)
        self._set_stage()
        declare_shapes(self._recording, shapes, world.pose)
        declare_decals(self._recording, world.scene.decals)
        self._next_pose_ns = world.time_ns
        self.on_tick(world)
        self._takers.clear()
        early, self._early = self._early, []
        for sample in early:
            self.on_sample(sample)

    def on_sample(self, sample: Sample[Any]) -> None:
        """Keep what is shown of a message (a callback for `Bus.tap`)."""
        key = (sample.topic, sample.msgtype)
        if key not in self._takers:
            self._takers[key] = self._taker(*key)
        take = self._takers[key]
        if take is not None:
            take(sample)

    @staticmethod
    def shows(msgtype: str) -> bool:
        """Return whether anything is shown of messages of a type."""
        from twin.recording.channels.table import SHOWN_TYPES

        return msgtype in SHOWN_TYPES

    def wants(self, publisher: Publisher[Any]) -> bool:
        """Return whether it shows a cloud, or a picture, depths or labels that are due (for `Bus.wishes`)."""
        if publisher.msgtype == _CLOUD:  # a camera shows its own as a picture
            topics = (each for each in publisher.node.endpoints if isinstance(each, type(publisher)))
            return not self._closed and not any(map(_is_picture, topics))
        if not _is_picture(publisher) and publisher.name not in self._depths | self._truths:
            return False
        if self._images_period is None or self._closed:
            return False
        now_ns = publisher.node.now_ns
        if now_ns < self._pictures.get(publisher.name, 0):
            return False
        self._pictures[publisher.name] = next_due(self._images_period, now_ns)
        return True

    def on_tick(self, world: World) -> None:
        """Sample the poses when they are due, send the block when it is full, see that it was written.

        Raises:
            RecordingError: A block could not be written, and nobody is told of it otherwise.
        """
        if self._closed:
            return
        time_ns = world.time_ns
        if time_ns >= self._next_pose_ns:
            self._next_pose_ns = next_due(self._period, time_ns)
            self._poses.rows.append((time_ns, *world.body_poses()))
        if self._block_end.is_over(time_ns):
            self._send()
            self._block_end = _Moment.after(time_ns, self._block_ns)
            self._written = _Moment.after(time_ns, self._writing_ns)
        elif self._under_way and self._written.is_over(time_ns):
            self._wait()

    def close(self, verdict: dict[str, Any] | None = None) -> None:
        """Write what waits, the verdict (as in `verdict.json`) and the last screen; the rest is ignored.

        Raises:
            RecordingError: The file is not whole, and nobody is told of it otherwise.
        """
        if self._world is None or self._closed:
            return
        from twin.recording.stream import UnwrittenError, end_recording

        self._takers.clear()
        self._poses.rows.append((self._world.time_ns, *self._world.body_poses()))
        try:
            self._send()
            if not self._closed:
                self._send_end(self._world, verdict)
        finally:
            lost, self._closed = self._closed, True
            try:
                if not lost:
                    end_recording(self._recording, self._target)
            except UnwrittenError as fault:
                self._lose(fault)
            finally:
                if self._screen is not None:
                    self._screen.finish()

    def _send_end(self, world: World, verdict: dict[str, Any] | None) -> None:
        """Send the verdict, and the last screen."""
        from twin.recording.blueprint import layout
        from twin.recording.channels.images import DepthChannel
        from twin.recording.channels.pictures import PictureChannel
        from twin.recording.channels.series import JointChannel
        from twin.recording.channels.truth import LabelChannel, TrueBoxChannel
        from twin.recording.stream import handed_over, log_verdict

        if verdict is not None:
            log_verdict(self._recording, verdict)
        self._stage.fit()
        self._set_stage()
        # A viewer takes the last screen of a file; that of the start is for runs that are killed.
        cameras = [
            source
            for source in self._sources
            if isinstance(source, PictureChannel | LabelChannel)
            or (isinstance(source, TrueBoxChannel) and source.is_alone)
        ]
        shown = [source.entity for source in cameras]
        depths = (source for source in self._sources if isinstance(source, DepthChannel))
        shown += [source.entity for source in depths if source.has_images]
        blueprint = layout(
            self._stage,
            self._robots,
            world.time_ns,
            mirrors=self.mirrors,
            pictures=shown,
            flat=[source.entity for source in cameras if source.topic not in self._context.hung],
            joints_move=any(isinstance(source, JointChannel) and source.moves for source in self._sources),
        )
        with handed_over(blueprint):
            self._recording.send_blueprint(blueprint)

    def _taker(self, topic: str, msgtype: str) -> _Take | None:
        """Return what to do with the messages of a topic, if anything."""
        from twin.recording.channels.table import SHOWN_TYPES, open_channel

        if self._closed or msgtype not in SHOWN_TYPES:
            return None
        if self._world is None:
            return self._keep
        channel = open_channel(self._context, topic, msgtype)
        if channel is None:
            return None
        self._sources.append(channel)
        return channel.take

    def _keep(self, sample: Sample[Any]) -> None:
        """Keep a sample until the world is there; the bus lends its message only during the call."""
        kept = {name: getattr(sample, name) for name in ("topic", "msgtype", "time_ns", "payload")}
        self._early.append(SimpleNamespace(**kept, message=deepcopy(sample.message)))

    def _send(self) -> None:
        """Send what waits, and make room for robots that left the stage."""
        from twin.recording.columns import send
        from twin.recording.stream import begin_flush

        self._wait()
        if self._closed:
            return
        send(self._recording, (chunk for source in self._sources for chunk in source.take_chunks()))
        if self._stage.grow():
            self._set_stage()
        begin_flush(self._recording)
        self._under_way = True

    def _wait(self) -> None:
        """Wait until what was sent is in the file."""
        from twin.recording.stream import UnwrittenError, drop_file, flush

        if self._under_way:
            self._under_way = False
            try:
                flush(self._recording, self._target)
            except UnwrittenError as fault:
                self._lose(fault)
                drop_file(self._recording)

    def _lose(self, fault: RecordingError) -> None:
        """Go on without the file, and tell of it; without a screen there is nothing left to do."""
        if self._on_loss is None:
            raise fault
        self._target = None
        if self._screen is None:
            self._closed = True
            self._takers.clear()
            self._sources.clear()
            self._early.clear()
        self._on_loss(fault)

    def _set_stage(self) -> None:
        """Log what depends on how much floor there is to see; it takes the place of what was."""
        from twin.recording.map_eye import declare_map_eye
        from twin.recording.shapes import declare_floor

        declare_floor(self._recording, self._stage.low, self._stage.high)
        declare_map_eye(self._recording, self._stage.low, self._stage.high)
