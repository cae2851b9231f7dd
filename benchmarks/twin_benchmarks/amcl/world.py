"""A run of the warehouse that the benchmark ticks itself, with the truth beside the belief."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import ndimage

from twin.bridge.conversions import twist_from_planar
from twin.bridge.msgs import LaserScan, Twist
from twin.bridge.qos import SENSOR_DATA
from twin.bridge.topics import Sample
from twin.geometry import Array, Pose2, wrap_angle
from twin.navigation.maps.occupancy_map import FREE, OccupancyMap
from twin.runtime.build import build
from twin.runtime.run import Run
from twin.runtime.stacks.robot import RobotStack
from twin.scenario.schema import Scenario
from twin.warehouse.map_files import named_map

ROBOT = "warehouse_bot"
Tap = Callable[[Sample[Any]], None]


@dataclass(frozen=True, kw_only=True)
class PoseError:
    """Belief less truth."""

    x: float
    """[m]"""
    y: float
    """[m]"""
    yaw: float
    """[rad]"""

    @property
    def xy(self) -> float:
        """Distance [m]."""
        return math.hypot(self.x, self.y)


@contextmanager
def opened(
    mission: dict[str, Any], seed: int, *, navigation: bool, tap: Tap | None = None
) -> Iterator[Bench]:
    """Yield the warehouse with its robot, on a bus that nobody else takes part in."""
    robot: dict[str, Any] = {
        "model": ROBOT,
        "start": "start",
        "localisation": {
            "type": "amcl",
            "map": "warehouse",
            "initial_pose_error": {"xy": 0.2, "yaw": math.radians(5.0)},
        },
    }
    if navigation:
        robot["navigation"] = {}
    scenario = Scenario.model_validate(
        {
            "name": "amcl",
            "seed": seed,
            "duration": 1e6,
            "world": {"arena": "warehouse"},
            "robots": [robot],
            "mission": mission,
            "checks": [{"no_collision": {}}],
        }
    )
    parts = build(scenario, taps=[] if tap is None else [tap])
    try:
        yield Bench(Run(scenario, parts), parts.stacks[ROBOT])
    finally:
        parts.bus.close()


class Bench:
    """Ticks the run."""

    def __init__(self, run: Run, stack: RobotStack) -> None:
        self.run = run
        self.bus = run.bus
        self.stack = stack
        self._world = run.world

    @property
    def now_ns(self) -> int:
        """Simulated time [ns]."""
        return self._world.time_ns

    @property
    def truth(self) -> Pose2:
        """Where the robot is."""
        return self._world.pose(self.stack.handle.base).to_pose2()

    def tick(self) -> PoseError | None:
        """Advance; return the error at the beginning of the tick, which odometry told about in it."""
        truth = self.truth
        self.run.tick()
        belief = self.stack.robot_pose.in_map()
        return None if belief is None else error(belief, truth)

    def carry(self, pose: Pose2) -> None:
        """Put the robot somewhere else; its wheels notice nothing."""
        model, data, place = self._world.model, self._world.data, self.stack.standing(pose)
        joint = model.body(self.stack.handle.base).jntadr[0]
        position, velocity = model.jnt_qposadr[joint], model.jnt_dofadr[joint]
        data.qpos[position : position + 7] = (*place.xyz, *place.quat_wxyz)
        data.qvel[velocity : velocity + 6] = 0.0


def error(belief: Pose2, truth: Pose2) -> PoseError:
    """Return belief less truth."""
    return PoseError(x=belief.x - truth.x, y=belief.y - truth.y, yaw=wrap_angle(belief.yaw - truth.yaw))


class Places:
    """Random poses in the free space of the warehouse's map."""

    def __init__(self, seed: int, clearance: float = 0.7) -> None:
        """Take the seed, and the distance from everything that is on the map [m]."""
        occupancy = OccupancyMap.load(named_map("warehouse"))
        free = ndimage.distance_transform_edt(occupancy.data == FREE) * occupancy.resolution
        cells = np.argwhere(free > clearance)[:, ::-1].astype(np.float64)
        self._points: Array = occupancy.cell_to_world(cells)
        self._random = np.random.Generator(np.random.Philox(key=seed))

    def draw(self) -> Pose2:
        """Return the next one."""
        x, y = self._points[self._random.integers(len(self._points))]
        return Pose2(float(x), float(y), float(self._random.uniform(-math.pi, math.pi)))


class Wanderer:
    """Drives on by what the lidar sees: ahead while there is room, else turning to where there is more."""

    def __init__(self, bench: Bench) -> None:
        self.node = bench.bus.create_node("wanderer")
        self._commands = self.node.create_publisher(Twist, "cmd_vel", 10)
        self.node.create_subscription(LaserScan, "scan", self._on_scan, SENSOR_DATA)
        self._side = 1.0

    def _on_scan(self, scan: LaserScan) -> None:
        angles = scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges))
        ranges = np.minimum(scan.ranges, 5.0)
        ahead = float(ranges[np.abs(angles) < 0.5].min())
        if ahead > 1.2:
            self._side = 0.0
        elif self._side == 0.0:
            left, right = ranges[(angles > 0.3) & (angles < 1.8)], ranges[(angles < -0.3) & (angles > -1.8)]
            self._side = 1.0 if left.mean() > right.mean() else -1.0
        self._commands.publish(
            twist_from_planar(0.5, 0.0) if self._side == 0.0 else twist_from_planar(0.0, 0.8 * self._side)
        )
