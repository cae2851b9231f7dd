"""Maps at another resolution."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from twin.errors import MapError
from twin.navigation.maps.occupancy_map import OccupancyMap

_TOUCH = 1e-6
"""A cell that another one only touches, by this share of itself, does not lie under it."""
MOST_CELLS = 400_000_000
"""A bigger map is a slip of the pen: 20 000 x 20 000 cells are a square kilometre at 5 cm."""

LARGEST_CELL = 1e6
"""[m]"""


def resampled(occupancy: OccupancyMap, resolution: float) -> OccupancyMap:
    """Return a map with cells of another size [m] and the same origin.

    A cell gets the highest occupancy under it, so no wall is lost; it is unknown if everything under it is.

    Raises:
        MapError: the resolution is not positive or no size of a map, or the map would be too big.
    """
    if not 0.0 < resolution <= LARGEST_CELL:
        raise MapError(
            f"resolution {resolution:g}; valid is a positive number of metres up to {LARGEST_CELL:g}"
        )
    ratio = resolution / occupancy.resolution
    # Compared as a product: the square of a ratio may be 0.
    if occupancy.width * occupancy.height > MOST_CELLS * ratio**2:
        raise MapError(
            f"resolution {resolution:g} m makes more than {MOST_CELLS} cells; valid is a coarser one"
        )
    data = _coarser(_coarser(occupancy.data, ratio).T, ratio).T
    return OccupancyMap(data=data, resolution=resolution, origin=occupancy.origin)


def _coarser(data: NDArray[np.int8], ratio: float) -> NDArray[np.int8]:
    """Return the highest value of the rows under each new row, which is `ratio` old rows high."""
    rows = data.shape[0]
    count = max(1, math.ceil(rows / ratio - _TOUCH))
    edges = np.arange(count + 1) * ratio
    first = np.clip(np.floor(edges[:-1] + _TOUCH).astype(np.int64), 0, rows - 1)
    last = np.clip(np.ceil(edges[1:] - _TOUCH).astype(np.int64), first + 1, rows)
    out = data[first].copy()
    for step in range(1, int((last - first).max())):
        np.maximum(out, data[np.minimum(first + step, last - 1)], out=out)
    return out
