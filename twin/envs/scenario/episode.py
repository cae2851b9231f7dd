"""One run between two resets, with a node of its own by which an agent hears and speaks."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from twin.bridge.msgs import ns
from twin.bridge.qos import QoS
from twin.bridge.topics import Publisher
from twin.envs.scenario.task import Task
from twin.errors import GymError, RecordingError, nearest
from twin.geometry import Pose2
from twin.runtime import OpenRun
from twin.runtime.stacks.robot import RobotStack
from twin.scenario.missions import Idle
from twin.scenario.schema import Scenario
from twin.scenario.verdict import Verdict

if TYPE_CHECKING:
    from twin.recording.live_screen import LiveScreen


class Heard:
    """The last message on a topic."""

    def __init__(self) -> None:
        self.message: Any = None
        self._at_ns = 0

    def take(self, message: Any, now_ns: int) -> None:
        """Keep a message that comes now."""
        stamp = getattr(getattr(message, "header", None), "stamp", None)
        self.message, self._at_ns = message, (0 if stamp is None else ns(stamp)) or now_ns

    def age(self, now_ns: int) -> float:
        """Return how old it is by its stamp, else since it came [s]; infinite if none has come."""
        return float("inf") if self.message is None else (now_ns - self._at_ns) * 1e-9


class Episode:
    """A run, the robot that the agent is about, its task, and what the agent's node has heard."""

    def __init__(
        self,
        scenario: Scenario,
        robot: str | None = None,
        *,
        ticks: int = 1,
        screen: LiveScreen | None = None,
    ) -> None:
        """Build the run, up to its first tick.

        Args:
            scenario: What to run.
            robot: Its name; None: the only one, or the only one with a mission.
            ticks: Control periods of a step of the agent.
            screen: Shows it, at the pace of real time.

        Raises:
            TwinError: The run cannot be made, or has no such robot.
        """
        robot = robot_of(scenario, robot)
        self.scenario = scenario
        self._opened = OpenRun(scenario, screen=screen, pace=None if screen is None else 1.0)
        self.run = run = self._opened.run
        self.parts, self.world = run.parts, run.world
        self.stack: RobotStack = run.parts.stacks[robot]
        self.step_s = max(1, ticks) * run.parts.control_period_ns * 1e-9
        """Simulated time of a step, if the agent is asked as often as it may be [s]."""
        self.verdict: Verdict | None = None
        """How the run ended; None while it goes on."""
        self.ticks = 0
        """Control ticks since the start."""
        self._publishers = {
            end.name: end for node in run.bus.nodes for end in node.endpoints if isinstance(end, Publisher)
        }
        context = self.stack.context
        try:
            self.node = run.bus.create_node("agent", context.namespace)
            self.task = Task(run.bus, run.parts.deciders, self.stack.robot_pose, context.namespace)
        except BaseException:
            self.close()
            raise

    # -- time ------------------------------------------------------------------------------------------------

    @property
    def time(self) -> float:
        """Simulated time since the start [s]."""
        return self.world.time_ns / 1e9

    @property
    def over(self) -> bool:
        """Whether the run has ended; its verdict is there."""
        return self.verdict is not None

    def advance(self, until: Callable[[], bool]) -> None:
        """Go on until a condition holds where an agent acts in a tick, or to the run's end and verdict.

        Raises:
            TwinError: The run cannot go on.
        """

        def counted() -> bool:
            self.ticks += 1
            return until()

        if not self._opened.advance_to_agent(counted):
            self.verdict = self._opened.finish()

    def close(self) -> None:
        """End the run as it stands. Harmless when repeated."""
        with suppress(RecordingError):  # the viewer was closed before
            self._opened.close()

    # -- what there is to know -------------------------------------------------------------------------------

    @property
    def belief(self) -> Pose2 | None:
        """Where the robot believes to be: in `map`, or in `odom` if nobody localises it."""
        pose = self.stack.robot_pose
        return pose.in_map() or (None if self.stack.context.config.is_localised else pose.in_odom())

    @property
    def truth(self) -> Pose2:
        """Where the robot is."""
        return self.world.pose(self.stack.handle.base).to_pose2()

    @property
    def speed(self) -> tuple[float, float]:
        """How fast its drive is at most: (v [m/s], w [rad/s])."""
        assert self.stack.drive is not None
        limits = self.stack.drive.config.drive
        return limits.linear.max_velocity, limits.angular.max_velocity

    @property
    def ground(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """The corners (x, y) of where the robot can get to: its map, else as far as it can drive [m]."""
        grid, start = self.stack.context.map, self.stack.context.start
        if grid is not None:
            x, y = grid.origin.x, grid.origin.y
            return (x, y), (x + grid.width * grid.resolution, y + grid.height * grid.resolution)
        far = (self.speed[0] if self.stack.drive else 1.0) * self.scenario.duration
        return (start.x - far, start.y - far), (start.x + far, start.y + far)

    def publishes(self, topic: str) -> bool:
        """Return whether somebody publishes a topic."""
        return self.node.resolve_name(topic) in self._publishers

    def publisher(self, topic: str) -> Publisher[Any]:
        """Return who publishes a topic.

        Raises:
            GymError: Nobody does.
        """
        name = self.node.resolve_name(topic)
        if name not in self._publishers:
            valid = [shown for shown in self._publishers if "/_action/" not in shown]
            raise GymError(f"the scenario '{self.scenario.name}' has no topic {name}; {nearest(name, valid)}")
        return self._publishers[name]

    def hear(self, topic: str) -> Heard:
        """Return what will always be the last message on a topic.

        Raises:
            GymError: Nobody publishes it.
        """
        heard, node, publisher = Heard(), self.node, self.publisher(topic)
        qos = QoS(depth=1, durability=publisher.qos.durability, reliability=publisher.qos.reliability)
        cls = publisher.codec.cls
        node.create_subscription(cls, topic, lambda m: heard.take(m, node.now_ns), qos, frozen=True)
        return heard


def robot_of(scenario: Scenario, name: str | None) -> str:
    """Return the robot that an agent is about.

    Raises:
        GymError: There is none of that name, or several to choose from.
    """
    robots = [robot.id for robot in scenario.robots]
    if name is not None:
        if name not in robots:
            raise GymError(f"the scenario '{scenario.name}' has no robot '{name}'; {nearest(name, robots)}")
        return name
    busy = [task.robot for task in scenario.tasks if not isinstance(task, Idle) and task.robot in robots]
    for choice in (robots, busy):
        if len(choice) == 1 and choice[0] is not None:
            return choice[0]
    raise GymError(
        f"the scenario '{scenario.name}' has several robots; say which one the agent is about with "
        f"robot=...: {', '.join(robots)}"
    )
