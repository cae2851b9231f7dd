"""Which frontier to drive to next, and when a place is explored: explore_lite's greedy choice."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass

from twin.geometry import Pose2, wrap_angle
from twin.navigation.exploration.config import ExplorerConfig
from twin.navigation.exploration.frontiers import Frontier, FrontierMap
from twin.navigation.maps.occupancy_map import OccupancyMap


@dataclass(frozen=True, kw_only=True)
class Goal:
    """Where to drive."""

    pose: Pose2
    """In the map frame; it looks at the frontier."""
    target: tuple[float, float]
    """Nearest point of the frontier [m]."""


class Explorer:
    """Keeps one goal until its frontier is known, reached or given up; then the cheapest other one follows.

    Differs from explore_lite (github.com/hrnr/m-explore) where that hinders: goals lie before a frontier on
    known ground instead of at its centroid, ways are measured along the ground, and a goal is not dropped
    for another one while its frontier is there.
    """

    def __init__(self, config: ExplorerConfig | None = None) -> None:
        self.config = config or ExplorerConfig()
        self.goal: Goal | None = None
        """Where the robot is to drive now; None when nothing is left, and before the first map."""
        self.frontiers: tuple[Frontier, ...] = ()
        """Of the last map, without those given up, the cheapest first."""
        self.given_up: list[tuple[float, float]] = []
        """Points of frontiers that could not be reached or seen [m] (explore_lite's blacklist)."""
        self.explored = False
        """Whether the last map had no frontier left but those given up."""
        self.reached = 0
        """Goals that were reached, or seen from afar."""
        self._visits: Counter[tuple[float, float]] = Counter()
        self._progress = (math.inf, 0.0)

    def update(self, grid: OccupancyMap, pose: Pose2, time_s: float) -> Goal | None:
        """Return where to drive, from a map and the robot's pose in it; the same object while it stays.

        Args:
            grid: The map so far.
            pose: Of the robot, in the map frame.
            time_s: Now [s].
        """
        seen = self._look(grid, pose)
        if self.goal is not None:
            current = self._same(self.goal.target)
            if current is None:
                self.reached += 1
            elif not self._times_out(current, time_s):
                return self.goal
            else:
                self.given_up.append(self.goal.target)
                seen = self._look(grid, pose)
        self.explored = bool(seen.reachable.any()) and not self.frontiers
        self.goal = self._choose(seen, time_s)
        return self.goal

    def _look(self, grid: OccupancyMap, pose: Pose2) -> FrontierMap:
        config = self.config
        seen = FrontierMap(
            grid, (pose.x, pose.y), config.frontiers, leave_out=self.given_up, around=config.same_place
        )
        self.frontiers = tuple(sorted(seen.frontiers, key=lambda frontier: self.cost(frontier, pose)))
        return seen

    def cost(self, frontier: Frontier, pose: Pose2) -> float:
        """Return what the choice minimises."""
        config = self.config
        bearing = math.atan2(frontier.target[1] - pose.y, frontier.target[0] - pose.x)
        turn = abs(wrap_angle(bearing - pose.yaw))
        return (
            config.potential_scale * frontier.distance
            + config.orientation_scale * turn
            - config.gain_scale * frontier.size
        )

    def arrived(self) -> None:
        """Take that the robot stands at the goal; if its frontier is still there, it drives up to it once."""
        if self.goal is not None:
            place = self._place(self.goal.target)
            self._visits[place] += 1
            if self._visits[place] >= 2:
                self.given_up.append(self.goal.target)
            self.reached += 1
            self.goal = None

    def failed(self) -> None:
        """Take that the goal cannot be reached."""
        if self.goal is not None:
            self.given_up.append(self.goal.target)
            self.goal = None

    def _choose(self, seen: FrontierMap, time_s: float) -> Goal | None:
        if not self.frontiers:
            return None
        frontier = self.frontiers[0]
        visited = self._visits[self._place(frontier.target)] > 0
        pose = seen.view_of(frontier, 0.0 if visited else self.config.standoff)
        self._progress = (frontier.distance, time_s)
        return Goal(pose=pose, target=frontier.target)

    def _same(self, target: tuple[float, float]) -> Frontier | None:
        near = [(frontier.gap_to(target), i) for i, frontier in enumerate(self.frontiers)]
        gap, i = min(near, default=(math.inf, 0))
        return self.frontiers[i] if gap < self.config.same_place else None

    def _place(self, target: tuple[float, float]) -> tuple[float, float]:
        """Return the first visited point near a target, else the target itself."""
        for place in self._visits:
            if math.dist(place, target) < self.config.same_place:
                return place
        return target

    def _times_out(self, frontier: Frontier, time_s: float) -> bool:
        nearest, since = self._progress
        if frontier.distance < nearest - 0.05:
            self._progress = (frontier.distance, time_s)
            return False
        return time_s - since > self.config.progress_timeout
