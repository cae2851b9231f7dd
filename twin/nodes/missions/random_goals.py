"""A mission that has no end in sight: drive to one random place of the map after the other."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from twin.bridge.action_types import NavigateToPose
from twin.bridge.actions import ActionClient, ClientGoal
from twin.bridge.bus import Bus
from twin.bridge.msgs import OccupancyGrid, Odometry, new
from twin.bridge.qos import LATCHED
from twin.geometry import Array, Pose2
from twin.navigation.exploration.wavefront import travel_distances
from twin.navigation.maps.clearance import clearance as clearance_of
from twin.navigation.maps.occupancy_map import OccupancyMap
from twin.navigation.warm_up import warm_up_reach
from twin.nodes.messages import pose_stamped
from twin.nodes.missions.mission_node import PERIOD_NS, MissionNode
from twin.nodes.missions.random_goals_config import RandomGoalsConfig
from twin.nodes.navigation.mapping.map_server import occupancy_map
from twin.nodes.navigation.robot_pose import RobotPose


class RandomGoalsNode(MissionNode):
    """`/mission`: takes the map from `map`, counts metres on `odom`, sends goals to `navigate_to_pose`."""

    def __init__(
        self,
        bus: Bus,
        robot_pose: RobotPose,
        config: RandomGoalsConfig,
        *,
        seed: int | Sequence[int],
        namespace: str = "",
    ) -> None:
        super().__init__(bus, namespace=namespace)
        self._config = config
        self._robot_pose = robot_pose
        self._random = np.random.Generator(np.random.Philox(seed))
        self._map: OccupancyMap | None = None
        self._places: Array | None = None
        self._goal: ClientGoal | None = None
        self._tries: dict[Pose2, int] = {}
        """How often those goals were sent that are neither reached nor given up for good."""
        self._put_off: list[Pose2] = []
        self._place = Pose2(0.0, 0.0, 0.0)
        self._returning = False
        """Whether the last goal had been put off."""
        self._at: tuple[float, float] | None = None
        self.driven = 0.0
        """By odometry, so far [m]."""
        self.reached = 0
        """Goals so far."""
        self.failed = 0
        """Goals so far that the navigator gave up."""
        warm_up_reach()
        self._navigate = ActionClient(self.node, NavigateToPose, "navigate_to_pose")
        self.node.create_subscription(OccupancyGrid, "map", self._on_map, LATCHED)
        self.node.create_subscription(Odometry, "odom", self._on_odom, 1, frozen=True)
        self.node.create_timer(PERIOD_NS, self._tick)

    def _on_map(self, message: OccupancyGrid) -> None:
        self._map = occupancy_map(message)
        self._places = None

    def _on_odom(self, message: Odometry) -> None:
        position = message.pose.pose.position
        if self._at is not None:
            self.driven += math.hypot(position.x - self._at[0], position.y - self._at[1])
        self._at = position.x, position.y

    def _tick(self) -> None:
        robot = self._robot_pose.in_map()
        if self.done or robot is None or self._map is None:
            return
        if self._goal is not None and not self._settle(self._goal):
            return
        if self.driven >= self._config.distance:
            self._tell_goals()
            self.finish(succeeded=True)
            return
        if self._places is None:
            self._places = open_places(self._map, robot, self._config.clearance)
        goal = self._next(robot)
        if goal is None:
            self.note("the map has no free place that far away from the robot")
            self.finish(succeeded=False)
            return
        self._send(goal)

    def _next(self, robot: Pose2) -> Pose2 | None:
        """Return a goal that was put off, or after such a one a new one."""
        self._returning = bool(self._put_off) and not self._returning
        goal = None if self._returning else self._draw(robot)
        return self._put_off.pop(0) if goal is None and self._put_off else goal

    def _send(self, goal: Pose2) -> None:
        self._place = goal
        self._tries[goal] = self._tries.get(goal, 0) + 1
        self.enter(f"goal {self.reached + self.failed + 1}: ({goal.x:.2f}, {goal.y:.2f})")
        target = pose_stamped(goal, self._robot_pose.frames.map, self.node.now_ns)
        self._goal = self._navigate.send_goal(new(NavigateToPose.Goal, pose=target))

    def _settle(self, goal: ClientGoal) -> bool:
        """Return whether the next goal may be sent."""
        if goal.accepted is not False and not goal.done:
            return False
        self._goal = None
        tries = self._tries[self._place]
        if goal.succeeded:
            self.reached += 1
        elif tries <= self._config.retries:
            self._put_off.append(self._place)
            self._returning = True  # first another one
            return True
        else:
            self.failed += 1
            self.note(getattr(goal.result, "error_msg", "") or goal.error or "the goal was given up")
            if self.failed > self._config.max_failed:
                self.finish(succeeded=False)
        del self._tries[self._place]
        return not self.done

    def _tell_goals(self) -> None:
        left = "".join(f", put off ({goal.x:.2f}, {goal.y:.2f})" for goal in self._put_off)
        self.node.get_logger().info(f"{self.reached} goals reached, {self.failed} given up{left}")

    def _draw(self, robot: Pose2) -> Pose2 | None:
        assert self._places is not None
        away = np.hypot(self._places[:, 0] - robot.x, self._places[:, 1] - robot.y)
        places = self._places[away >= self._config.min_goal_distance]
        if not len(places):
            return None
        x, y = places[self._random.integers(len(places))].tolist()
        return Pose2(x, y, float(self._random.uniform(-math.pi, math.pi)))


def open_places(grid: OccupancyMap, robot: Pose2, clearance: float) -> Array:
    """Return the centres, shape (n, 2) [m], of free cells with clearance that are connected to the robot.

    Args:
        grid: The map.
        robot: Where it is on it.
        clearance: From everything that is not free [m].
    """
    free = np.pad(grid.data == 0, 1)  # beyond the map nothing is known to be free
    to_centres = clearance_of(free, math.ceil(clearance / grid.resolution + 1.0))[1:-1, 1:-1]
    room = (to_centres - 0.5) * grid.resolution >= clearance
    cells = np.argwhere(room)[:, ::-1]
    if not len(cells):
        return np.zeros((0, 2))
    centres = grid.cell_to_world(cells)
    nearest = int(np.argmin(np.hypot(centres[:, 0] - robot.x, centres[:, 1] - robot.y)))
    way = np.full(room.shape, np.inf)
    way[cells[nearest, 1], cells[nearest, 0]] = 0.0
    travel_distances(room, way)
    return centres[np.isfinite(way[room])]
