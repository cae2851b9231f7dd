"""Maps as pictures: colours for a file, characters for a terminal."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from twin.navigation.maps.occupancy_map import OCCUPIED, UNKNOWN, OccupancyMap

_FREE_RGB, _OCCUPIED_RGB, _UNKNOWN_RGB = (252, 252, 250), (24, 28, 36), (146, 160, 166)
_ZONE_RGB = ((214, 48, 49), (240, 150, 20), (60, 130, 230))
"""Colours of masks, in order."""
_AXES_RGB = ((220, 40, 40), (40, 160, 60))


def colours(
    occupancy: OccupancyMap, masks: Sequence[OccupancyMap] = (), *, size: int = 1000
) -> NDArray[np.uint8]:
    """Return a map as it looks from above, shape (h, w, 3), row 0 the highest y.

    Free cells are light, occupied ones dark, unknown ones grey; masks are laid over it, denser where their
    values are higher; the map frame's axes are a metre long, if its origin is on the map.

    Args:
        occupancy: The map.
        masks: Of any cells, in the same frame.
        size: The longer side gets about so many pixels, a whole number per cell; big maps keep their cells.
    """
    share = np.clip(occupancy.data, 0, OCCUPIED)[..., None] / OCCUPIED
    rgb = (1.0 - share) * np.array(_FREE_RGB) + share * np.array(_OCCUPIED_RGB)
    rgb[occupancy.data == UNKNOWN] = _UNKNOWN_RGB
    if masks:
        columns, rows = np.meshgrid(np.arange(occupancy.width), np.arange(occupancy.height))
        centres = occupancy.cell_to_world(np.stack([columns, rows], axis=-1))
        for k, mask in enumerate(masks):
            values = np.clip(mask.value_at(centres), 0, OCCUPIED)
            weight = np.where(values > 0, 0.25 + 0.4 * values / OCCUPIED, 0.0)[..., None]
            rgb = (1.0 - weight) * rgb + weight * np.array(_ZONE_RGB[k % len(_ZONE_RGB)])
    scale = max(1, size // max(occupancy.width, occupancy.height))
    picture = np.repeat(np.repeat(np.rint(rgb).astype(np.uint8), scale, axis=0), scale, axis=1)
    _draw_axes(picture, occupancy, scale)
    return np.ascontiguousarray(picture[::-1])


def _draw_axes(picture: NDArray[np.uint8], occupancy: OccupancyMap, scale: int) -> None:
    """Draw x red and y green, a metre each; row 0 of the picture is still the lowest y."""
    step = 0.2 * occupancy.resolution / scale
    along = np.arange(0.0, 1.0, step)
    thickness = max(1, max(picture.shape) // 400)
    for axis, colour in enumerate(_AXES_RGB):
        points = np.zeros((along.size, 2))
        points[:, axis] = along
        local = occupancy.origin.inverse().apply(points) / occupancy.resolution * scale
        columns, rows = np.floor(local).astype(np.int64).T
        for dx in range(thickness):
            for dy in range(thickness):
                x, y = columns + dx, rows + dy
                on = (x >= 0) & (x < picture.shape[1]) & (y >= 0) & (y < picture.shape[0])
                picture[y[on], x[on]] = colour


def characters(occupancy: OccupancyMap, *, width: int = 80, height: int = 40) -> list[str]:
    """Return a map as text: blocks are occupied, ░ is unknown, a blank free; two cells per character.

    Args:
        occupancy: The map.
        width: Characters at most.
        height: Lines at most.
    """
    step = max(1, math.ceil(occupancy.width / width), math.ceil(occupancy.height / (2 * height)))
    rows, columns = (math.ceil(n / step) for n in occupancy.data.shape)
    padded = np.full(((rows + rows % 2) * step, columns * step), UNKNOWN, dtype=np.int8)
    padded[: occupancy.height, : occupancy.width] = occupancy.data
    blocks = padded.reshape(rows + rows % 2, step, columns, step)[::-1]
    occupied = np.asarray((blocks > OCCUPIED // 2).any(axis=(1, 3)))
    unknown = np.asarray((blocks == UNKNOWN).mean(axis=(1, 3)) > 0.5)
    grey_too = unknown[::2] & unknown[1::2]
    lines = []
    for upper, lower, grey in zip(occupied[::2], occupied[1::2], grey_too, strict=True):
        code = np.where(upper, np.where(lower, 1, 2), np.where(lower, 3, np.where(grey, 4, 0)))
        lines.append("".join(" █▀▄░"[k] for k in code))
    return lines
