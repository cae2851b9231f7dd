"""The voxels that a costmap has marked, as boxes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from twin.navigation.costmaps.voxel_layer import marked_voxels
from twin.recording.channels.channel import Context
from twin.recording.channels.spatial import SpatialChannel
from twin.recording.columns import Chunk, Component, sim_time

if TYPE_CHECKING:
    from twin.bridge.topics import Sample

MOST_VOXELS = 4000
"""Of a grid that are shown, evenly spread over it."""
_COLOUR = (255, 150, 40, 160)
_GAP = 0.9
"""Share of a voxel that its box fills, so that one can be told from the next."""
_CENTRES, _HALF_SIZES = Component(rr.Boxes3D, "centers"), Component(rr.Boxes3D, "half_sizes")


class Voxels(NamedTuple):
    """What is shown of a VoxelGrid."""

    centres: NDArray[np.float32]
    """Shape (n, 3) [m]."""
    half_size: NDArray[np.float32]
    """Of all of them, shape (3,) [m]."""


class VoxelChannel(SpatialChannel[Voxels]):
    """nav2_msgs/VoxelGrid as boxes; of voxels that are free or unknown nothing is shown."""

    def __init__(self, context: Context, namespace: str, topic: str) -> None:
        super().__init__(context, namespace, topic)
        self.declare(rr.Boxes3D.from_fields(colors=[_COLOUR], fill_mode="solid"))

    def take(self, sample: Sample[Any]) -> None:
        """Keep the marked voxels; a grid with more or fewer columns than it says is not shown."""
        grid = sample.message
        columns = np.asarray(grid.data, dtype=np.uint32)
        if columns.size != grid.size_x * grid.size_y or not 0 < grid.size_z <= 16:
            return
        marked = marked_voxels(columns.reshape(grid.size_y, grid.size_x), grid.size_z)
        marked = marked[:: -(-len(marked) // MOST_VOXELS) or 1]
        corner, edges = grid.origin, grid.resolutions
        edge = np.array((edges.x, edges.y, edges.z))
        centres = (corner.x, corner.y, corner.z) + (marked + 0.5) * edge
        half = (0.5 * _GAP * edge).astype(np.float32)
        self.put(sample, Voxels(centres.astype(np.float32).reshape(-1, 3), half))

    def draw(self, rows: list[tuple[int, Voxels]]) -> Iterator[Chunk]:
        """Yield the boxes."""
        times, grids = zip(*rows, strict=True)
        lengths = [len(grid.centres) for grid in grids]
        halves = np.concatenate([np.tile(grid.half_size, (len(grid.centres), 1)) for grid in grids])
        columns = (
            _CENTRES.column(np.concatenate([grid.centres for grid in grids]), lengths),
            _HALF_SIZES.column(halves, lengths),
        )
        yield self.entity, sim_time(times), columns
