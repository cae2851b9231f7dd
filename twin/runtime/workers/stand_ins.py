"""What stands for the nodes and lidars of a robot that is in a worker."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from twin.geometry import Pose2
from twin.nodes.navigation.robot_pose import RobotPose
from twin.sensors.lidar import Lidar, LidarReading

if TYPE_CHECKING:
    from twin.runtime.stacks.robot import RobotStack


class Belief(NamedTuple):
    """What checks ask the nodes of a robot."""

    in_map: Pose2 | None
    in_odom: Pose2 | None
    goals: int = 0
    recoveries: int = 0
    recovering: bool = False
    goal: Pose2 | None = None


UNKNOWN = Belief(None, None)


def belief_of(stack: RobotStack) -> Belief:
    """Ask the nodes of a robot, where they are."""
    pose, navigator = stack.robot_pose, stack.navigator
    believed = Belief(pose.in_map(), pose.in_odom())
    if navigator is None:
        return believed
    return Belief(*believed[:2], navigator.goals, navigator.recoveries, navigator.recovering, navigator.goal)


class Told(RobotPose):
    """What a robot whose nodes are in a worker believed, and its navigator had done, when last observed."""

    def __init__(self, known: RobotPose, beliefs: dict[str, Belief], name: str) -> None:
        super().__init__(known.buffer, known.frames)
        self._beliefs, self._name = beliefs, name

    def in_map(self) -> Pose2 | None:
        """Return the pose in the map frame, None while the robot is not localised."""
        return self._belief.in_map

    def in_odom(self) -> Pose2 | None:
        """Return the pose in the odometry frame, None before the first odometry."""
        return self._belief.in_odom

    @property
    def goals(self) -> int:
        """Goals taken since the beginning of the run."""
        return self._belief.goals

    @property
    def recoveries(self) -> int:
        """Recovery behaviours started since the beginning of the run."""
        return self._belief.recoveries

    @property
    def recovering(self) -> bool:
        """Whether a recovery behaviour is under way."""
        return self._belief.recovering

    @property
    def goal(self) -> Pose2 | None:
        """The last goal that was taken, in the map frame."""
        return self._belief.goal

    @property
    def _belief(self) -> Belief:
        return self._beliefs.get(self._name, UNKNOWN)


class Scanned:
    """Stands for a lidar that a worker samples."""

    def __init__(self, lidar: Lidar) -> None:
        self.lidar, self.spec = lidar, lidar.spec
        self.reading: LidarReading | None = None

    def sample(self, time_ns: int) -> LidarReading:
        """Return what the worker has seen."""
        assert self.reading is not None
        assert self.reading.time_ns == time_ns
        return self.reading
