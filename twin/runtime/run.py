"""One run: the tick, its order and its rates."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from twin.bridge.bags.tap import BagTap
from twin.bridge.msgs import Clock as ClockMsg
from twin.bridge.msgs import stamp
from twin.bridge.wire.session import SessionConfig
from twin.errors import RecordingError
from twin.plugins import execution
from twin.recording.digest import RunDigest
from twin.runtime.build import Parts, build
from twin.runtime.defaults import from_description as derive
from twin.runtime.events.faults import FaultSchedule
from twin.runtime.events.obstacles import ObstacleSchedule
from twin.runtime.observe import Observer
from twin.runtime.outside import Lockstep
from twin.runtime.pacing import Pace
from twin.runtime.saved_maps import save_maps
from twin.runtime.sensing import SensorSchedule
from twin.scenario.checks import Check
from twin.scenario.outside import ALONE, ClockMode, Outside
from twin.scenario.provenance import cpu_class, versions
from twin.scenario.schema import Scenario
from twin.scenario.verdict import Verdict

if TYPE_CHECKING:
    from twin.recording.sink import RerunSink

_OBSERVED_TICKS = 5
"""Checks see one observation in so many control ticks; the contacts of the others are in it."""
_SETTLE_NS = 1_000_000_000
"""The run goes on for so long after its mission has ended, so that the recording shows how it ended."""


@dataclass(frozen=True, kw_only=True)
class Progress:
    """How far a run is."""

    time_s: float
    """Simulated time [s]."""
    duration_s: float
    """Longest simulated time [s]."""
    real_time_factor: float
    mission_state: str


class Run:
    """A built scenario that can be ticked; `PHASES` is the order of one tick."""

    PHASES = ("admit", "nodes", "actuate", "step", "sense", "clock", "sinks")

    def __init__(
        self, scenario: Scenario, parts: Parts, sink: RerunSink | None = None, outside: Outside = ALONE
    ) -> None:
        self.scenario = scenario
        self.parts = parts
        self.world, self.bus = parts.world, parts.bus
        self.checks: tuple[Check, ...] = scenario.build_checks(parts.checks)
        if any(check.measures_work for check in self.checks):
            self.world.measure_work()
        goods = [good.name for good in self.world.scene.goods]
        self._observer = Observer(self.world, tuple(parts.stacks.values()), parts.mission, goods)
        self._sink = sink
        self._schedule = SensorSchedule(
            [sensor for stack in parts.stacks.values() for sensor in stack.sensors], self.world.timestep_ns
        )
        self._observation_ns = _OBSERVED_TICKS * parts.control_period_ns
        self._substeps = parts.control_period_ns // self.world.timestep_ns
        self._clock_publisher = self.bus.create_node("clock").create_publisher(ClockMsg, "/clock", 1)
        self.bus.started()
        self.lockstep = Lockstep(self.bus, outside) if outside.wait_for else None
        self._obstacles = ObstacleSchedule(
            self.world, scenario.world.obstacles, [stack.footprint for stack in parts.stacks.values()]
        )
        self._faults = FaultSchedule(self.world, self.bus, parts.stacks, scenario.faults)
        self._phases = tuple(getattr(self, phase) for phase in self.PHASES)
        self._end_ns = round(scenario.duration * 1e9)
        self._mission_end_ns: int | None = None
        self._check()  # where everything starts

    @property
    def over(self) -> bool:
        """Whether the time is up, or the mission has been over for a moment."""
        return self.world.time_ns >= self._end_ns

    def tick(self) -> None:
        """Advance by one tick."""
        for phase in self._phases:
            phase()

    def admit(self) -> None:
        """1. Samples from outside enter the inboxes."""
        if self.lockstep is None:
            self.bus.admit()
        else:
            self.lockstep.admit()

    def nodes(self) -> None:
        """2. Nodes run: inboxes, timers due, actions; in order of creation, then those waited for."""
        self.bus.spin()
        if self.lockstep is not None:
            self.lockstep.step()

    def actuate(self) -> None:
        """3. Actuators take the commands; obstacles come into the way, faults happen."""
        for stack in self.parts.stacks.values():
            stack.handle.hardware.apply()
        if self._obstacles.active:
            bases = [self.world.pose(stack.handle.base).to_pose2() for stack in self.parts.stacks.values()]
            self._obstacles.update(bases)
        self._faults.update()

    def step(self) -> None:
        """4. Physics; a sensor due on the way samples and publishes there."""
        world, schedule = self.world, self._schedule
        end = world.step_count + self._substeps
        while schedule.next_step < end:
            world.step(schedule.next_step - world.step_count)
            self.parts.clock.now_ns = world.time_ns
            schedule.fire(world.step_count)
        world.step(end - world.step_count)

    def sense(self) -> None:
        """5. Sensors due publish, stamped with the new time."""
        self.parts.clock.now_ns = self.world.time_ns
        self._schedule.fire(self.world.step_count)

    def clock(self) -> None:
        """6. `/clock`."""
        self._clock_publisher.publish(ClockMsg(clock=stamp(self.world.time_ns)))

    def _check(self) -> None:
        observation = self._observer.observe()
        for check in self.checks:
            check.observe(observation)

    def sinks(self) -> None:
        """7. Checks and recording."""
        now = self.world.time_ns
        self._observer.gather()
        if now % self._observation_ns == 0 or self.parts.mission.done:
            self._check()
        if self._sink is not None:
            self._sink.on_tick(self.world)
        if self.parts.mission.done and self._mission_end_ns is None:
            self._mission_end_ns = now
            self._end_ns = min(self._end_ns, now + _SETTLE_NS)


def run(
    scenario: Scenario,
    *,
    out: Path | None = None,
    record: bool = True,
    pace: float | None = None,
    listen: Sequence[str] = (),
    network: SessionConfig | None = None,
    outside: Outside = ALONE,
    bag: Path | None = None,
    bag_hidden_topics: bool = False,
    save_model: Path | None = None,
    progress: Callable[[Progress], None] | None = None,
    watch: Callable[[Run], bool] | None = None,
) -> Verdict:
    """Run a scenario to its verdict.

    Args:
        scenario: What to run.
        out: Folder for the recording, for maps that robots make, and for the last states if the physics
            diverges; None writes none of them.
        record: Whether to write `<scenario>.rrd`.
        pace: Simulated seconds per second; None is as fast as possible. Changes no result. What is lost is
            not caught up; the verdict tells of it.
        listen: Zenoh endpoints for other processes, such as `tcp/127.0.0.1:7447`. Unless the run waits for
            them, they make it non-deterministic, and the verdict says so.
        network: How else the bus takes part in a network, instead of `listen`.
        outside: Who takes part from other processes, and how the run keeps time with them.
        bag: Folder for a bag of every message.
        bag_hidden_topics: Whether topics of actions are in the bag too.
        save_model: Folder for the compiled world as MJCF.
        progress: Called about four times a second.
        watch: Called after each tick; the run ends when it returns True.

    Raises:
        TwinError: The run cannot be made, or the physics diverged.
    """
    digest = RunDigest()
    sink = _recording(scenario, out) if record else None
    bag_tap = None if bag is None else BagTap(bag, hidden=bag_hidden_topics)
    with execution() as executed, ExitStack() as ending:
        parts = build(
            scenario,
            taps=[digest.on_sample, *(tap.on_sample for tap in (sink, bag_tap) if tap is not None)],
            network=network or SessionConfig(listen=outside.endpoints(listen)),
            outside=outside,
            crash_folder=out,
        )
        ending.callback(parts.bus.close)
        if bag_tap is not None:
            ending.callback(bag_tap.close)
            parts.bus.arrival_taps.append(bag_tap.on_arrival)
        if sink is not None:
            ending.callback(sink.close)
        if save_model is not None:
            _save_model(parts, save_model)
        simulation = Run(scenario, parts, sink, outside)
        if simulation.lockstep is not None:
            ending.callback(simulation.lockstep.close)
        if sink is not None:
            wheels = {name: derive.wheels(stack.handle.description) for name, stack in parts.stacks.items()}
            sink.declare(parts.world, wheels)
        keeper = None if pace is None else Pace(pace)
        wall, cpu = _loop(simulation, keeper, progress, watch)
        verdict = _verdict(simulation, digest, wall, cpu, keeper, outside.clock(parts.bus.networked))
        verdict = replace(verdict, plugins=executed.versions)
        if out is not None:
            save_maps(parts.stacks, out)
        if sink is not None:
            sink.close(verdict.to_dict())
        return verdict


def _save_model(parts: Parts, folder: Path) -> None:
    try:
        parts.world.save_model(folder)
    except OSError as fault:
        raise RecordingError(f"{folder}: the model cannot be written there: {fault.strerror}") from fault


def _recording(scenario: Scenario, out: Path | None) -> RerunSink | None:
    if out is None or not scenario.recording.enabled:
        return None
    from twin.recording.sink import RecordingConfig, RerunSink

    config = RecordingConfig(poses_hz=scenario.recording.poses_hz, block_s=3.0)
    return RerunSink(
        out / f"{scenario.name}.rrd",
        config=config,
        recording_id=f"{scenario.name}-{scenario.seed}",
    )


def _loop(
    simulation: Run,
    pace: Pace | None,
    progress: Callable[[Progress], None] | None,
    watch: Callable[[Run], bool] | None,
) -> tuple[float, float]:
    """Tick to the end; return the wall and CPU time it took [s]. Pacing is the only use of the wall clock."""
    gc.freeze()  # the model and the types stay; collections look only at what ticks make
    wall, cpu = time.perf_counter(), time.process_time()
    shown = wall
    while not simulation.over:
        simulation.tick()
        if watch is not None and watch(simulation):
            break
        simulated = simulation.world.time_ns * 1e-9
        if pace is not None:
            pace.keep(simulated)
        now = time.perf_counter()
        if progress is not None and now - shown > 0.25:
            shown = now
            progress(
                Progress(
                    time_s=simulated,
                    duration_s=simulation.scenario.duration,
                    real_time_factor=simulated / (now - wall),
                    mission_state=simulation.parts.mission.state,
                )
            )
    elapsed = time.perf_counter() - wall, time.process_time() - cpu
    gc.unfreeze()
    return elapsed


def _verdict(
    simulation: Run, digest: RunDigest, wall: float, cpu: float, pace: Pace | None, clock: ClockMode
) -> Verdict:
    simulated = simulation.world.time_ns * 1e-9
    navigators = [
        stack.navigator for stack in simulation.parts.stacks.values() if stack.navigator is not None
    ]
    refused = sorted(simulation.bus.refused.items())  # of what came from outside; none without a network
    return Verdict(
        scenario=simulation.scenario.name,
        seed=simulation.scenario.seed,
        checks=tuple(check.result() for check in simulation.checks),
        metrics={
            "sim_time_s": simulated,
            "wall_time_s": wall,
            "cpu_time_s": cpu,
            "real_time_factor": simulated / wall,
            **({} if pace is None else {"pace_losses": float(pace.losses), "pace_lost_s": pace.lost_s}),
            "recoveries": float(sum(navigator.recoveries for navigator in navigators)),
            **{f"refused_{reason.replace(' ', '_')}": float(count) for reason, count in refused},
            **({"trailing_bytes": float(simulation.bus.trailing)} if simulation.bus.trailing else {}),
        },
        digest=digest.finish(simulation.world.state_digest()),
        deterministic=clock != "free" and not (simulation.lockstep and simulation.lockstep.surplus),
        clock=clock,
        versions=versions(),
        cpu=cpu_class(),
    )
