"""Workers: processes that run the nodes of some of a run's robots, beside its physics.

Each is a fork of the run as it was built, so it has the nodes, maps and the model already. In every tick in
which its robots have something to do it is told the state of the physics and what others told its nodes, and
answers with what these did and want the actuators to do. It samples their lidars, too. Physics, all other
sensors, checks and recording stay in the run's own process. Any number of workers gives the same digest.
"""

from __future__ import annotations

import gc
import mmap
import os
import pickle
import signal
import sys
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from multiprocessing.connection import Connection, Pipe
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np

from twin.bridge.workers.crew import Crew, Peer
from twin.bridge.workers.part import Act, Part
from twin.errors import ScenarioError, SimulationError, TwinError
from twin.geometry import Array, Pose2
from twin.nodes.missions.mission_node import MissionNode
from twin.nodes.navigation.robot_pose import RobotPose
from twin.nodes.r2d2_state_publisher import R2D2StatePublisherNode
from twin.plugins.execution import told
from twin.runtime.stacks.missions import Missions
from twin.runtime.threads import end_threads
from twin.sensors.lidar import Lidar, LidarReading

if TYPE_CHECKING:
    from twin.nodes.sensor_publishers import SensorPublisher
    from twin.runtime.run import Run
    from twin.runtime.stacks.robot import RobotStack
    from twin.sim.world import World

_LEAVE_S = 5.0
"""After so long, a worker that does not end is killed."""


class _Belief(NamedTuple):
    """What checks ask the nodes of a robot."""

    in_map: Pose2 | None
    in_odom: Pose2 | None
    goals: int
    recoveries: int


_UNKNOWN = _Belief(None, None, 0, 0)


class _Done(NamedTuple):
    """What a worker answers to a tick."""

    acts: list[Act]
    due_ns: int
    orders: dict[str, Any]
    """By robot: what its actuators are to do, if that has changed."""
    missions: dict[str, tuple[str, bool, bool | None, str]]
    """By robot: state, done, succeeded and reason of a mission, if they have changed."""


class Workers:
    """The workers of a run; close them before its bus."""

    def __init__(self, run: Run, count: int) -> None:
        """Fork; nothing of the run may have been recorded yet.

        Args:
            run: As it was built.
            count: How many there may be; there are no more than robots that can go to one.

        Raises:
            ScenarioError: Others take part in the run, or the system cannot fork.
        """
        if run.bus.networked or not run.bus.in_process.is_private:
            raise ScenarioError("--workers are for a run that nobody else takes part in; leave it out")
        if not hasattr(os, "fork") or sys.platform == "darwin":
            raise ScenarioError("--workers needs a system on which a process can be forked, such as Linux")
        self.run = run
        missions = _missions(run)
        leaving = [s for s in run.parts.stacks.values() if _can_leave(s, missions.get(s.name))]
        shares = [leaving[i::count] for i in range(min(count, len(leaving)))]
        self.state = _State(run.world)
        self.pipes: list[Connection] = []
        """The run's ends, which no worker may keep open."""
        end_threads()
        self._workers = [_Worker(self, i, share) for i, share in enumerate(shares)]
        self._by_peer = {id(worker.peer): worker for worker in self._workers}
        self._crew = Crew(run.bus, [worker.peer for worker in self._workers])
        self._missions = missions
        self._beliefs: dict[str, _Belief] = {}
        self._scanned: dict[int, tuple[_Worker, tuple[str, int]]] = {}
        """By sensor: who samples it, and what it is called there."""
        self.cpu_s = 0.0
        """CPU time of the workers at the last observation [s]."""
        for worker, stack in ((w, s) for w, share in zip(self._workers, shares, strict=True) for s in share):
            for number, sensor in enumerate(stack.sensors):
                if type(sensor.sensor) is Lidar:
                    sensor.sensor = _Scanned(sensor.sensor)
                    self._scanned[id(sensor)] = worker, (stack.name, number)
            told = _Told(stack.robot_pose, self._beliefs, stack.name)
            stack.robot_pose, stack.navigator = told, cast(Any, stack.navigator and told)
        if shares:
            run.world.use_threads(len(shares))
            run.schedule.prepare = self._scan

    @property
    def pids(self) -> list[int]:
        """Their process ids."""
        return [worker.pid for worker in self._workers]

    def spin(self) -> None:
        """Run all nodes once, here and in the workers.

        Raises:
            TwinError: A node failed, or a worker has ended.
        """
        self._crew.spin(self._exchange)

    def observe(self) -> None:
        """Ask what the robots of the workers believe; `robot_pose` of their stacks tells it."""
        for worker in self._workers:
            worker.send(_Here.observe)
        for worker in self._workers:
            beliefs, worker.cpu_s = worker.receive()
            self._beliefs |= beliefs
        self.cpu_s = sum(worker.cpu_s for worker in self._workers)

    def close(self) -> None:
        """End the workers. Harmless when repeated."""
        for pipe in self.pipes:
            pipe.close()  # which they notice
        for worker in self._workers:
            worker.wait()
        self._crew.close()

    def _scan(self, sensors: Sequence[SensorPublisher], time_ns: int) -> None:
        """Let workers sample those of their lidars that are about to fire."""
        asked: dict[_Worker, list[tuple[tuple[str, int], _Scanned]]] = {}
        for sensor in sensors:
            if (found := self._scanned.get(id(sensor))) is not None and isinstance(sensor.sensor, _Scanned):
                asked.setdefault(found[0], []).append((found[1], sensor.sensor))
        if asked:
            self.state.tell(self.run.world)
        for worker, lidars in asked.items():
            worker.send(_Here.scan, self.run.world.step_count, [name for name, _ in lidars])
        for worker, lidars in asked.items():
            for (_, lidar), reading in zip(lidars, worker.receive(), strict=True):
                lidar.reading = reading

    def _exchange(
        self, busy: Sequence[Peer], meanwhile: Callable[[], None]
    ) -> Iterator[tuple[Peer, Sequence[Act]]]:
        world = self.run.world
        if busy:
            self.state.tell(world)
        for peer in busy:
            self._by_peer[id(peer)].send(_Here.tick, world.step_count, peer.take())
        meanwhile()
        for peer in busy:
            done: _Done = self._by_peer[id(peer)].receive()
            peer.due_ns = done.due_ns
            for name, orders in done.orders.items():
                self.run.parts.stacks[name].handle.hardware.obey(orders)
            for name, state in done.missions.items():
                node = self._missions[name]
                node.state, node.done, node.succeeded, node.reason = state
            yield peer, done.acts


class _Worker:
    """One worker, as the run sees it."""

    def __init__(self, workers: Workers, index: int, stacks: Sequence[RobotStack]) -> None:
        self.peer = Peer([stack.context.namespace for stack in stacks])
        self.cpu_s = 0.0
        self._world = workers.run.world
        self._name = f"worker {index} ({', '.join(stack.name for stack in stacks)})"
        self._pipe, theirs = Pipe()
        workers.pipes.append(self._pipe)
        sys.stdout.flush()
        sys.stderr.flush()
        with warnings.catch_warnings():
            # From Python 3.12 on: of threads, such as NumPy's, that the worker does without.
            warnings.simplefilter("ignore", DeprecationWarning)
            self.pid = os.fork()
        if not self.pid:
            _serve(workers.run, theirs, workers.pipes, workers.state, stacks, index)
        theirs.close()

    def send(self, what: Callable[..., Any], *given: Any) -> None:
        """Let it do something; the answer comes by `receive`."""
        try:
            self._pipe.send_bytes(pickle.dumps((what.__name__, given), pickle.HIGHEST_PROTOCOL))
        except OSError:
            raise self._ended() from None

    def receive(self) -> Any:
        """Return the answer.

        Raises:
            TwinError: A node failed, or the worker has ended.
        """
        try:
            answer = pickle.loads(self._pipe.recv_bytes())
        except (EOFError, OSError):
            raise self._ended() from None
        if isinstance(answer, BaseException):
            raise answer
        return answer

    def wait(self) -> None:
        """Wait for its end, not for ever."""
        end = time.monotonic() + _LEAVE_S
        while self.pid and not os.waitpid(self.pid, os.WNOHANG)[0]:
            if time.monotonic() > end:
                os.kill(self.pid, signal.SIGKILL)
            time.sleep(0.001)
        self.pid = 0

    def _ended(self) -> SimulationError:
        _, status = os.waitpid(self.pid, 0)
        self.pid = 0
        code = os.waitstatus_to_exitcode(status)
        how = f"with exit code {code}" if code >= 0 else f"by {signal.Signals(-code).name}"
        seconds = self._world.time_ns * 1e-9
        return SimulationError(f"{self._name} has ended {how} at t = {seconds:.3f} s; the run cannot go on")


class _State:
    """What nodes and lidars read of the physics, in memory that run and workers share."""

    def __init__(self, world: World) -> None:
        self._ends = np.cumsum([len(part) for part in self._parts(world)])
        memory = mmap.mmap(-1, 8 * int(self._ends[-1]))
        self._numbers = np.frombuffer(memory, count=int(self._ends[-1]))

    def tell(self, world: World) -> None:
        """Write the state of the run's world."""
        np.concatenate(self._parts(world), out=self._numbers)

    def take(self, world: World, step_count: int) -> None:
        """Read it into a worker's, after so many physics steps."""
        qpos, qvel, effort, *placed = np.split(self._numbers, self._ends[:-1])
        world.go_to(step_count, qpos, qvel, effort, np.concatenate(placed))

    @staticmethod
    def _parts(world: World) -> list[Array]:
        data = world.data
        return [data.qpos, data.qvel, data.qfrc_actuator, data.mocap_pos.ravel(), data.mocap_quat.ravel()]


class _Scanned:
    """Stands for a lidar that a worker samples."""

    def __init__(self, lidar: Lidar) -> None:
        self.lidar, self.spec = lidar, lidar.spec
        self.reading: LidarReading | None = None

    def sample(self, time_ns: int) -> LidarReading:
        """Return what the worker has seen."""
        assert self.reading is not None
        assert self.reading.time_ns == time_ns
        return self.reading


class _Told(RobotPose):
    """What a robot whose nodes are in a worker believed, and its navigator had done, when last observed."""

    def __init__(self, known: RobotPose, beliefs: dict[str, _Belief], name: str) -> None:
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
    def _belief(self) -> _Belief:
        return self._beliefs.get(self._name, _UNKNOWN)


def _missions(run: Run) -> dict[str, MissionNode]:
    """Return the missions by robot."""
    mission = run.parts.mission
    if isinstance(mission, Missions):
        return dict(mission.of)
    if not isinstance(mission, MissionNode):
        return {}
    names = {stack.context.namespace: stack.name for stack in run.parts.stacks.values()}
    return {names[mission.node.group]: mission}


def _can_leave(stack: RobotStack, mission: MissionNode | None) -> bool:
    """Whether a worker can run the nodes of a robot: they share nothing with others but the world.

    A map that is made is looked at in this process, and a kinematic base is moved here; a robot that is the
    only one, in no namespace, is among the user's own nodes.
    """
    return (
        bool(stack.context.namespace)
        and stack.slam is None
        and not isinstance(mission, R2D2StatePublisherNode)
    )


# -- in the worker -------------------------------------------------------------------------------------------


def _serve(
    run: Run,
    pipe: Connection,
    others: Sequence[Connection],
    state: _State,
    stacks: Sequence[RobotStack],
    index: int,
) -> None:
    """Be a worker until the run is over; never returns."""
    code = 1
    try:
        for pipe_of_other in others:
            pipe_of_other.close()
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # the run takes it, and ends us
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        gc.freeze()
        worker = _Here(run, state, stacks, index)
        while True:
            what, given = pickle.loads(pipe.recv_bytes())
            try:
                answer: Any = getattr(worker, what)(*given)
            except Exception as error:
                answer = _portable(told(error))
            pipe.send_bytes(pickle.dumps(answer, pickle.HIGHEST_PROTOCOL))
    except (EOFError, OSError):
        code = 0
    finally:
        with suppress(OSError):
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(code)


class _Here:
    """The robots of a worker, in the worker."""

    def __init__(self, run: Run, state: _State, stacks: Sequence[RobotStack], index: int) -> None:
        self._run, self._state, self._stacks = run, state, stacks
        self._part = Part(run.bus, [stack.context.namespace for stack in stacks], index)
        names = {stack.name for stack in stacks}
        self._missions = {name: node for name, node in _missions(run).items() if name in names}
        self._lidars: dict[tuple[str, int], Any] = {
            (stack.name, number): sensor.sensor
            for stack in stacks
            for number, sensor in enumerate(stack.sensors)
        }
        self._told: dict[tuple[str, str], Any] = {}
        self._substeps = run.parts.control_period_ns // run.world.timestep_ns

    def tick(self, step_count: int, entries: Sequence[Act]) -> _Done:
        """Run the nodes once."""
        run, world = self._run, self._run.world
        world.step_count = step_count - self._substeps
        run.faults.update(tell=False)
        self._state.take(world, step_count)
        run.parts.clock.now_ns = world.time_ns
        self._part.receive(entries)
        run.bus.spin()
        hardware = {stack.name: stack.handle.hardware.orders for stack in self._stacks}
        missions = {name: (m.state, m.done, m.succeeded, m.reason) for name, m in self._missions.items()}
        return _Done(
            self._part.take(),
            self._part.due_ns,
            self._changed("orders", hardware),
            self._changed("missions", missions),
        )

    def scan(self, step_count: int, sensors: Sequence[tuple[str, int]]) -> list[LidarReading]:
        """Return what lidars see now."""
        world = self._run.world
        self._state.take(world, step_count)
        world.refresh_poses()
        return [self._lidars[sensor].sample(world.time_ns) for sensor in sensors]

    def observe(self) -> tuple[dict[str, _Belief], float]:
        """Return what the robots believe, and the CPU time of this process [s]."""
        return {stack.name: _belief(stack) for stack in self._stacks}, time.process_time()

    def _changed(self, what: str, now: dict[str, Any]) -> dict[str, Any]:
        new = {name: value for name, value in now.items() if self._told.get((what, name)) != value}
        self._told |= {(what, name): value for name, value in new.items()}
        return new


def _belief(stack: RobotStack) -> _Belief:
    pose, navigator = stack.robot_pose, stack.navigator
    goals = (0, 0) if navigator is None else (navigator.goals, navigator.recoveries)
    return _Belief(pose.in_map(), pose.in_odom(), *goals)


def _portable(error: BaseException) -> BaseException:
    """Return an error as it can be told to another process."""
    try:
        again = pickle.loads(pickle.dumps(error))
        if isinstance(again, type(error)) and str(again) == str(error):
            return error
    except Exception:  # whatever a user's class does
        pass
    kind = SimulationError if isinstance(error, TwinError) else RuntimeError
    return kind(str(error) if isinstance(error, TwinError) else f"{type(error).__name__}: {error}")
