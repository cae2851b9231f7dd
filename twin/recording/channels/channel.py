"""What a topic on its way into the recording looks like to the sink."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import rerun as rr

from twin.geometry import Pose3
from twin.recording.belief import Belief
from twin.recording.columns import Columns
from twin.recording.frames import Frames

if TYPE_CHECKING:
    from twin.bridge.topics import Sample


@dataclass(frozen=True, kw_only=True)
class Context:
    """What every channel needs."""

    recording: rr.RecordingStream
    frames: Frames
    belief: Callable[[str], Belief]
    """Returns the belief of a namespace's robot."""
    true_pose: Callable[[str], Pose3]
    """Returns the pose of a body in `world`, now."""
    start_ns: int
    """Simulated time at which the recording begins [ns]."""
    max_particles: int
    wheels: Mapping[str, Collection[str]]
    """By robot: joints that are not worth a plot, as they turn without end."""


class Channel(ABC):
    """One topic on its way into the recording."""

    def __init__(self, context: Context, namespace: str, topic: str) -> None:
        """Begin with no columns; a channel adds its own."""
        self.context = context
        self.namespace = namespace
        """'' or a robot's name."""
        self.robot = context.frames.robot(namespace)
        self.topic = topic
        self.columns: list[Columns[*tuple[Any, ...]]] = []
        """What is sent with a block."""

    @abstractmethod
    def take(self, sample: Sample[Any]) -> None:
        """Keep what is shown of a message."""

    def send(self, recording: rr.RecordingStream) -> None:
        """Send the block."""
        for columns in self.columns:
            columns.send(recording)
