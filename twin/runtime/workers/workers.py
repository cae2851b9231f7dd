"""The workers of a run, as its tick uses them."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Sequence
from multiprocessing.connection import Connection
from typing import TYPE_CHECKING, Any, cast

from twin.bridge.workers.crew import Crew, Peer
from twin.bridge.workers.part import Act
from twin.errors import ScenarioError
from twin.nodes.missions.mission_node import MissionNode
from twin.nodes.r2d2_state_publisher import R2D2StatePublisherNode
from twin.runtime.threads import end_threads
from twin.runtime.workers.process import Worker
from twin.runtime.workers.robots_here import Done, RobotsHere, missions_of
from twin.runtime.workers.shared_state import SharedState
from twin.runtime.workers.stand_ins import Belief, Scanned, Told
from twin.sensors.lidar import Lidar

if TYPE_CHECKING:
    from twin.runtime.run import Run
    from twin.runtime.sensing import Due
    from twin.runtime.stacks.robot import RobotStack


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
        self._run = run
        missions = missions_of(run)
        staying = frozenset[str]() if run.faults is None else run.faults.robots
        stacks = (stack for stack in run.parts.stacks.values() if stack.name not in staying)
        leaving = [stack for stack in stacks if _can_leave(stack, missions.get(stack.name))]
        shares = [leaving[i::count] for i in range(min(count, len(leaving)))]
        self._state = state = SharedState(run.world)
        self._pipes: list[Connection] = []
        """The run's ends, which no worker may keep open."""
        end_threads()
        self._workers = [Worker(run, state, self._pipes, i, share) for i, share in enumerate(shares)]
        self._by_peer = {id(worker.peer): worker for worker in self._workers}
        self._crew = Crew(run.bus, [worker.peer for worker in self._workers])
        self._missions = missions
        self._beliefs: dict[str, Belief] = {}
        self._scanned: dict[int, tuple[Worker, tuple[str, int]]] = {}
        """By sensor: who samples it, and what it is called there."""
        self.cpu_s = 0.0
        """CPU time of the workers at the last observation [s]."""
        for worker, stack in ((w, s) for w, share in zip(self._workers, shares, strict=True) for s in share):
            for number, sensor in enumerate(stack.sensors):
                if type(sensor.sensor) is Lidar and sensor.sensor.spec.method == "instant":
                    sensor.sensor = Scanned(sensor.sensor)
                    self._scanned[id(sensor)] = worker, (stack.name, number)
            told = Told(stack.robot_pose, self._beliefs, stack.name)
            stack.robot_pose, stack.navigator = told, cast(Any, stack.navigator and told)
        if shares:
            run.world.use_threads(max(1, len(shares) - 1))
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
            worker.send(RobotsHere.observe)
        for worker in self._workers:
            beliefs, worker.cpu_s = worker.receive()
            self._beliefs |= beliefs
        self.cpu_s = sum(worker.cpu_s for worker in self._workers)

    def close(self) -> None:
        """End the workers. Harmless when repeated."""
        for pipe in self._pipes:
            pipe.close()  # which they notice
        for worker in self._workers:
            worker.wait()
        self._crew.close()

    def _scan(self, sensors: Sequence[Due], time_ns: int) -> None:
        """Let workers sample those of their lidars that are about to fire."""
        asked: dict[Worker, list[tuple[tuple[str, int], Scanned]]] = {}
        for sensor in sensors:
            if (found := self._scanned.get(id(sensor))) is not None and isinstance(sensor.sensor, Scanned):
                asked.setdefault(found[0], []).append((found[1], sensor.sensor))
        if asked:
            self._state.tell(self._run.world)
        for worker, lidars in asked.items():
            worker.send(RobotsHere.scan, self._run.world.step_count, [name for name, _ in lidars])
        for worker, lidars in asked.items():
            for (_, lidar), reading in zip(lidars, worker.receive(), strict=True):
                lidar.reading = reading

    def _exchange(
        self, busy: Sequence[Peer], meanwhile: Callable[[], None]
    ) -> Iterator[tuple[Peer, Sequence[Act]]]:
        world = self._run.world
        if busy:
            self._state.tell(world)
        for peer in busy:
            self._by_peer[id(peer)].send(RobotsHere.tick, world.step_count, peer.take())
        meanwhile()
        for peer in busy:
            done: Done = self._by_peer[id(peer)].receive()
            peer.due_ns = done.due_ns
            for name, orders in done.orders.items():
                self._run.parts.stacks[name].handle.hardware.obey(orders)
            for name, state in done.missions.items():
                node = self._missions[name]
                node.state, node.done, node.succeeded, node.reason = state
            yield peer, done.acts


def _can_leave(stack: RobotStack, mission: MissionNode | None) -> bool:
    """Whether a worker can run the nodes of a robot: they share nothing with others but the world.

    A map that is made is looked at in this process, and a kinematic base is moved here, as hardware fails
    here; a robot that is the only one, in no namespace, is among the user's own nodes.
    """
    return (
        bool(stack.context.namespace)
        and stack.slam is None
        and not isinstance(mission, R2D2StatePublisherNode)
    )
