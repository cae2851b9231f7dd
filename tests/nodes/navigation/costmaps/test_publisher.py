"""Costmaps as whole grids and updates: whoever listens, from whenever on, has the costmap of now."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from tests.nodes.conftest import Bench
from twin.bridge.msgs import Costmap as CostmapMessage
from twin.bridge.msgs import CostmapUpdate, OccupancyGrid, OccupancyGridUpdate
from twin.bridge.qos import LATCHED, QoS
from twin.navigation.costmaps.costmap import Costmap
from twin.nodes.navigation.costmaps.publisher import CostmapPublisher

ALL = QoS(history="keep_all", reliability="reliable", durability="transient_local")
EMPTY = Costmap(costs=np.zeros((20, 30), np.uint8), resolution=0.1, origin=(1.0, 2.0))


class Heard:
    """All messages of a costmap, and those that somebody who comes now is given."""

    def __init__(self, bench: Bench) -> None:
        self.bench = bench
        self.wholes = bench.listen(OccupancyGrid, "/c/costmap", ALL)
        self.updates = bench.listen(OccupancyGridUpdate, "/c/costmap_updates", ALL)
        self.raw_wholes = bench.listen(CostmapMessage, "/c/costmap_raw", ALL)
        self.raw_updates = bench.listen(CostmapUpdate, "/c/costmap_raw_updates", ALL)

    def late(self) -> tuple[np.ndarray, np.ndarray]:
        """Return both grids of who comes now."""
        topics = (
            (OccupancyGrid, "/c/costmap"),
            (OccupancyGridUpdate, "/c/costmap_updates"),
            (CostmapMessage, "/c/costmap_raw"),
            (CostmapUpdate, "/c/costmap_raw_updates"),
        )
        got = [self.bench.listen(kind, topic, LATCHED) for kind, topic in topics]
        self.bench.tick()
        whole, update, raw, raw_update = (messages[-1] if messages else None for messages in got)
        grid = whole.data.reshape(whole.info.height, whole.info.width).copy()
        costs = raw.data.reshape(raw.metadata.size_y, raw.metadata.size_x).copy()
        lay(grid, update, update and (update.width, update.height))
        lay(costs, raw_update, raw_update and (raw_update.size_x, raw_update.size_y))
        return grid, costs


def lay(grid: np.ndarray, update: Any, size: Any) -> None:
    """As Nav2's CostmapSubscriber and RViz do."""
    if update is not None:
        width, height = size
        window = update.data.reshape(height, width)
        grid[update.y : update.y + height, update.x : update.x + width] = window


def publisher(bench: Bench, *, always_send_full: bool = False) -> CostmapPublisher:
    return CostmapPublisher(bench.node, "/c", "map", always_send_full=always_send_full)


def test_who_comes_late_has_the_costmap_of_now(bench: Bench) -> None:
    """Whenever that is: with nothing, with updates, with a whole grid that follows on updates."""
    rng = np.random.default_rng(1)
    heard, own = Heard(bench), publisher(bench)
    costmap = EMPTY
    table = {0: 0, 253: 99, 254: 100, 255: -1}
    for step in range(30):
        costs = costmap.costs.copy()
        x, y = rng.integers(0, 25), rng.integers(0, 15)
        if step % 7:  # sometimes nothing changes
            costs[y : y + 5, x : x + 5] = rng.choice([0, 1, 100, 252, 253, 254, 255], (5, 5))
        origin = (1.0 + step, 2.0) if step % 11 == 10 else costmap.origin
        costmap = replace(costmap, costs=costs, origin=origin)
        own.publish(costmap, bench.clock.now_ns)
        grid, raw = heard.late()
        assert np.array_equal(raw, costs), step
        assert grid.ravel().tolist() == [
            table.get(c, 1 + 97 * (c - 1) // 251) for c in costs.ravel().tolist()
        ]
    assert len(heard.wholes) == len(heard.raw_wholes) < 10
    assert len(heard.updates) == len(heard.raw_updates) > 20


def test_one_update_makes_good_for_those_that_were_lost(bench: Bench) -> None:
    heard, own = Heard(bench), publisher(bench)
    costmap = EMPTY
    for x in range(4):
        costs = costmap.costs.copy()
        costs[2 * x, 3 * x] = 254
        costmap = replace(costmap, costs=costs)
        own.publish(costmap, bench.clock.now_ns)
    bench.tick()
    (whole,), last = heard.raw_wholes, heard.raw_updates[-1]
    costs = whole.data.reshape(20, 30).copy()
    lay(costs, last, (last.size_x, last.size_y))
    assert np.array_equal(costs, costmap.costs)
    assert (last.x, last.y, last.size_x, last.size_y) == (3, 2, 7, 5)
    assert last.header.frame_id == "map"


def test_updates_cost_no_more_than_whole_grids_would(bench: Bench) -> None:
    """If all changes all the time, every second message is a whole grid; none is lost."""
    heard, own = Heard(bench), publisher(bench)
    for step in range(12):
        own.publish(replace(EMPTY, costs=np.full((20, 30), step, np.uint8)), bench.clock.now_ns)
    bench.tick()
    cells = sum(len(message.data) for message in (*heard.raw_wholes, *heard.raw_updates))
    assert cells <= 12 * 600


def test_always_send_full_costmap(bench: Bench) -> None:
    heard, own = Heard(bench), publisher(bench, always_send_full=True)
    for _ in range(3):
        own.publish(EMPTY, bench.clock.now_ns)
    bench.tick()
    assert (len(heard.wholes), len(heard.updates), len(heard.raw_updates)) == (3, 0, 0)
