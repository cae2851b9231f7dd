"""What a lidar would see at one time, out of four depth images."""

from __future__ import annotations

import math
from functools import cached_property

import mujoco
import numpy as np
from numpy.typing import NDArray

from twin.errors import SimulationError
from twin.geometry import Array, Pose3
from twin.models.specs import CameraSpec
from twin.sim.cameras.camera import Camera
from twin.sim.cameras.eyes import Eyes
from twin.sim.sensors.sensor import Mount

_SIDES = 4
"""Images, of 90 degrees each: ahead, to the left, behind, to the right."""
_NEAR = 0.01
"""Nothing is seen that is nearer [m]."""
_LARGEST = 1e6
"""Size of an image that is too large anyway [pixels]."""


def size_of(step: float, elevation: float) -> tuple[int, int]:
    """Return width and height of an image [pixels].

    In its middle, where they are widest, pixels are no wider than `step` [rad], so that no two rays fall into
    one, and a ray is half a step away from the middle of its pixel at most. In its corners it shows what is
    at an `elevation` [rad].
    """
    width = min(2.0 / math.tan(min(step, 1.0)), _LARGEST)
    slope = math.tan(elevation) if elevation < math.pi / 2.0 else math.inf
    height = min(math.sqrt(2.0) * abs(slope) * width, _LARGEST)
    return math.ceil(width), 2 + math.ceil(height)


class DepthImages:
    """Looks in four directions from the origin of a link, and takes the pixels that rays would meet.

    Each ray goes through the middle of the nearest pixel, so that what it finds is on a surface: between two
    pixels there may be an edge. The link itself is not seen.
    """

    def __init__(
        self,
        mount: Mount,
        directions: Array,
        *,
        size: tuple[int, int],
        reach: float,
        name: str,
    ) -> None:
        """Choose the pixels; nothing is drawn before it is asked.

        Args:
            mount: The link.
            directions: Unit vectors in its frame, shape (n, 3).
            size: Width and height of an image [pixels].
            reach: Longest range [m].
            name: Of the lidar.
        """
        self._mount, self._name = mount, name
        width, height = size
        focal = width / 2.0
        azimuth = np.arctan2(directions[:, 1], directions[:, 0])
        side = np.rint(azimuth / (math.pi / 2.0)).astype(np.intp) % _SIDES
        turn = side * (math.pi / 2.0)
        ahead = np.cos(turn) * directions[:, 0] + np.sin(turn) * directions[:, 1]
        left = np.cos(turn) * directions[:, 1] - np.sin(turn) * directions[:, 0]
        column = np.rint((width - 1) / 2.0 - focal * left / ahead).astype(np.intp).clip(0, width - 1)
        row = np.rint((height - 1) / 2.0 - focal * directions[:, 2] / ahead).astype(np.intp)
        row = row.clip(0, height - 1)
        self._pixel = (side * height + row) * width + column
        # To the neighbour on the same image.
        self._aside = np.where(column < width - 1, 1, -1)
        self._below = np.where(row < height - 1, width, -width)
        self._left = ((width - 1) / 2.0 - column) / focal
        self._up = ((height - 1) / 2.0 - row) / focal
        self._length = np.sqrt(1.0 + self._left**2 + self._up**2)
        self._focal = focal
        cosine, sine = np.cos(turn) / self._length, np.sin(turn) / self._length
        self.own_directions = np.column_stack(
            (cosine - sine * self._left, sine + cosine * self._left, self._up / self._length)
        )
        """Unit vectors of the pixels that are taken, in the link's frame, shape (n, 3)."""
        self._sides = sorted(set(side.tolist()))
        self._cameras = [
            Camera(
                CameraSpec(
                    name=f"{name} {number}",
                    link=mount.link,
                    topic="",
                    rate_hz=1.0,
                    T_link_sensor=Pose3.from_xyz_rpy((0.0, 0.0, 0.0), (0.0, 0.0, number * math.pi / 2.0)),
                    horizontal_fov=math.pi / 2.0,
                    width=width,
                    height=height,
                    near=min(_NEAR, reach / 2.0),
                    far=reach * 2.0,
                ),
                mount,
            )
            for number in self._sides
        ]
        self._nearness = np.zeros((_SIDES, height, width), np.float32)
        """1 / z [1/m] of each pixel."""

    def cast(self) -> Array:
        """Return the distances, shape (n,) [m]; inf for nothing.

        Raises:
            SimulationError: Nothing can be drawn on this computer.
        """
        for number, camera in zip(self._sides, self._cameras, strict=True):
            self._eyes.look_for_rays(camera, self._nearness[number])
        self._inverse = self._nearness.reshape(-1)[self._pixel]
        with np.errstate(divide="ignore"):
            return self._length / self._inverse

    def cosines(self) -> NDArray[np.float64]:
        """Return the cosines between rays and surfaces of the last cast, shape (n,).

        1 / z of a plane is linear in the image, and its slopes are the normal: those from a pixel to its
        neighbour. At an edge the surface seems to be steep.
        """
        nearness, inverse = self._nearness.reshape(-1), self._inverse
        across = (nearness[self._pixel + self._aside] - inverse) * (self._aside * -self._focal)
        upwards = (nearness[self._pixel + self._below] - inverse) * np.copysign(self._focal, -self._below)
        rest = inverse - across * self._left - upwards * self._up
        size = np.sqrt(across**2 + upwards**2 + rest**2) * self._length
        return np.divide(inverse, size, out=np.zeros_like(size), where=size > 0.0)

    @cached_property
    def _eyes(self) -> Eyes:
        try:
            eyes = Eyes(self._mount.world, self._mount.world.spec_to_see(), self._cameras)
        except SimulationError as fault:
            raise SimulationError(
                f"lidar '{self._name}' of robot '{self._mount.robot}' looks at depth images: {fault}; "
                "without them: <method>instant</method>"
            ) from fault
        model = eyes.model
        own = model.body(self._mount.body).id
        model.geom_group[model.geom_bodyid == own] = mujoco.mjNGROUP - 1  # which is not drawn
        return eyes
