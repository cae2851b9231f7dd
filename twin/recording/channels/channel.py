"""What a topic on its way into the recording looks like to the sink."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import rerun as rr

from twin.geometry import Pose3
from twin.periods import Period
from twin.recording.frames import Frames
from twin.recording.mounted import Mounted
from twin.recording.rows import Row, Rows

if TYPE_CHECKING:
    from twin.bridge.topics import Sample
    from twin.recording.channels.spatial import GridChannel


@dataclass(frozen=True, kw_only=True)
class Context:
    """What every channel needs."""

    recording: rr.RecordingStream
    frames: Frames
    true_pose: Callable[[str], Pose3]
    """Returns the pose of a body in `world`, now."""
    start_ns: int
    """Simulated time at which the recording begins [ns]."""
    period: Period
    """Trails and errors are sampled at its multiples [ns]."""
    trail_step_m: float
    """Length of a segment of a trail [m]."""
    max_particles: int
    radii: Mapping[str, float]
    """Of robots, on the floor [m]."""
    wheels: Mapping[str, Collection[str]]
    """By robot: joints that are not worth a plot, as they turn without end."""
    cameras: Mapping[str, Mounted]
    """By topic: what makes the pictures there."""
    images_period: Period | None
    """At its multiples [ns] pictures are kept; None: at no time."""
    truths: Collection[str] = ()
    """Topics of what cameras of ground truth tell: labels in colours, and boxes."""
    images: Literal["jpeg", "h264"] = "jpeg"
    """As what."""
    pictures: set[str] = field(default_factory=set)
    """Topics of what cameras see in colours."""
    seen_from: dict[str, str] = field(default_factory=dict)
    """By topic of pictures: the frame that their messages name."""
    hung: set[str] = field(default_factory=set)
    """Those whose pictures hang in space, before their camera."""
    grids: dict[str, GridChannel] = field(default_factory=dict)
    """By topic: those that are open."""


class Channel(Rows[Row]):
    """One topic on its way into the recording: `take` puts rows aside, `chunks` draws them."""

    def __init__(self, context: Context, namespace: str, topic: str) -> None:
        super().__init__()
        self.context = context
        self.recording = context.recording
        self.namespace = namespace
        """'' or a robot's name."""
        self.robot = context.frames.robot(namespace)
        self.topic = topic

    @abstractmethod
    def take(self, sample: Sample[Any]) -> None:
        """Keep what is shown of a message, which itself is only lent."""
