"""How a camera projects: the pinhole and its distortion, as sensor_msgs/CameraInfo tells them.

Points are in the optical frame of REP-103: x to the right, y down, z forward. The centre of the first pixel
is (0, 0), so that the middle of an image is at ((W - 1) / 2, (H - 1) / 2).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from twin.geometry import Array

_ROUNDS = 100
"""Steps in which a distorted point is undistorted, at most; a mild lens needs ten."""
_CLOSE = 1e-9
"""A point is found when it moves by less, on the plane z = 1."""


@dataclass(frozen=True, kw_only=True)
class Lens:
    """A pinhole with the distortion model `plumb_bob` (Brown 1966)."""

    width: int
    """[pixels]"""
    height: int
    """[pixels]"""
    horizontal_fov: float
    """Full angle [rad] that the image would have without distortion."""
    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)
    """k1, k2, p1, p2, k3, in the order of CameraInfo's D."""
    intrinsics: tuple[float, float, float, float] | None = None
    """fx, fy, cx, cy [pixels], if the field of view does not tell them: of pixels that are not square, or an
    axis beside the middle."""

    @property
    def focal_lengths(self) -> tuple[float, float]:
        """Along u and v [pixels]."""
        if self.intrinsics is not None:
            return self.intrinsics[:2]
        return (self.width / 2.0 / math.tan(self.horizontal_fov / 2.0),) * 2

    @property
    def focal_length(self) -> float:
        """Along u, in which two views of a scene differ [pixels]."""
        return self.focal_lengths[0]

    @property
    def middle(self) -> tuple[float, float]:
        """Of the image [pixels]."""
        return (self.width - 1) / 2.0, (self.height - 1) / 2.0

    @property
    def centre(self) -> tuple[float, float]:
        """Where the optical axis meets the image [pixels]."""
        return self.middle if self.intrinsics is None else self.intrinsics[2:]

    @property
    def matrix(self) -> Array:
        """K of CameraInfo, shape (3, 3)."""
        (fx, fy), (cx, cy) = self.focal_lengths, self.centre
        return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])

    @property
    def model(self) -> tuple[str, tuple[float, ...]]:
        """CameraInfo's distortion model and D."""
        return "plumb_bob", self.distortion

    @property
    def is_distorted(self) -> bool:
        """Whether straight lines are bent."""
        return any(self.distortion)

    def project(self, points: Array) -> Array:
        """Return where points, shape (n, 3) [m] with z > 0, are seen: u, v, shape (n, 2) [pixels]."""
        return self._pixels(self.distorted(points[:, :2] / points[:, 2:]))

    def rays(self) -> Array:
        """Return the x and y on the plane z = 1 of what each pixel sees, shape (height, width, 2)."""
        (cx, cy), f = self.centre, self.focal_lengths
        seen = np.stack(np.meshgrid(np.arange(self.width) - cx, np.arange(self.height) - cy), axis=-1) / f
        return self.undistorted(seen.reshape(-1, 2)).reshape(seen.shape)

    def distorted(self, points: Array) -> Array:
        """Return where points of the plane z = 1, shape (n, 2), seem to be."""
        if not self.is_distorted:
            return points
        k1, k2, p1, p2, k3 = self.distortion
        x, y = points.T
        r2 = x * x + y * y
        radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
        return np.stack(
            (
                x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
                y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
            ),
            axis=1,
        )

    def undistorted(self, points: Array) -> Array:
        """Return what seems to be at points of the plane z = 1, shape (n, 2); nan where nothing does."""
        if not self.is_distorted:
            return points
        found = points.copy()
        for _ in range(_ROUNDS):
            off = self.distorted(found) - points
            if float(np.abs(off).max(initial=0.0)) < _CLOSE:
                break
            found -= off
            np.clip(found, -1e3, 1e3, out=found)
        lost = np.abs(self.distorted(found) - points).max(axis=1) > 1e-4
        found[lost] = np.nan
        return found

    def _pixels(self, points: Array) -> Array:
        return points * self.focal_lengths + self.centre
