"""Where a camera is, for the pictures that it makes."""

from __future__ import annotations

from typing import NamedTuple

from twin.geometry import Pose3
from twin.models.lens import Lens
from twin.models.wide_lens import WideLens


class Mounted(NamedTuple):
    """A camera on a robot."""

    body: str
    """The frame of the recording that it is fixed to."""
    T_body_optical: Pose3
    lens: Lens | WideLens
