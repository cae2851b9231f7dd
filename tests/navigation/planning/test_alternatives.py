from __future__ import annotations

import numpy as np

from twin.geometry import Pose2
from twin.navigation.costmaps.costmap import Costmap
from twin.navigation.planning.config import ThetaStarConfig
from twin.navigation.planning.earlier_paths import avoiding
from twin.navigation.planning.planner import Planner

START, GOAL = Pose2(0.5, 2.5, 0.0), Pose2(9.5, 2.5, 0.0)


def walls(*gaps: float) -> Costmap:
    """A hall of 10 x 5 m, divided by a wall with gaps of 0.4 m at these heights."""
    costs = np.zeros((50, 100), dtype=np.uint8)
    costs[:, 50] = 254
    for gap in gaps:
        costs[round(gap * 10) : round(gap * 10) + 4, 50] = 0
    return Costmap(costs=costs, resolution=0.1)


def crossings(costmap: Costmap, count: int) -> list[float]:
    planner, tried = Planner(config=ThetaStarConfig()), []
    for _ in range(count):
        tried.append(planner.create_plan(avoiding(costmap, tried), START, GOAL))
    return [float(np.interp(5.05, path[:, 0], path[:, 1])) for path in tried]


def test_each_try_takes_another_gap_the_short_ways_first() -> None:
    first, second, third = crossings(walls(0.5, 2.3, 3.9), 3)
    assert 2.3 < first < 2.7
    assert 3.9 < second < 4.3
    assert 0.5 < third < 0.9


def test_the_only_way_is_tried_again() -> None:
    assert all(2.3 < y < 2.7 for y in crossings(walls(2.3), 2))


def test_a_strip_along_a_tried_path_becomes_dear_but_not_where_every_way_must_pass() -> None:
    """By default half a metre to each side, from a metre off both ends on; what was closed stays so."""
    costmap = walls(2.3)
    costmap.costs[20:30, 30] = 100
    costmap.costs[24, 70] = 255
    path = np.column_stack([np.arange(0.55, 9.5, 0.1), np.full(90, 2.45)])
    dear = avoiding(costmap, [path]).costs
    want = costmap.costs.copy()
    strip = want[19:30, 11:89]  # the first cell that counts is 1.1 m from the start
    strip[strip < 253] = np.minimum(strip[strip < 253].astype(int) + 200, 252)
    assert dear.tolist() == want.tolist()
    assert avoiding(costmap, [path, path]).costs[24, 60] == 252
