"""Entities that have a place from the start of a run on, whenever their first message comes."""

from __future__ import annotations

import numpy as np
import rerun as rr

from twin.recording.columns import TIMELINE
from twin.recording.frames import WORLD


class Placed:
    """The frame that an entity is drawn in.

    It is `world` until something is drawn: an entity without a place is an error in every view. Not static,
    since what is static can never change, and frames of the robot's belief are not there from the start.
    """

    def __init__(self, recording: rr.RecordingStream, entity: str, start_ns: int) -> None:
        """Begin in `world`, at the start of the run [ns]."""
        self._recording = recording
        self._entity = entity
        self._frame = ""
        self.attach(WORLD, start_ns)

    def attach(self, frame: str, time_ns: int) -> None:
        """Say that what follows is in this frame."""
        if frame != self._frame:
            self._frame = frame
            self._recording.set_time(TIMELINE, duration=np.timedelta64(time_ns, "ns"))
            self._recording.log(self._entity, rr.CoordinateFrame(frame))
