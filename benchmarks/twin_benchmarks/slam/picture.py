"""A picture of a map with the path and the loops, as PNG."""

from __future__ import annotations

import struct
import zlib

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array
from twin.navigation.mapping.slam import Slam
from twin.navigation.maps.occupancy_map import FREE, UNKNOWN

PATH, LOOP = (40, 90, 220), (230, 60, 40)
WIDTH = 2
"""Of lines [cells]."""


def png(slam: Slam) -> bytes:
    """Return the map as seen from above, x to the right: walls black, path blue, loops red."""
    occupancy, graph = slam.map(), slam.graph()
    image = np.full((*occupancy.data.shape, 3), 0, dtype=np.uint8)
    image[occupancy.data == UNKNOWN] = 205
    image[occupancy.data == FREE] = 255
    cells = (graph.poses[:, :2] - occupancy.origin[:2]) / occupancy.resolution
    for first, second in graph.edges[graph.loops].tolist():
        _line(image, cells[first], cells[second], LOOP)
    for first, second in graph.edges[~graph.loops].tolist():
        _line(image, cells[first], cells[second], PATH)
    return _encoded(image[::-1])


def _line(image: NDArray[np.uint8], start: Array, end: Array, colour: tuple[int, int, int]) -> None:
    steps = int(np.abs(end - start).max()) * 2 + 2
    points = start + np.linspace(0.0, 1.0, steps)[:, None] * (end - start)
    for shift in range(WIDTH):
        column, row = (np.floor(points).astype(np.int64) + shift).T
        inside = (column >= 0) & (row >= 0) & (column < image.shape[1]) & (row < image.shape[0])
        image[row[inside], column[inside]] = colour


def _encoded(image: NDArray[np.uint8]) -> bytes:
    """Return an RGB image, shape (h, w, 3), as PNG (ISO/IEC 15948)."""
    height, width, _ = image.shape
    rows = b"".join(b"\0" + row.tobytes() for row in image)
    header = struct.pack(">2I5B", width, height, 8, 2, 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(rows, 9)), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        for kind, data in chunks
    )
