"""What all kinds of faults have in common."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Protocol

from twin.errors import nearest
from twin.geometry import Pose2, Pose3
from twin.sim.noise import NoiseStream
from twin.strict_yaml import Fault as Wrong
from twin.strict_yaml import Faults as Wrongs

if TYPE_CHECKING:
    from twin.bridge.bus import Bus
    from twin.nodes.diff_drive_controller import DiffDriveControllerNode
    from twin.nodes.sensor_publishers import SensorPublisher
    from twin.scenario.observation import Zone
    from twin.sim.robot import RobotHandle
    from twin.sim.world import World


class Effect(NamedTuple):
    """What came of a fault so far."""

    is_seen: bool
    """Whether anything is otherwise than it would be without it."""
    text: str
    """What, with numbers: `12 of 80 messages lost`."""


class Robot(Protocol):
    """What faults need of a robot."""

    name: str
    handle: RobotHandle
    sensors: list[SensorPublisher]
    drive: DiffDriveControllerNode | None

    @property
    def manipulator(self) -> Manipulator | None:
        """Its arm, if it has one."""

    def standing(self, pose: Pose2) -> Pose3:
        """Return the pose of the base when it stands on the floor at `pose`."""


class Manipulator(Protocol):
    """An arm with a gripper."""

    @property
    def gripper_joint(self) -> str:
        """The joint that closes it."""


class Comers(Protocol):
    """The obstacles that come and go."""

    def come(self, name: str, pose: Pose2 | None = None) -> None:
        """Put one where it starts, or elsewhere."""

    def leave(self, name: str) -> None:
        """Take one away."""

    def gap(self, name: str, base: Pose2) -> float:
        """Return how far a robot's base is from one [m]."""


@dataclass(frozen=True, kw_only=True)
class FaultContext:
    """What there is in a run that can fail."""

    world: World
    bus: Bus
    robots: Mapping[str, Robot]
    obstacles: Comers
    held: Callable[[], Mapping[str, str]]
    """Who holds each good that is in a gripper."""
    mission_state: Callable[[], str]
    control_period_ns: int
    zones: Mapping[str, Zone] = field(default_factory=dict)
    streams: Mapping[str, str] = field(default_factory=dict)
    """What the random numbers of each fault depend on, by its name."""


class Fault(ABC):
    """A fault of a run: prepared when the run is built, it begins once and may end once.

    What the run lacks, the constructor refuses by `refuse`. Random numbers come from `noise`: they depend on
    the run's seed and the fault's label or kind alone, so a fault changes nobody else's.
    """

    Config: ClassVar[type[Any]]
    """What a scenario may say of it: a frozen dataclass that derives from `FaultConfig`."""
    value: ClassVar[str] = ""
    """The key that a single number stands for: `wheel_radius: 0.97`."""
    is_of_robot: ClassVar[bool] = False
    """Whether it is of one robot, which must be named if there are several."""

    def __init__(self, name: str, config: Any, context: FaultContext) -> None:
        """Prepare.

        Args:
            name: Its label, or its kind.
            config: An object of its `Config`.
            context: The run.

        Raises:
            Faults: The run lacks what is to fail.
        """
        self.name, self.config, self.context = name, config, context
        self.text = name
        """What the log says when it begins; empty: nothing."""
        self.end_text = ""
        """What it says when it ends; empty: that it is over."""

    @abstractmethod
    def begin(self) -> None:
        """Let it happen; takes effect with the next step."""

    def end(self) -> None:  # noqa: B027  (most that happens once has no end)
        """Let all be as before."""

    def update(self) -> None:  # noqa: B027
        """Look at what came of it; called once a tick from its beginning to its end, after the physics."""

    @property
    @abstractmethod
    def effect(self) -> Effect:
        """What came of it so far."""

    @property
    def robots(self) -> frozenset[str]:
        """Robots whose nodes or hardware it changes, which therefore run in the process of the physics."""
        return frozenset()

    def noise(self, part: str = "") -> NoiseStream:
        """Return the stream of one random part of it."""
        stream = self.context.streams.get(self.name, self.name)
        return NoiseStream(self.context.world.seed, f"faults/{stream}/{part}")


class FaultOfRobot(Fault):
    """A fault of one robot, whose config is a `RobotFault`."""

    is_of_robot = True

    def __init__(self, name: str, config: Any, context: FaultContext) -> None:
        super().__init__(name, config, context)
        robots = context.robots
        self.robot = robots[config.robot] if config.robot is not None else next(iter(robots.values()))
        self.hardware = self.robot.handle.hardware

    @property
    def robots(self) -> frozenset[str]:
        """The robot."""
        return frozenset({self.robot.name})


def refuse(key: str, message: str) -> Wrongs:
    """Return the error of a fault that does not fit the run; `key` of its config is wrong, '' if all is."""
    return Wrongs([Wrong((key,) if key else (), message)])


def one_of(what: str, name: str, valid: Iterable[str], key: str, robot: str) -> None:
    """See that a robot has what a key of a fault names; raises Faults, with what is valid."""
    names = list(valid)
    if name not in names:
        known = nearest(name, names) if names else "it has none"
        raise refuse(key, f"robot '{robot}' has no {what} '{name}'; {known}")


def some(what: str, name: str | None, valid: Sequence[str], key: str, robot: str) -> list[str]:
    """Return what a key of a fault names, all if it is not given; raises Faults as `one_of`."""
    if name is not None:
        one_of(what, name, valid, key, robot)
        return [name]
    if not valid:
        raise refuse("", f"robot '{robot}' has no {what}")
    return list(valid)
