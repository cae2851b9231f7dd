"""The image of a lens made of that of a pinhole, pixel by pixel."""

from __future__ import annotations

import math
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from twin.models.lens import Lens

T = TypeVar("T", np.float32, np.uint16)
_WIDEST = 2.0
"""How much larger than the camera's image the drawn one may be, each way."""


class Source:
    """The image that is drawn for a camera: as large as what its lens sees, with the same focal length.

    Without distortion it is the camera's image itself.
    """

    def __init__(self, lens: Lens) -> None:
        self.size = lens.width, lens.height
        """Width and height of what is drawn [pixels]."""
        self._is_same = not lens.is_distorted
        if self._is_same:
            return
        seen = lens.rays() * lens.focal_length
        most = _WIDEST * np.array(self.size) / 2.0
        reach = np.minimum(np.nanmax(np.abs(seen), axis=(0, 1)), most)
        self.size = 2 * math.ceil(reach[0] + 1.0), 2 * math.ceil(reach[1] + 1.0)
        at = seen + (np.array(self.size) - 1) / 2.0
        self._unseen = ~((at >= 0.0) & (at <= np.array(self.size) - 1)).all(axis=-1)
        at[self._unseen] = 0.0
        u, v = np.rint(at).astype(np.intp).transpose(2, 0, 1)
        self._nearest = v * self.size[0] + u
        low = np.minimum(np.floor(at).astype(np.intp), np.array(self.size) - 2)
        corner = low[..., 1] * self.size[0] + low[..., 0]
        self._corners = [corner + step for step in (0, 1, self.size[0], self.size[0] + 1)]
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
