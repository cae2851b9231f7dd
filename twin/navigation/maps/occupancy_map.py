"""The static map of a place, as nav_msgs/OccupancyGrid defines it; also at another resolution."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from twin.errors import MapError
from twin.geometry import Array, Pose2

UNKNOWN = -1
FREE = 0
OCCUPIED = 100


@dataclass(frozen=True, kw_only=True, eq=False)
class OccupancyMap:
    """Occupancy of cells: -1 unknown, 0 free ... 100 occupied.

    Raises:
        MapError: the data are not 2-D int8 in [-1, 100], or the resolution is not positive.
    """

    data: NDArray[np.int8]
    """Shape (height, width), read-only; row 0 is the lowest y, column 0 the lowest x of the map frame."""
    resolution: float
    """Edge of a cell [m]."""
    origin: Pose2
    """Pose of the lower-left corner (not centre) of cell (0, 0) in the map frame."""

    def __post_init__(self) -> None:
        data = np.array(self.data, dtype=np.int8, order="C")
        if data.ndim != 2 or data.size == 0:
            raise MapError(f"map data has shape {data.shape}; valid is (height, width), both at least 1")
        if not np.array_equal(data, self.data) or data.min() < UNKNOWN or data.max() > OCCUPIED:
            raise MapError("map data has values outside -1 (unknown) and 0..100 (free..occupied)")
        if not (math.isfinite(self.resolution) and self.resolution > 0.0):
            raise MapError(f"map resolution is {self.resolution}; valid is a positive number of metres")
        data.setflags(write=False)
        object.__setattr__(self, "data", data)
        object.__setattr__(self, "origin", Pose2(*map(float, self.origin)))

    @staticmethod
    def load(path: str | Path) -> OccupancyMap:
        """Read a map_server YAML file and its image (PGM; PNG and others with pillow installed).

        Raises:
            MapError: every fault of the YAML file at once, or that of the image.
        """
        from twin.navigation.maps.map_image import load_map

        return load_map(Path(path))

    def save(self, path: str | Path, mode: Literal["trinary", "scale", "raw"] = "trinary") -> None:
        """Write `path` (.yaml) and an image of the same stem, as nav2_map_server's map saver does.

        Args:
            path: The YAML file.
            mode: "trinary" keeps free, occupied and unknown; "raw" every value; "scale" those from 25 to 65.
        """
        from twin.navigation.maps.map_saver import SaveParameters, save_map

        save_map(self, Path(path), SaveParameters(mode=mode))

    @property
    def width(self) -> int:
        """Number of columns (x)."""
        return int(self.data.shape[1])

    @property
    def height(self) -> int:
        """Number of rows (y)."""
        return int(self.data.shape[0])

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """Bounding box in the map frame: x_min, y_min, x_max, y_max [m]."""
        w, h = self.width * self.resolution, self.height * self.resolution
        corners = self.origin.apply([[0.0, 0.0], [w, 0.0], [0.0, h], [w, h]])
        low, high = corners.min(axis=0), corners.max(axis=0)
        return float(low[0]), float(low[1]), float(high[0]), float(high[1])

    def counts(self) -> dict[str, int]:
        """Return how many cells are free (0), occupied (100), unknown (-1) and between (1..99)."""
        found = np.bincount(self.data.view(np.uint8).ravel(), minlength=256)
        return {
            "free": int(found[FREE]),
            "occupied": int(found[OCCUPIED]),
            "unknown": int(found[255]),
            "between": int(found[1:OCCUPIED].sum()),
        }

    def world_to_cell(self, points: ArrayLike) -> NDArray[np.int64]:
        """Return cells (column, row) of points [m] in the map frame; both of shape (..., 2).

        A point outside gets a cell outside; see `contains`.
        """
        points = np.asarray(points, dtype=np.float64)
        local = self.origin.inverse().apply(points) if self.origin.yaw else points - self.origin[:2]
        return np.floor(local / self.resolution).astype(np.int64)

    def cell_to_world(self, cells: ArrayLike) -> Array:
        """Return the centres [m] in the map frame of cells (column, row); both of shape (..., 2)."""
        local = (np.asarray(cells, dtype=np.float64) + 0.5) * self.resolution
        return self.origin.apply(local) if self.origin.yaw else local + self.origin[:2]

    def contains(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Return for points [m], shape (..., 2), whether they lie on the map, shape (...)."""
        cells = self.world_to_cell(points)
        inside: NDArray[np.bool_] = np.all((cells >= 0) & (cells < (self.width, self.height)), axis=-1)
        return inside

    def value_at(self, points: ArrayLike) -> NDArray[np.int8]:
        """Return the occupancy at points [m], shape (..., 2) -> (...); -1 outside the map."""
        cells = self.world_to_cell(points)
        inside = np.all((cells >= 0) & (cells < (self.width, self.height)), axis=-1)
        clipped = np.clip(cells, 0, (self.width - 1, self.height - 1))
        return np.where(inside, self.data[clipped[..., 1], clipped[..., 0]], np.int8(UNKNOWN))


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
