"""One run: the tick, its order and its rates."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from twin.bridge.msgs import Clock as ClockMsg
from twin.bridge.msgs import stamp
from twin.runtime.build import Parts
from twin.runtime.observe import Observer
from twin.runtime.obstacles import ObstacleSchedule
from twin.runtime.sensing import SensorSchedule
from twin.scenario.checks import Check
from twin.scenario.outside import ALONE, Outside
from twin.scenario.schema import Scenario

if TYPE_CHECKING:
    from twin.bridge.topics import Publisher
    from twin.faults.schedule import FaultSchedule
    from twin.recording.sink import RerunSink
    from twin.runtime.on_board_battery import OnBoardBattery
    from twin.runtime.outside import Lockstep
    from twin.runtime.sensing import Due
    from twin.runtime.stacks.robot import RobotStack
    from twin.runtime.workers.workers import Workers
    from twin.sim.world import World

_OBSERVED_TICKS = 5
"""Checks see one observation in so many control ticks; the contacts of the others are in it."""
_SETTLE_NS = 1_000_000_000
"""The run goes on for so long after its mission has ended, so that the recording shows how it ended."""


class Run:
    """A built scenario that can be ticked; `PHASES` is the order of one tick."""

    PHASES = ("admit", "nodes", "actuate", "step", "sense", "clock", "sinks")
    THINKING = 2
    """So many phases are over when all nodes have run and nothing has been done yet: an agent's place."""

    def __init__(
        self,
        scenario: Scenario,
        parts: Parts,
        sink: RerunSink | None = None,
        outside: Outside = ALONE,
        *,
        endless: bool = False,
    ) -> None:
        self.scenario, self._endless = scenario, endless
        self.parts = parts
        self.world, self.bus = parts.world, parts.bus
        self._clock_publisher: Publisher[Any] | None = None
        if parts.clock.is_simulated:
            self._clock_publisher = self.bus.create_node("clock").create_publisher(ClockMsg, "/clock", 1)
        self.checks: tuple[Check, ...] = scenario.build_checks(parts.checks)
        goods = [good.name for good in self.world.scene.goods]
        needs = {field for check in self.checks for field in check.needs}
        self.observer = Observer(self.world, tuple(parts.stacks.values()), parts.mission, goods, needs)
        if any(check.topics for check in self.checks):
            from twin.runtime.topics import watch_topics

            watch_topics(self.bus, self.checks)
        self._sink = sink
        stacks = parts.stacks.values()
        due: list[Due] = [
            *(s for stack in stacks for s in stack.sensors),
            *(c for stack in stacks for c in stack.cameras),
        ]
        self.schedule = SensorSchedule(due, self.world.timestep_ns)
        self._observation_ns = _OBSERVED_TICKS * parts.control_period_ns
        self._substeps = parts.control_period_ns // self.world.timestep_ns
        self.bus.started()
        self.lockstep: Lockstep | None = None
        if outside.wait_for:
            from twin.runtime.outside import Lockstep

            self.lockstep = Lockstep(self.bus, outside)
        self.workers: Workers | None = None
        self.obstacles = ObstacleSchedule(
            self.world,
            scenario.world.obstacles,
            [stack.footprint for stack in parts.stacks.values()],
            parts.comers,
        )
        self.faults: FaultSchedule | None = self._schedule_faults() if scenario.faults else None
        self.batteries = _batteries(self.world, parts.stacks)  # after faults, which ask what motors can do
        """By robot."""
        self._phases = tuple(getattr(self, phase) for phase in self.PHASES)
        self._end_ns = round(scenario.duration * 1e9)
        """When the run ends, at the latest."""
        self._mission_end_ns: int | None = None
        self.wait: Callable[[], None] = lambda: None
        """Returns when the world's time has come, if the run keeps to a pace."""
        self._check()  # where everything starts

    @property
    def over(self) -> bool:
        """Whether the time is up, or the mission has been over for a moment."""
        return self.world.time_ns >= self._end_ns

    def hire(self, count: int) -> Workers:
        """Let so many workers, at most, run the nodes of robots from now on; close them before the bus.

        Raises:
            ScenarioError: This run, or this system, cannot have any.
        """
        from twin.runtime.workers.workers import Workers

        self.workers = Workers(self, count)
        return self.workers

    def add_faults(self, scenario: Scenario) -> None:
        """Take a scenario that is this one with more faults, behind those it has; they are due by its keys.

        Raises:
            ScenarioError: The run lacks what is to fail.
        """
        self.scenario = scenario
        if self.faults is None:
            self.faults = self._schedule_faults()
        else:
            self.faults.extend(scenario)

    def go_alone(self) -> None:
        """Go on in a fork, heard by nobody: no network, no recording."""
        self._sink, self.world.crash_folder = None, None
        self.bus.go_alone()

    def _schedule_faults(self) -> FaultSchedule:
        """Prepare the faults, and let those happen that are there from the start."""
        from twin.faults.fault import FaultContext
        from twin.faults.schedule import FaultSchedule

        parts = self.parts
        context = FaultContext(
            world=self.world,
            bus=self.bus,
            robots=parts.stacks,
            obstacles=self.obstacles,
            held=self.observer.holders,
            mission_state=lambda: parts.mission.state,
            control_period_ns=parts.control_period_ns,
            zones=parts.checks.zones,
        )
        faults = FaultSchedule(self.scenario, context)
        faults.update()
        return faults

    def tick(self) -> None:
        """Advance by one tick."""
        for phase in self._phases:
            phase()

    def think(self) -> None:
        """Begin a tick, up to the place of an agent, who acts as a node would that runs after all others."""
        for phase in self._phases[: self.THINKING]:
            phase()

    def act(self) -> None:
        """Go on to the end of the tick that `think` began."""
        for phase in self._phases[self.THINKING :]:
            phase()

    def admit(self) -> None:
        """1. Samples from outside enter the inboxes."""
        if self.lockstep is None:
            self.bus.admit()
        else:
            self.lockstep.admit()

    def nodes(self) -> None:
        """2. Nodes run: inboxes, timers due, actions; in order of creation, then those waited for."""
        if self.workers is None:
            self.bus.spin()
        else:
            self.workers.spin()
        if self.lockstep is not None:
            self.lockstep.step()

    def actuate(self) -> None:
        """3. Actuators take the commands; obstacles come into the way, faults happen."""
        for stack in self.parts.stacks.values():
            stack.handle.hardware.apply()
        if self.obstacles.active:
            bases = [self.world.pose(stack.handle.base).to_pose2() for stack in self.parts.stacks.values()]
            self.obstacles.update(bases)
        if self.faults is not None:
            self.faults.update()

    def step(self) -> None:
        """4. Physics; a sensor due on the way samples and publishes there."""
        world, schedule = self.world, self.schedule
        end = world.step_count + self._substeps
        while schedule.next_step < end:
            world.step(schedule.next_step - world.step_count)
            self.parts.clock.now_ns = world.time_ns
            schedule.fire(world.step_count)
        world.step(end - world.step_count)

    def sense(self) -> None:
        """5. Sensors due publish, stamped with the new time, when that has come."""
        self.wait()
        self.parts.clock.now_ns = self.world.time_ns
        self.schedule.fire(self.world.step_count)
        for battery in self.batteries.values():
            battery.update()

    def clock(self) -> None:
        """6. `/clock`."""
        if self._clock_publisher is not None:
            self._clock_publisher.publish(ClockMsg(clock=stamp(self.world.time_ns)), frozen=True)

    def _check(self) -> None:
        if self.workers is not None:
            self.workers.observe()
        observation = self.observer.observe()
        for check in self.checks:
            check.observe(observation)
        if self.scenario.early_stop != "never" and self._is_decided():
            self._end_ns = min(self._end_ns, self.world.time_ns)

    def _is_decided(self) -> bool:
        """Whether the run may end, by its key `early_stop`."""
        decided = [check.decided for check in self.checks]
        return False in decided or (self.scenario.early_stop == "decided" and None not in decided)

    def sinks(self) -> None:
        """7. Checks and recording."""
        now = self.world.time_ns
        self.observer.gather()
        if now % self._observation_ns == 0 or self.parts.mission.done:
            self._check()
        if self._sink is not None:
            self._sink.on_tick(self.world)
        if self.parts.mission.done and self._mission_end_ns is None and not self._endless:
            self._mission_end_ns = now
            self._end_ns = min(self._end_ns, now + _SETTLE_NS)


def _batteries(world: World, stacks: Mapping[str, RobotStack]) -> dict[str, OnBoardBattery]:
    """Return the batteries of the robots that have one; any robot's charger charges them."""
    if all(stack.battery is None for stack in stacks.values()):
        return {}
    from twin.runtime.on_board_battery import OnBoardBattery, charger_poses

    chargers = [pose for stack in stacks.values() for pose in charger_poses(stack.docks(), stack.frames.map)]
    return {
        name: OnBoardBattery(
            world,
            stack.handle,
            stack.battery,
            stack.context.battery,
            base=stack.frames.base,
            chargers=chargers,
        )
        for name, stack in stacks.items()
        if stack.battery is not None and stack.context.battery is not None
    }
