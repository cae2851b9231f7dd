"""The image of a lens made of those of pinholes, pixel by pixel."""

from __future__ import annotations

import math
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array, Pose3, matrix_from_quat_wxyz
from twin.models.lens import Lens
from twin.models.optical_frames import T_CAMERA_OPTICAL
from twin.models.wide_lens import WideLens

T = TypeVar("T", np.float32, np.uint16)
_WIDEST = 2.0
"""How much larger than the camera's image the drawn one may be, each way."""
_EDGE = 1e-9
"""What is so near to the edge of a face belongs to it."""
_AHEAD = Pose3.from_xyz_rpy()
_CUBE = tuple(
    Pose3.from_xyz_rpy(rpy=(0.0, pitch * math.pi / 2.0, yaw * math.pi / 2.0))
    for pitch, yaw in ((0, 0), (0, 1), (0, -1), (-1, 0), (1, 0), (0, 2))
)
"""Ahead, left, right, up, down and behind, of what looks along +x."""


class Source:
    """What is drawn for a camera, of which its lens makes its image.

    For a pinhole that is the image itself. For a distorted one it is an image as large as what the lens
    sees, with the same focal lengths; for a wide-angle camera, as many faces of a cube as its lens sees.
    """

    def __init__(self, lens: Lens | WideLens) -> None:
        self.size = lens.width, lens.height
        """Width and height of what is drawn, of each view [pixels]."""
        self.focal_lengths = lens.focal_lengths
        """Of each view, along u and v [pixels]."""
        self.centre = lens.centre
        """Where the axis of each view meets it [pixels]."""
        self.turns: tuple[Pose3, ...] = (_AHEAD,)
        """Where the views look, from the camera's frame, which looks along +x."""
        self.lit = 1.0
        """Which part of the image shows something, from 0 to 1."""
        self._is_same = isinstance(lens, Lens) and not lens.is_distorted
        if self._is_same:
            return
        view, at = self._on_cube(lens) if isinstance(lens, WideLens) else self._on_plane(lens)
        self.centre = (self.size[0] - 1) / 2.0, (self.size[1] - 1) / 2.0
        self._unseen = ~((at >= 0.0) & (at <= np.array(self.size) - 1)).all(axis=-1)
        self.lit = max(1.0 - float(self._unseen.mean()), 1.0 / self._unseen.size)
        at[self._unseen] = 0.0
        width, height = self.size
        u, v = np.rint(at).astype(np.intp).transpose(2, 0, 1)
        self._nearest = (view * height + v) * width + u
        low = np.minimum(np.floor(at).astype(np.intp), np.array(self.size) - 2)
        corner = (view * height + low[..., 1]) * width + low[..., 0]
        self._corners = [corner + step for step in (0, 1, width, width + 1)]
        right, down = (at - low).transpose(2, 0, 1)
        shares = ((1 - right) * (1 - down), right * (1 - down), (1 - right) * down, right * down)
        # For each colour, though all are alike: numpy multiplies arrays of one shape several times as fast.
        self._shares = [np.repeat(share.astype(np.float32)[..., None], 3, axis=-1) for share in shares]

    def smooth(self, drawn: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return an image of colours, black where the lens sees nothing, shape (height, width, 3)."""
        if self._is_same:
            return drawn
        pixels = drawn.reshape(-1, 3)
        mixed = np.full_like(self._shares[0], 0.5)
        for corner, share in zip(self._corners, self._shares, strict=True):
            mixed += pixels.take(corner, axis=0) * share
        image = mixed.astype(np.uint8)
        image[self._unseen] = 0
        return image

    def nearest(self, drawn: NDArray[T], nothing: float = np.nan) -> NDArray[T]:
        """Return an image of depths or numbers, `nothing` where the lens sees none: none lies between two."""
        if self._is_same:
            return drawn
        image = drawn.ravel()[self._nearest]
        image[self._unseen] = nothing
        return image

    def _on_plane(self, lens: Lens) -> tuple[NDArray[np.intp], Array]:
        """Settle the size of the one view; return where in it the pixels are."""
        seen = lens.rays() * lens.focal_lengths
        most = _WIDEST * np.array(self.size) / 2.0 + np.abs(np.subtract(lens.centre, lens.middle))
        reach = np.minimum(np.nanmax(np.abs(seen), axis=(0, 1)), most)
        self.size = 2 * math.ceil(reach[0] + 1.0), 2 * math.ceil(reach[1] + 1.0)
        return np.zeros(seen.shape[:2], np.intp), seen + (np.array(self.size) - 1) / 2.0

    def _on_cube(self, lens: WideLens) -> tuple[NDArray[np.intp], Array]:
        """Settle which faces are drawn; return for each pixel on which it is, and where in it.

        The middles of the outermost pixels of a face are on the edges of the cube.
        """
        self.size = lens.texture_size, lens.texture_size
        self.focal_lengths = ((lens.texture_size - 1) / 2.0,) * 2
        seen = lens.directions()
        face, at = np.zeros(seen.shape[:2], np.intp), np.full((*seen.shape[:2], 2), np.nan)
        turns: list[Pose3] = []
        for turn in _CUBE:
            T_optical_view = T_CAMERA_OPTICAL.inverse() @ turn @ T_CAMERA_OPTICAL
            x, y, z = (seen @ matrix_from_quat_wxyz(T_optical_view.quat_wxyz)).transpose(2, 0, 1)
            mine = np.isnan(at[..., 0]) & (np.maximum(np.abs(x), np.abs(y)) < z + _EDGE)
            if mine.any():
                face[mine] = len(turns)
                beside = np.clip(np.stack((x, y), axis=-1)[mine] / z[mine][:, None], -1.0, 1.0)
                at[mine] = (beside + 1.0) * self.focal_lengths[0]
                turns.append(turn)
        self.turns = tuple(turns) or (_AHEAD,)
        return face, at
