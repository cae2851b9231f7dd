from dataclasses import dataclass

import numpy as np

from their_pack.used import USED
from twin.navigation.costmaps.costmap import LETHAL_OBSTACLE
from twin.navigation.costmaps.layer import Layer
from twin.navigation.planning.planner import GlobalPlanner, with_headings
from twin.navigation.planning.smoother import Smoother
from twin.parameters import Metres


class Straight(GlobalPlanner):
    def create_plan(self, costmap, start, goal):
        USED.add("Straight")
        if costmap.cost_at(-3.0, -3.0) == LETHAL_OBSTACLE:
            USED.add("Pit, as the planner sees it")
        points = np.linspace(start[:2], goal[:2], max(2, round(start.distance(goal) / 0.1)))
        return with_headings(points, goal.yaw)


class Every(Smoother):
    """Leaves every other pose out."""

    def smooth(self, path, costmap=None):
        USED.add("Every")
        return np.concatenate([path[:-1:2], path[-1:]])


class Pit(Layer):
    is_known = True

    @dataclass(frozen=True)
    class Config:
        x: Metres
        y: Metres

    def update_costs(self, grid, window):
        USED.add("Pit")
        column, row = grid.world_to_cell(self.config.x, self.config.y)
        if window.x0 <= column < window.x1 and window.y0 <= row < window.y1:
            grid.costs[row, column] = LETHAL_OBSTACLE
