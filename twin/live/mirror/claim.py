"""What the physical lidar sees against what it should see from where localisation says that the robot is."""

from __future__ import annotations

from typing import Self

from twin.geometry import Pose2
from twin.live.calibration.expected_scan import ExpectedScan
from twin.live.divergence.evidence import Fit
from twin.live.divergence.histories import PoseHistory
from twin.live.divergence.scans import Scan, compare
from twin.navigation.maps.occupancy_map import UNKNOWN, OccupancyMap
from twin.runtime.defaults.from_description import scan_lidar
from twin.runtime.stacks.robot import RobotStack
from twin.sensors.lidar import Lidar
from twin.sim.world import World

_PERIOD_NS = 400_000_000


class Claim:
    """Looks at the model's world from the claimed place; the virtual robot may be somewhere else."""

    def __init__(self, expected: ExpectedScan, occupancy: OccupancyMap | None) -> None:
        """Take what is expected anywhere, and the map that localisation has, if it has one."""
        self._expected, self._map = expected, occupancy
        self._claimed = PoseHistory()
        self._seen: tuple[Scan, Pose2] | None = None
        """The scan that is looked at next, and its lidar on the base."""
        self._looked_ns: int | None = None

    @classmethod
    def of(cls, stack: RobotStack, world: World) -> Self | None:
        """Return that of a robot; None if it has no lidar that can be thought to be elsewhere."""
        spec = scan_lidar(stack.handle.description)
        lidar = next((sensor for sensor in stack.handle.sensors if sensor.spec is spec), None)
        if not isinstance(lidar, Lidar) or not stack.handle.is_free:
            return None
        return cls(ExpectedScan(world, stack.handle, lidar), stack.context.map)

    def forget(self) -> None:
        """Forget all: what comes is stamped by another clock."""
        self._claimed.clear()
        self._seen = self._looked_ns = None

    def say(self, stamp_ns: int, pose: Pose2) -> None:
        """Take where localisation finds the base."""
        self._claimed.add(stamp_ns, pose)

    def see(self, scan: Scan, T_base_lidar: Pose2) -> None:
        """Take what the physical lidar measured; of the scans of a while one is looked at."""
        if self._looked_ns is None or not 0 <= scan.stamp_ns - self._looked_ns < _PERIOD_NS:
            self._seen, self._looked_ns = (scan, T_base_lidar), scan.stamp_ns

    def look(self) -> Fit | None:
        """Return how the next scan fits, if it is known by now where it was taken; between two steps."""
        if self._seen is None:
            return None
        scan, T_base_lidar = self._seen
        base = self._claimed.at(scan.stamp_ns)
        if base is None:
            return None
        self._seen = None
        lidar = base.pose @ T_base_lidar
        there = Scan(
            stamp_ns=scan.stamp_ns,
            angle_min=scan.angle_min,
            angle_increment=scan.angle_increment,
            range_max=scan.range_max,
            ranges=self._expected(lidar).ranges,
        )
        on_map = self._map is None or self._map.value_at(base.pose[:2]) != UNKNOWN
        match = compare(there, scan, Pose2(0.0, 0.0, 0.0))
        return Fit(match=match, pose=base.pose, on_map=bool(on_map))
