"""A run with all that keeps it: digest, recording, bag, pace; it ends in a verdict."""

from __future__ import annotations

import logging
import time
import uuid
import weakref
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, ClassVar

from twin.bridge.cdr.codec import codec
from twin.bridge.topics import Sample
from twin.bridge.wire.interrupts import guard
from twin.bridge.wire.session import SessionConfig
from twin.errors import RecordingError
from twin.navigation.ahead import kernels_ahead
from twin.plugins import execution
from twin.recording.digest import RunDigest
from twin.recording.mounted import Mounted
from twin.runtime.build import Parts, build
from twin.runtime.defaults import from_description as derive
from twin.runtime.kept_run import KeptRun
from twin.runtime.pacing import Pace
from twin.runtime.run import Run
from twin.runtime.stacks.context import WHOLE, Layout
from twin.runtime.stacks.robot import RobotStack
from twin.runtime.threads import end_threads
from twin.savings import ALL, Savings, seldom_collected, uncollected
from twin.scenario.outside import ALONE, Outside
from twin.scenario.provenance import Provenance, cpu_class, versions
from twin.scenario.schema import Scenario
from twin.scenario.verdict import Images, Label, Verdict

if TYPE_CHECKING:
    from twin.bridge.bus import Bus
    from twin.bridge.clock import Clock
    from twin.bridge.node import Node
    from twin.recording.live_screen import LiveScreen
    from twin.recording.sink import RerunSink
    from twin.sim.world import World

_LOG = logging.getLogger("twin.run")
_MOST_ENDED = 4
"""Closed runs in memory: they are in circles, and to look for these takes as long as to build a small run."""
_HELD_S = 0.1
"""How long a run that is held waits for somebody to say something, by the clock on the wall."""
_left: list[object] = []
"""What belongs to the process of which this one is a fork."""
_SHOWN_S = 0.25
"""Between two calls of a progress bar, by the clock on the wall."""


@dataclass(frozen=True, kw_only=True)
class Progress:
    """How far a run is."""

    time_s: float
    """Simulated time [s]."""
    duration_s: float
    """Longest simulated time [s]."""
    real_time_factor: float
    mission_state: str


class OpenRun:
    """A run that is under way. Whatever happens, it has to be closed; `finish` does it, too."""

    _ended: ClassVar[list[weakref.ref[Run]]] = []
    """Closed runs of this process; some may still be in memory."""

    def __init__(
        self,
        scenario: Scenario,
        *,
        out: Path | None = None,
        record: bool = True,
        pace: Pace | float | None = None,
        listen: Sequence[str] = (),
        network: SessionConfig | None = None,
        outside: Outside = ALONE,
        bag: Path | None = None,
        bag_hidden_topics: bool = False,
        save_model: Path | None = None,
        workers: int = 0,
        savings: Savings = ALL,
        taps: Sequence[Callable[[Sample[Any]], None]] = (),
        before_nodes: Callable[[World, Bus], None] | None = None,
        screen: LiveScreen | None = None,
        clock: Clock | None = None,
        layout: Layout = WHOLE,
        endless: bool = False,
        shown: Callable[[RerunSink], Callable[[Sample[Any]], None]] = lambda sink: sink.on_sample,
    ) -> None:
        """Build everything, up to the first tick.

        Args:
            scenario: What to run.
            out: Folder for the recording, for maps that robots make, and for the last states if the physics
                diverges; None writes none of them.
            record: Whether to write `<scenario>.rrd`.
            pace: Simulated seconds per second; None is as fast as possible. Changes no result. What is lost
                is not caught up; the verdict tells of it.
            listen: Zenoh endpoints for other processes, such as `tcp/127.0.0.1:7447`. Unless the run waits
                for them, they make it non-deterministic, and the verdict says so.
            network: How else the bus takes part in a network, instead of `listen`.
            outside: Who takes part from other processes, and how the run keeps time with them.
            bag: Folder for a bag of every message.
            bag_hidden_topics: Whether topics of actions are in the bag too.
            save_model: Folder for the compiled world as MJCF.
            workers: Processes that run the nodes of robots beside this one; it changes nothing but the speed.
            savings: What is not done over again; it changes nothing but the speed.
            taps: Called with every sample that a node publishes, from the first one on.
            before_nodes: Called when the world is there, and the bus without a node.
            screen: Shows the run while it goes on, whether it is recorded or not. It changes no result.
            clock: What nodes take for the time; None: simulated time.
            layout: Which nodes of robots there are, and where.
            endless: Whether it goes on when its mission is over, until somebody ends it. Then the hashes of
                each second, which `twin diff` reads, are not kept: they grow with the run.
            shown: Returns what passes samples on to the recording.

        Raises:
            TwinError: The run cannot be made.
        """
        OpenRun._ended[:] = [ended for ended in OpenRun._ended if ended() is not None]
        if len(OpenRun._ended) >= _MOST_ENDED:
            end_threads()
        self.digest = RunDigest()
        """What the run was, as far as it went."""
        self._out = out
        self._outside = outside
        self.lost: list[RecordingError] = []
        """Why parts of what the run leaves could not be written to their end, as on a disk that is full."""
        self._sink = _recording(scenario, out if record else None, screen, self._lose)
        self._wall_s = self._cpu_s = 0.0
        self._finished: str | None = None
        self._endless = endless
        self.between_ticks: list[Callable[[], None]] = []
        """Called after each tick of `advance`, and now and then while the run is held."""
        self.is_held: Callable[[], bool] = lambda: False
        """Asked between two ticks of `advance`: time stands while it holds."""
        self.heard_when_held: Node | None = None
        """Who hears what comes from outside then; None: everybody."""
        self.when_alone: list[Callable[[], None]] = []
        """Called in a fork that goes on alone, before its first tick."""
        self.label: Label = "model"
        """What it may call itself; a mirror says what."""
        self._thought = False
        """Whether a tick is under way, at an agent's place."""
        bag_tap = None
        if bag is not None:
            from twin.bridge.bags.tap import BagTap

            bag_tap = BagTap(bag, hidden=bag_hidden_topics, on_loss=self._lose)
        taps = [*taps, *(() if self._sink is None else (shown(self._sink),))]
        taps += [] if bag_tap is None else [bag_tap.on_sample]
        self._observers = taps
        network = network or SessionConfig(listen=outside.endpoints(listen))
        # Who keeps time cannot wait for kernels; workers share those that are there when they begin.
        needed = pace is not None or network.networked or workers > 0
        with execution() as self._executed, ExitStack() as ending, uncollected(), kernels_ahead(needed):
            parts = build(
                scenario,
                taps=[self.digest.on_sample, *taps],
                network=network,
                outside=outside,
                crash_folder=out,
                savings=savings,
                before_nodes=before_nodes,
                clock=clock,
                layout=layout,
            )
            ending.callback(parts.bus.close)
            ending.callback(parts.world.close)
            if bag_tap is not None:
                ending.callback(bag_tap.close)
                parts.bus.arrival_taps.append(bag_tap.on_arrival)
                parts.bus.needs.append(bag_tap.wants)
            if self._sink is not None:
                ending.callback(self._sink.close)
                parts.bus.wishes.append(self._sink.wants)
            if save_model is not None:
                _save_model(parts, save_model)
            self.run = Run(scenario, parts, self._sink, outside, endless=endless)
            if self.run.lockstep is not None:
                ending.callback(self.run.lockstep.close)
            if workers:
                ending.callback(self.run.hire(workers).close)
            if self._sink is not None:
                stacks = parts.stacks.items()
                wheels = {name: derive.wheels(stack.handle.description) for name, stack in stacks}
                self._sink.declare(parts.world, wheels, _cameras(parts), _depths(parts), _truths(parts))
            self._pace: Pace | None = None
            if pace is not None:
                self._keep(Pace(pace) if isinstance(pace, int | float) else pace)
            self._ending = ending.pop_all()
            if out is not None and not endless:
                self._ending.callback(self._or_lose, lambda: self.kept().write(out))
            self._ending.callback(OpenRun._ended.append, weakref.ref(self.run))

    def _lose(self, fault: RecordingError) -> None:
        """Tell of what cannot be written, without which the run goes on."""
        self.lost.append(fault)
        _LOG.warning("%s (the run goes on; what there is of it can be read)", fault)

    def _or_lose(self, write: Callable[[], None]) -> None:
        try:
            write()
        except RecordingError as fault:
            self.lost.append(fault)
            _LOG.warning("%s", fault)

    def _keep(self, pace: Pace) -> None:
        world = self.run.world
        self._pace = pace
        self.run.wait = lambda: pace.keep(world.time_ns * 1e-9)

    def go_on(self, factor: float) -> None:
        """Go on from now at so many simulated seconds per second; infinite is as fast as possible."""
        if self._pace is None:
            self._keep(Pace(factor))
        assert self._pace is not None
        self._pace.go_on(self.run.world.time_ns * 1e-9, factor)

    @property
    def due_ns(self) -> int | None:
        """When the present simulated time is due, by `time.perf_counter_ns`; None without a pace."""
        simulated_s = self.run.world.time_ns * 1e-9
        return None if self._pace is None else round(self._pace.due_s(simulated_s) * 1e9)

    def advance(
        self,
        until: Callable[[], bool] | None = None,
        progress: Callable[[Progress], None] | None = None,
    ) -> bool:
        """Tick until a condition holds after a tick, or the run is over; return whether the condition holds.

        Args:
            until: Asked after each tick; None goes on to the end.
            progress: Called about four times a second.

        Raises:
            TwinError: The run cannot go on.
        """
        run = self.run
        shown = time.perf_counter()
        began = shown - self._wall_s
        guard.take_again()
        with self._executed.going_on(), self._timed():
            while not run.over:
                run.tick()
                if not self._endless and run.world.time_ns >= self.digest.second_ends_ns:
                    self.digest.end_second(run.world.state_digest())
                self._between_ticks()
                if until is not None and until():
                    return True
                if progress is not None and time.perf_counter() - shown > _SHOWN_S:
                    shown = time.perf_counter()
                    simulated = run.world.time_ns * 1e-9
                    progress(
                        Progress(
                            time_s=simulated,
                            duration_s=run.scenario.duration,
                            real_time_factor=simulated / (shown - began),
                            mission_state=run.parts.mission.state,
                        )
                    )
            return False

    def _between_ticks(self) -> None:
        for each in self.between_ticks:
            each()
        while self.is_held():
            self.run.bus.external.wait(_HELD_S)
            self.run.bus.serve(self.heard_when_held)
            for each in self.between_ticks:
                each()

    def advance_to_agent(self, until: Callable[[], bool]) -> bool:
        """Go on until a condition holds at an agent's place in a tick, or the run is over; see `Run.think`.

        The tick under way is finished first. All ticks together are those of `advance`.

        Args:
            until: Asked in each tick when its nodes have run.

        Raises:
            TwinError: The run cannot go on.
        """
        run = self.run
        guard.take_again()
        with self._executed.going_on(), self._timed():
            while True:
                if self._thought:
                    run.act()
                    self._thought = False
                if run.over:
                    return False
                run.think()
                self._thought = True
                if until():
                    return True

    @contextmanager
    def _timed(self) -> Iterator[None]:
        """Add the time of the block to what the run took; pacing is the only other use of the clock."""
        wall, cpu = time.perf_counter(), time.process_time()
        try:
            yield
        finally:
            self._wall_s += time.perf_counter() - wall
            self._cpu_s += time.process_time() - cpu

    def advance_to_end(
        self,
        progress: Callable[[Progress], None] | None = None,
        watch: Callable[[Run], bool] | None = None,
    ) -> None:
        """Tick until the run is over, or `watch` returns True; see `advance`."""
        run = self.run
        with seldom_collected():  # the model and the types stay
            self.advance(None if watch is None else lambda: watch(run), progress)

    def show(self, topic: str, message: Any) -> None:
        """Draw a message that no node has published, if there is a recording."""
        if self._sink is not None:
            name, now_ns = codec(type(message)).msgtype, self.run.world.time_ns
            sample: Any = SimpleNamespace(topic=topic, msgtype=name, time_ns=now_ns, message=message)
            self._sink.on_sample(sample)

    def on_close(self, callback: Callable[[], None]) -> None:
        """Call back when the run is closed, while all of it is there."""
        self._ending.callback(callback)

    def go_alone(self) -> None:
        """Go on in a fork of the process, between two ticks: heard by nobody, and as fast as possible.

        Its digest goes on, too. What the run leaves, and what observes it, stays with the other process; it
        is kept here, so that nothing is ended twice.
        """
        self.run.go_alone()
        bus = self.run.bus
        bus.needs.clear()
        bus.wishes.clear()
        bus.taps[:] = [tap for tap in bus.taps if tap not in self._observers]
        _left.append((self._ending.pop_all(), self._sink, self._observers))
        self._sink = self._pace = self._out = None
        self.run.wait = lambda: None
        self.between_ticks, self.is_held = [], lambda: False
        for each in self.when_alone:
            each()

    def finish(self) -> Verdict:
        """Judge the run as it stands, write what it leaves but what is `lost`, and close it."""
        with self._ending:
            verdict = self._verdict()
            self._finished = verdict.digest
            if self._out is not None:
                self._or_lose(partial(_save_maps, self.run.parts.stacks, self._out))
            if self._sink is not None:
                self._sink.close(verdict.to_dict())
        return verdict

    def close(self) -> None:
        """End the run as it stands, without a verdict. Harmless when repeated."""
        self._ending.close()

    def kept(self) -> KeptRun:
        """Return what other runs are compared with, and of what this one is made again; at its end."""
        return KeptRun(
            provenance=self.provenance(),
            digest=self._finished,
            hashes=self.digest.hashes(self.run.world.state_digest()),
        )

    def provenance(self) -> Provenance:
        """Return with what the run is made."""
        source = self.run.scenario.source
        return Provenance(
            file=str(source.file),
            scenario=source.data,
            nodes=self._outside.nodes,
            clock=self._outside.clock(self.run.bus.networked),
            files=source.files(),
            plugins=self._executed.versions,
            versions=versions(),
            cpu=cpu_class(),
        )

    def _verdict(self) -> Verdict:
        run, pace = self.run, self._pace
        simulated = run.world.time_ns * 1e-9
        navigators = [s.navigator for s in run.parts.stacks.values() if s.navigator is not None]
        refused = sorted(run.bus.refused.items())  # of what came from outside; none without a network
        clock = self._outside.clock(run.bus.networked)
        pictures = run.world.pictures
        return Verdict(
            scenario=run.scenario.name,
            seed=run.scenario.seed,
            checks=tuple(check.result() for check in run.checks),
            faults=() if run.faults is None else run.faults.reports(),
            metrics={
                "sim_time_s": simulated,
                "wall_time_s": self._wall_s,
                "cpu_time_s": self._cpu_s + (run.workers.cpu_s if run.workers else 0.0),
                "real_time_factor": simulated / self._wall_s if self._wall_s else 0.0,
                **({} if pace is None else {"pace_losses": float(pace.losses), "pace_lost_s": pace.lost_s}),
                "recoveries": float(sum(navigator.recoveries for navigator in navigators)),
                **{f"refused_{reason.replace(' ', '_')}": float(count) for reason, count in refused},
                **({"trailing_bytes": float(run.bus.trailing)} if run.bus.trailing else {}),
            },
            digest=self.digest.finish(run.world.state_digest()),
            images=None if pictures is None else Images(**pictures._asdict()),
            deterministic=clock != "free" and not (run.lockstep and run.lockstep.surplus),
            clock=clock,
            versions=versions(),
            plugins=self._executed.versions,
            cpu=cpu_class(),
        )


def run(
    scenario: Scenario,
    *,
    out: Path | None = None,
    record: bool = True,
    pace: float | None = None,
    listen: Sequence[str] = (),
    outside: Outside = ALONE,
    bag: Path | None = None,
    progress: Callable[[Progress], None] | None = None,
    watch: Callable[[Run], bool] | None = None,
    workers: int = 0,
    savings: Savings = ALL,
) -> Verdict:
    """Run a scenario to its verdict; see `OpenRun` and `OpenRun.advance_to_end`.

    Raises:
        RecordingError: Something that it leaves cannot be written to its end.
        TwinError: The run cannot be made, or the physics diverged.
    """
    started = OpenRun(
        scenario,
        out=out,
        record=record,
        pace=pace,
        listen=listen,
        outside=outside,
        bag=bag,
        workers=workers,
        savings=savings,
    )
    try:
        started.advance_to_end(progress, watch)
        verdict = started.finish()
    finally:
        started.close()
    if started.lost:
        raise started.lost[0]
    return verdict


def _save_maps(stacks: Mapping[str, RobotStack], folder: Path) -> None:
    """Write `map.yaml`, `map.pgm` and `map.posegraph` of the robot that maps; of several `<robot>_map`.

    A robot that localises in a pose graph made none. Nothing is written where no map was published yet.
    """
    makers = {name: s.slam for name, s in stacks.items() if s.slam and s.slam.slam.mode == "mapping"}
    for name, maker in makers.items():
        grid = maker.fresh_map()
        if grid is None:
            continue
        stem = "map" if len(stacks) == 1 else f"{name}_map"
        try:
            folder.mkdir(parents=True, exist_ok=True)
            grid.save(folder / f"{stem}.yaml")
            maker.slam.save(folder / f"{stem}.posegraph")
        except OSError as fault:
            raise RecordingError(f"{folder}: the map cannot be written there: {fault.strerror}") from fault


def _save_model(parts: Parts, folder: Path) -> None:
    try:
        parts.world.save_model(folder)
    except OSError as fault:
        raise RecordingError(f"{folder}: the model cannot be written there: {fault.strerror}") from fault


def _recording(
    scenario: Scenario,
    out: Path | None,
    screen: LiveScreen | None,
    on_loss: Callable[[RecordingError], None],
) -> RerunSink | None:
    kept = out is not None and scenario.recording.enabled
    if screen is None and not kept:
        return None
    from twin.recording.live_screen import LATE_S
    from twin.recording.sink import RecordingConfig, RerunSink

    wish = scenario.recording
    kept_as: dict[str, Any] = {name: getattr(wish, name) for name in ("poses_hz", "images_hz", "images")}
    name = f"{scenario.name}-{scenario.seed}"
    live = RecordingConfig(**kept_as, loss_s=LATE_S)
    file = out / f"{scenario.name}.rrd" if out is not None and kept else None
    if file is None:
        name = f"{name}-{uuid.uuid4()}"  # each is a recording of its own, which the viewer turns to
    config = live if screen is not None else RecordingConfig(**kept_as)
    return RerunSink(file, config=config, recording_id=name, screen=screen, on_loss=on_loss)


def _depths(parts: Parts) -> list[str]:
    """Return the topics of depth images."""
    return [camera.depths for stack in parts.stacks.values() for camera in stack.cameras if camera.depths]


def _truths(parts: Parts) -> list[str]:
    """Return the topics of labels in colours, and of boxes, that are ground truth."""
    cameras = (camera for stack in parts.stacks.values() for camera in stack.cameras)
    return [topic for camera in cameras for topic in camera.truths]


def _cameras(parts: Parts) -> dict[str, Mounted]:
    """Return by topic what makes the pictures there."""
    cameras = ((name, camera) for name, stack in parts.stacks.items() for camera in stack.cameras)
    return {
        camera.pictures: Mounted(f"{name}/{camera.spec.link}", camera.T_link_optical, camera.spec.lens)
        for name, camera in cameras
        if camera.pictures
    }
