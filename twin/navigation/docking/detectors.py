"""Detectors: where the boxes are that a gripper is to take, seen by a planar lidar."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np

from twin.geometry import Array, Pose2
from twin.navigation.docking.faces import find_box_faces
from twin.parameters import Metres, Positive


class Detector(ABC):
    """Finds what is to be grasped in one scan."""

    Config: ClassVar[type | None] = None
    """The class of its parameters: a frozen dataclass; None: it has none."""

    def __init__(self, config: Any) -> None:
        """Take an object of its `Config`."""
        self.config = config

    @abstractmethod
    def detect(self, points: Array) -> Sequence[Pose2]:
        """Return the centres of the front faces, that nearest to straight ahead first.

        Args:
            points: Shape (n, 2), in the base frame, in the order of the beams, some NaN [m].

        Returns:
            In the base frame, x into the box.
        """


@dataclass(frozen=True, kw_only=True)
class BoxFacesConfig:
    """What a box looks like."""

    width: Annotated[Metres, Positive] = 0.24
    """Width of its face [m]."""
    width_tolerance: Annotated[Metres, Positive] = 0.035
    """How far a face may be off it [m]."""
    max_x: Annotated[Metres, Positive] = 1.8
    """Points further ahead of the base are not looked at [m]."""
    max_y: Annotated[Metres, Positive] = 0.8
    """Points further aside are not looked at [m]."""


class BoxFaces(Detector):
    """Finds faces of one width."""

    Config = BoxFacesConfig

    def detect(self, points: Array) -> Sequence[Pose2]:
        """Return their centres."""
        config = self.config
        near = (points[:, 0] < config.max_x) & (np.abs(points[:, 1]) < config.max_y)
        if np.count_nonzero(near) < 5:
            return []
        faces = find_box_faces(points[near], config.width, width_tolerance=config.width_tolerance)
        return [face.pose for face in faces]
