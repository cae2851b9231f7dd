"""What the checks see every few control ticks: the simulator's truth beside what the robots believe."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TypeVar

from twin.errors import ScenarioError, nearest
from twin.geometry import Pose2, Pose3
from twin.navigation.maps.occupancy_map import OccupancyMap
from twin.warehouse.footprint import Rectangle

T = TypeVar("T")


@dataclass(frozen=True, kw_only=True, slots=True)
class RobotObservation:
    """One robot."""

    pose: Pose3
    """True `T_world_base`."""
    estimate: Pose2 | None = None
    """Believed pose of the base in `map`, now; None if nobody localises."""
    odometry: Pose2 | None = None
    """Believed pose of the base in `odom`; None without odometry."""
    speed: float = 0.0
    """True planar speed of the base [m/s]."""
    work_J: float = 0.0
    """Mechanical work that its actuators have done so far; known only if a check asks for it [J]."""
    clearance: float | None = None
    """Smallest distance of its shapes from everything but itself and the floor; likewise [m]."""
    slip: float | None = None
    """Largest speed at which a driven wheel slides over the floor; likewise [m/s]."""
    goals: int = 0
    """Goals that its navigator has taken so far."""
    recoveries: int = 0
    """Recovery behaviours that its navigator has started so far."""
    recovering: bool = False
    """Whether one of them is under way."""
    goal: Pose2 | None = None
    """Where its navigator drives to, or last drove to, in `map`; None before the first goal."""
    map: OccupancyMap | None = None
    """The last map that it made and published; None if it makes none."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Held:
    """A good in a gripper."""

    robot: str
    """Who holds it."""
    T_gripper_good: Pose3
    """Its pose in the gripper, now."""


@dataclass(frozen=True, kw_only=True, slots=True)
class ContactObservation:
    """A robot, or goods that it carries, touch something that is neither itself nor the floor."""

    robot: str
    """The robot."""
    body: str
    """Its link, or the goods."""
    other: str
    """What it touches: an obstacle, a good, a wall, another robot."""
    force_N: float
    """Normal force [N]."""
    carried: bool = False
    """Whether `body` is goods; what they are taken from and set down on does not count."""

    def by_the_other(self, robots: Collection[str]) -> ContactObservation | None:
        """Return the same contact as the other robot's; None if it is with no robot's link."""
        robot, _, body = self.other.partition("/")
        if self.carried or not body or robot not in robots:
            return None
        other = f"{self.robot}/{self.body}"
        return ContactObservation(robot=robot, body=body, other=other, force_N=self.force_N)


@dataclass(frozen=True, kw_only=True, slots=True)
class Observation:
    """One observation."""

    time_ns: int
    """Simulated time [ns]."""
    robots: Mapping[str, RobotObservation] = field(default_factory=dict)
    goods: Mapping[str, Pose3] = field(default_factory=dict)
    """True `T_world_good`."""
    held: Mapping[str, Held] = field(default_factory=dict)
    """Only the goods that are in a gripper."""
    contacts: Sequence[ContactObservation] = ()
    """Of all control ticks since the last observation, the hardest of each pair."""
    moved: Collection[str] = ()
    """What has moved since the start: robots, with their base or a joint, goods and obstacles."""
    mission_state: str = ""
    mission_done: bool = False
    mission_succeeded: bool | None = None
    """None until the mission is done."""
    mission_reason: str = ""
    """Why it failed."""

    @property
    def time_s(self) -> float:
        """Simulated time [s]."""
        return self.time_ns / 1e9


@dataclass(frozen=True, kw_only=True)
class Zone:
    """A rectangle on a level surface where goods are put down."""

    centre: Pose2
    """Its centre and direction in the world."""
    size: tuple[float, float]
    """Extent along its own x and y [m]."""
    height: float = 0.0
    """Height of the surface [m]."""

    @cached_property
    def T_zone_world(self) -> Pose2:
        """What maps the world to the zone."""
        return self.centre.inverse()


def outside_distance(zone: Zone, pose: Pose3) -> float:
    """Return how far the origin of `pose` is outside of the zone's rectangle [m]; 0 inside."""
    x, y, _ = pose.xyz.tolist()
    local = zone.T_zone_world @ Pose2(x, y, 0.0)
    dx = max(0.0, abs(local.x) - zone.size[0] / 2.0)
    dy = max(0.0, abs(local.y) - zone.size[1] / 2.0)
    return math.hypot(dx, dy)


@dataclass(frozen=True, kw_only=True)
class Surroundings:
    """What a robot's lidar can see and where the robot can get to: the truth, for checks of maps."""

    solids: tuple[Rectangle, ...]
    """Sections of what never moves with the plane of the lidar, in the world."""
    start: Pose2
    """Where the robot starts."""
    radius: float
    """Its inscribed radius [m]."""


@dataclass(frozen=True, kw_only=True)
class CheckContext:
    """What checks need to know beforehand; the runtime fills it once."""

    robots: tuple[str, ...] = ()
    """Names of the robots, in the scenario's order."""
    zones: Mapping[str, Zone] = field(default_factory=dict)
    good_bottoms: Mapping[str, float] = field(default_factory=dict)
    """Distance from each good's origin down to its underside [m]."""
    surroundings: Mapping[str, Surroundings] = field(default_factory=dict)
    """Of each robot that has a lidar."""
    topics: Callable[[], Mapping[str, str]] = dict
    """Returns the message types of the topics that the run's nodes publish or hear, by name."""

    def robot(self, name: str | None) -> str:
        """Return the robot a check is about, without a name the only one; raises ScenarioError for none."""
        if name is None and len(self.robots) == 1:
            return self.robots[0]
        if name not in self.robots:
            what = "must name its robot" if name is None else f"names the robot '{name}', which is not there"
            raise ScenarioError(f"a check {what}; valid: {', '.join(self.robots)}")
        return name

    def zone(self, name: str) -> Zone:
        """Return a zone; raises ScenarioError naming the arena's zones."""
        return _named("zone", name, self.zones)

    def good_bottom(self, name: str) -> float:
        """Return the distance from a good's origin to its underside [m]; raises ScenarioError likewise."""
        return _named("tote", name, self.good_bottoms)

    def topic_type(self, name: str) -> str:
        """Return the message type of a topic; raises ScenarioError likewise."""
        topics = self.topics()
        if name not in topics:
            raise ScenarioError(f"no node of the run has the topic '{name}'; {nearest(name, topics)}")
        return topics[name]


def _named(what: str, name: str, valid: Mapping[str, T]) -> T:
    if name not in valid:
        message = f"a check names the {what} '{name}', which the arena lacks"
        raise ScenarioError(f"{message}; {nearest(name, valid)}")
    return valid[name]
