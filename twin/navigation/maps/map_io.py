"""Map images to occupancy, with the exact rules of nav2_map_server (map_io.cpp)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from twin.navigation.maps.map_image import read_image
from twin.navigation.maps.map_yaml import MapMetadata, read_metadata
from twin.navigation.maps.occupancy_map import FREE, OCCUPIED, UNKNOWN, OccupancyMap


def load_map(path: Path) -> OccupancyMap:
    """Read a map; `~` is the home folder.

    Raises:
        MapError: every fault of the YAML file at once, or that of the image.
    """
    return load_image(read_metadata(path.expanduser()))


def load_image(metadata: MapMetadata) -> OccupancyMap:
    """Read the image of a map whose YAML file is read.

    Raises:
        MapError: it is no image.
    """
    gray, alpha = read_image(metadata.image)
    data = occupancy_from_gray(gray, alpha, metadata)
    return OccupancyMap(data=data[::-1], resolution=metadata.resolution, origin=metadata.origin)


def occupancy_from_gray(
    gray: NDArray[np.uint8], alpha: NDArray[np.uint8] | None, metadata: MapMetadata
) -> NDArray[np.int8]:
    """Return the occupancy, shape (h, w), of an image of the same shape and row order.

    As Nav2 it computes in single precision, rounds halves up, and ignores `negate` and transparency of raw
    images. Source: nav2_map_server/src/map_io.cpp, loadMapFromFile.
    """
    if metadata.mode == "raw":
        return np.where(gray <= OCCUPIED, gray, UNKNOWN).astype(np.int8)
    # There are only 256 levels: a table of them is the whole rule.
    level = np.arange(256, dtype=np.float32) / np.float32(255.0)
    if not metadata.negate:
        level = np.float32(1.0) - level
    occupied_thresh, free_thresh = np.float32(metadata.occupied_thresh), np.float32(metadata.free_thresh)
    table = np.full(256, UNKNOWN, dtype=np.int8)
    if metadata.mode == "scale" and free_thresh < occupied_thresh:
        span = np.float32(metadata.occupied_thresh - metadata.free_thresh)
        scaled = (level - free_thresh) / span * np.float32(100.0)
        between = (level > free_thresh) & (level < occupied_thresh)
        table[between] = np.floor(scaled[between].astype(np.float64) + 0.5)
    table[level >= occupied_thresh] = OCCUPIED
    table[level <= free_thresh] = FREE
    data = table[gray]
    if alpha is not None:
        data[alpha < 255] = UNKNOWN
    return data
