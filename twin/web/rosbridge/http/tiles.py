"""A grid in pieces: pictures of 256 x 256 cells, at full size and at halves, quarters … of it. No I/O."""

from __future__ import annotations

import threading
import time
from io import BytesIO
from typing import Any

import numpy as np
from numpy.typing import NDArray

SIZE = 256
"""Cells of a tile on each side."""
_UNKNOWN = -1


class Tiles:
    """The newest state of an OccupancyGrid, and its tiles; filled in one thread, read in others.

    As in slippy maps z is 0 for the one tile that holds all, and each z more has twice the cells on each
    side. Here x and y count from the grid's origin, as its cells do. A coarse cell is the highest of those
    that it stands for: a wall of one cell is seen from far away.
    """

    def __init__(self) -> None:
        self.version = time.time_ns() // 1_000_000
        """More with each change; of another process it is another, too."""
        self._lock = threading.Lock()
        self._message: Any = None
        self._cells: NDArray[np.int8] = np.empty((0, 0), np.int8)
        self._versions: NDArray[np.int64] = np.empty((0, 0), np.int64)
        self._since = 0
        """Version with which the grid was put where it is."""
        self._update: Any = None
        self._made: dict[tuple[int, int, int], tuple[int, bytes]] = {}

    @property
    def levels(self) -> int:
        """How many z there are."""
        return ((max(*self._cells.shape, 1) - 1) // SIZE).bit_length() + 1

    def put(self, message: Any) -> None:
        """Take a nav_msgs/OccupancyGrid; one whose data is not of its size is none."""
        info = message.info
        if not info.width or not info.height or len(message.data) != info.width * info.height:
            return
        with self._lock:
            before, self._message = self._message, message
            cells = np.array(message.data, np.int8).reshape(info.height, info.width)
            if before is None or _place(before) != _place(message):
                self.version += 1
                self._since, self._cells = self.version, cells
                self._versions = np.full([-(-side // SIZE) for side in cells.shape], self.version)
                self._made.clear()
            else:
                self._change(0, 0, cells)
            if self._update is not None and _time(self._update) >= _time(message):
                self._lay(self._update)

    def patch(self, update: Any) -> None:
        """Lay a map_msgs/OccupancyGridUpdate over the grid; one that comes before it waits for it."""
        with self._lock:
            self._update = update
            if self._message is not None:
                self._lay(update)

    def forget(self) -> None:
        """Know nothing of any cell."""
        with self._lock:
            self._update = None
            self._change(0, 0, np.full_like(self._cells, _UNKNOWN))

    def describe(self, since: int | None = None) -> dict[str, Any]:
        """Return what the grid is, and which tiles of the greatest z are newer than a version.

        `changed` is null if all are: the grid has another size or place than it had then.
        """
        with self._lock:
            header, info = self._message.header, self._message.info
            changed = None
            if since is not None and since >= self._since:
                changed = np.argwhere(self._versions > since)[:, ::-1].tolist()
            position, orientation = info.origin.position, info.origin.orientation
            return {
                "frame_id": header.frame_id,
                "stamp": {"sec": header.stamp.sec, "nanosec": header.stamp.nanosec},
                "resolution": float(info.resolution),
                "width": int(info.width),
                "height": int(info.height),
                "origin": {
                    "position": {axis: getattr(position, axis) for axis in "xyz"},
                    "orientation": {axis: getattr(orientation, axis) for axis in "xyzw"},
                },
                "tile": SIZE,
                "levels": self.levels,
                "version": self.version,
                "changed": changed,
            }

    def png(self, z: int, x: int, y: int) -> tuple[int, bytes] | None:
        """Return a tile's version and its file, None if there is no such tile.

        A grey PNG, north above: 0 to 100 as in the grid, 255 is unknown; at the grid's edges it is smaller.
        """
        from PIL import Image

        with self._lock:
            if not 0 <= z < self.levels:
                return None
            times = 1 << (self.levels - 1 - z)
            covered = self._versions[y * times : (y + 1) * times, x * times : (x + 1) * times]
            if x < 0 or y < 0 or not covered.size:
                return None
            version = int(covered.max())
            made = self._made.get((z, x, y))
            if made is not None and made[0] == version:
                return made
            side = SIZE * times
            cells = self._cells[y * side : (y + 1) * side, x * side : (x + 1) * side].copy()
        file = BytesIO()
        Image.fromarray(_pooled(cells, times)[::-1].astype(np.uint8)).save(file, "png")
        with self._lock:
            self._made[z, x, y] = version, file.getvalue()
            return self._made[z, x, y]

    def _lay(self, update: Any) -> None:
        height, width = self._cells.shape
        if len(update.data) != update.width * update.height or update.x < 0 or update.y < 0:
            return
        if update.x + update.width > width or update.y + update.height > height or not len(update.data):
            return
        cells = np.array(update.data, np.int8).reshape(update.height, update.width)
        self._change(update.x, update.y, cells)

    def _change(self, x: int, y: int, cells: NDArray[np.int8]) -> None:
        """Lay cells over the grid, and note the tiles in which one is another than before."""
        rows, columns = slice(y, y + cells.shape[0]), slice(x, x + cells.shape[1])
        differs = self._cells[rows, columns] != cells
        if not differs.any():
            return
        self._cells[rows, columns] = cells
        self.version += 1
        lower = np.logical_or.reduceat(differs, _borders(y, cells.shape[0]), axis=0)
        changed = np.argwhere(np.logical_or.reduceat(lower, _borders(x, cells.shape[1]), axis=1))
        self._versions[changed[:, 0] + y // SIZE, changed[:, 1] + x // SIZE] = self.version


def _borders(start: int, count: int) -> list[int]:
    """Return where tiles begin in a row of cells that begins at `start` of the grid."""
    return [0, *range(SIZE - start % SIZE, count, SIZE)]


def _pooled(cells: NDArray[np.int8], times: int) -> NDArray[np.int8]:
    """Return the highest of each `times` x `times` cells."""
    height, width = (-(-side // times) for side in cells.shape)
    padding = [(0, height * times - cells.shape[0]), (0, width * times - cells.shape[1])]
    padded = np.pad(cells, padding, constant_values=_UNKNOWN)
    highest: NDArray[np.int8] = padded.reshape(height, times, width, times).max(axis=(1, 3))
    return highest


def _place(message: Any) -> tuple[Any, ...]:
    info = message.info
    position, orientation = info.origin.position, info.origin.orientation
    return (
        message.header.frame_id, info.width, info.height, info.resolution,
        position.x, position.y, position.z, orientation.x, orientation.y, orientation.z, orientation.w,
    )  # fmt: skip


def _time(message: Any) -> tuple[int, int]:
    return message.header.stamp.sec, message.header.stamp.nanosec
