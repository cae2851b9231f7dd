"""Colours in one field: PCL's `rgb`, four bytes 0x00RRGGBB that are said to be a float."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from twin.clouds.points import Points

COLOURS = ("rgb", "rgba")
"""Fields that hold one; `rgba` has its opacity in the highest byte."""


def channels(field: Points) -> NDArray[np.uint8]:
    """Return red, green, blue and the highest byte of a field of four bytes, shape (n, 4)."""
    bits = np.ascontiguousarray(field).reshape(-1).astype(field.dtype.newbyteorder("="), copy=False)
    words = bits.view(np.uint32)[:, np.newaxis]
    return (words >> np.array((16, 8, 0, 24), np.uint32)).astype(np.uint8)


def packed_colour(parts: NDArray[np.uint8]) -> NDArray[np.uint32]:
    """Return the words of colours, shape (n, 3) or (n, 4) as `channels` returns them."""
    red, green, blue, *highest = parts.astype(np.uint32).T
    words: NDArray[np.uint32] = red << np.uint32(16) | green << np.uint32(8) | blue
    return words | highest[0] << np.uint32(24) if highest else words
