"""What a topic on its way into the recording looks like to the sink."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import rerun as rr

from twin.recording.belief import Belief
from twin.recording.columns import TIMELINE
from twin.recording.frames import Frames
from twin.recording.sources import Sample


class Channel(Protocol):
    """One topic on its way into the recording."""

    def take(self, sample: Sample) -> None:
        """Keep what is shown of a message."""

    def send(self, recording: rr.RecordingStream) -> None:
        """Send the block."""


@dataclass(frozen=True, kw_only=True)
class Context:
    """What every channel needs."""

    recording: rr.RecordingStream
    frames: Frames
    belief: Callable[[str], Belief]
    """Returns the belief of a namespace's robot."""
    max_particles: int
    joints: tuple[str, ...] | None


def set_time(recording: rr.RecordingStream, time_ns: int) -> None:
    """Set the simulated time of the rows logged next."""
    recording.set_time(TIMELINE, duration=np.timedelta64(time_ns, "ns"))
