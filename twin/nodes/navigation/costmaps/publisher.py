"""What a costmap publishes of its grid: all of it, or the window that has changed since."""

from __future__ import annotations

from twin.bridge.msgs import Costmap as CostmapMessage
from twin.bridge.msgs import CostmapUpdate, OccupancyGrid, OccupancyGridUpdate
from twin.bridge.node import Node
from twin.bridge.qos import LATCHED
from twin.navigation.costmaps.costmap import Costmap
from twin.navigation.costmaps.window import NOTHING, Window, differing, everything
from twin.nodes.navigation.costmaps.messages import (
    costmap_msg,
    costmap_update,
    occupancy_grid,
    occupancy_grid_update,
)


class CostmapPublisher:
    """nav2_costmap_2d's Costmap2DPublisher: `costmap` and `costmap_raw` with their `_updates`.

    Whole grids are published when size, resolution or origin have changed, updates otherwise. Nav2's hold
    what has changed since the message before; who comes late, and is given the last whole grid and the last
    update, sees with them what never was. Here they hold what has changed since the last whole grid: these
    two are always the costmap of now, and who has missed an update is right with the next one. Once updates
    have carried as many cells as the grid has, it is published again: that bounds what they cost.
    """

    def __init__(self, node: Node, prefix: str, frame: str, *, always_send_full: bool) -> None:
        """Make the publishers.

        Args:
            node: The costmap's.
            prefix: Of the topics, such as `/global_costmap`.
            frame: In which the cells lie.
            always_send_full: Whether updates are never published.
        """
        self._frame = frame
        self._always_send_full = always_send_full
        self._grid = node.create_publisher(OccupancyGrid, f"{prefix}/costmap", LATCHED)
        self._raw = node.create_publisher(CostmapMessage, f"{prefix}/costmap_raw", LATCHED)
        self._grid_update = node.create_publisher(OccupancyGridUpdate, f"{prefix}/costmap_updates", LATCHED)
        self._raw_update = node.create_publisher(CostmapUpdate, f"{prefix}/costmap_raw_updates", LATCHED)
        self._published: Costmap | None = None
        """As it was when it was published last."""
        self._window = NOTHING
        """That updates have changed since the last whole grid."""
        self._carried = 0
        """Cells of these updates."""

    def publish(self, costmap: Costmap, time_ns: int) -> None:
        """Publish a costmap, at this time [ns]."""
        before, costs = self._published, costmap.costs
        self._published = Costmap(costs=costs.copy(), resolution=costmap.resolution, origin=costmap.origin)
        if before is None or self._always_send_full or not _same_place(before, costmap):
            self._publish_all(costmap, time_ns)
            return
        changed = Window(*differing(before.costs, costs, everything(costs.shape)))
        self._window = self._window.joined(changed)
        self._carried += costs[self._window.slices].size
        if self._carried > costs.size:
            self._publish_all(costmap, time_ns)
        elif not self._window.empty:
            self._publish_update(costmap, self._window, time_ns)

    def _publish_all(self, costmap: Costmap, time_ns: int) -> None:
        self._grid.publish(occupancy_grid(costmap, self._frame, time_ns))
        self._raw.publish(costmap_msg(costmap, self._frame, time_ns))
        if not self._window.empty:  # who comes late must not lay the last update over this
            self._publish_update(costmap, NOTHING, time_ns)
        self._window, self._carried = NOTHING, 0

    def _publish_update(self, costmap: Costmap, window: Window, time_ns: int) -> None:
        self._grid_update.publish(occupancy_grid_update(costmap, window, self._frame, time_ns))
        self._raw_update.publish(costmap_update(costmap, window, self._frame, time_ns))


def _same_place(a: Costmap, b: Costmap) -> bool:
    return (a.resolution, a.origin, a.costs.shape) == (b.resolution, b.origin, b.costs.shape)
