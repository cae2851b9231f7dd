"""The queue of a robot's tasks as services and topics, beside its mission."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from twin.bridge import types
from twin.bridge.msgs import DiagnosticArray, header
from twin.bridge.qos import LATCHED
from twin.bridge.srvs import Trigger
from twin.bridge.types import ServiceType
from twin.errors import TaskError, nearest
from twin.navigation.behavior_trees.node import Status, TreeNode
from twin.nodes.guard.status import GuardStatus
from twin.nodes.missions.mission_node import PERIOD_NS, MissionNode
from twin.nodes.missions.tasks.kinds import TaskKind
from twin.nodes.missions.tasks.queue import State, TaskQueue
from twin.nodes.navigation.robot_pose import RobotPose

_MOST = 1000
"""Tasks that wait: who adds more has lost count."""
_ADD = ServiceType("twin_msgs/srv/AddTask")
_CANCEL = ServiceType("twin_msgs/srv/CancelTask")
_MOVE = ServiceType("twin_msgs/srv/MoveTask")


class TaskServer:
    """Does the tasks of a mission one after the other.

    After one that failed, and after an emergency stop, the queue waits until it is resumed.
    """

    def __init__(
        self,
        mission: MissionNode,
        kinds: Iterable[TaskKind],
        robot_pose: RobotPose,
        *,
        waits_for_more: bool = True,
    ) -> None:
        """Offer the services of `mission`'s node.

        Args:
            mission: Tells what the robot is at.
            kinds: Of the tasks.
            robot_pose: Where the robot is; until it knows that, no task begins.
            waits_for_more: Whether the mission goes on when nothing is left to do, or a task has failed.
        """
        self._mission, self._robot_pose, self._waits_for_more = mission, robot_pose, waits_for_more
        self._kinds = {kind.name: kind for kind in kinds}
        self.queue = TaskQueue()
        self._tree: TreeNode | None = None
        self._is_tidying = False
        self._held_by = ""
        """Why the next task does not begin; empty: it does."""
        self._stopped_by: str | None = None
        self._status_type = types.get("twin_msgs/msg/TaskStatus")
        self._queue_type = types.get("twin_msgs/msg/TaskQueue")
        node = mission.node
        self._publisher = node.create_publisher(self._queue_type, "tasks", LATCHED)
        places = types.get("twin_msgs/msg/Places")
        named = [place for kind in self._kinds.values() for place in kind.places()]
        self._places = node.create_publisher(places, "places", LATCHED)
        self._places.publish(places(header=header(node.now_ns, robot_pose.frames.map), places=named))
        node.create_service(_ADD, "add_task", self._on_add)
        node.create_service(_CANCEL, "cancel_task", lambda asked: self._done(_CANCEL, self._cancel, asked.id))
        node.create_service(
            _MOVE, "move_task", lambda asked: self._done(_MOVE, self._move, asked.id, asked.position)
        )
        node.create_service(Trigger, "clear_tasks", lambda _: self._done(Trigger, self._clear))
        node.create_service(Trigger, "pause_tasks", lambda _: self._done(Trigger, self._pause))
        node.create_service(Trigger, "resume_tasks", lambda _: self._done(Trigger, self._resume))
        node.create_subscription(DiagnosticArray, "guard/status", self._on_guard, LATCHED)
        node.create_timer(PERIOD_NS, self._tick)
        if waits_for_more:
            mission.enter("waits for tasks")
        self._tell()

    def add(self, task: Any, position: int = 0) -> tuple[int, str]:
        """Let a task, a `twin_msgs/msg/Task`, wait; return its number, and the task for people.

        Raises:
            TaskError: it cannot be done.
        """
        if task.type not in self._kinds:
            raise TaskError(f"there are no tasks of type '{task.type}'; {nearest(task.type, self._kinds)}")
        if len(self.queue.pending) >= _MOST:
            raise TaskError(f"{_MOST} tasks wait already; cancel some, or clear the queue")
        entry = self.queue.add(task, self._kinds[task.type].check(task), position)
        self._tell()
        return entry.id, entry.text

    # What others ask

    def _on_add(self, request: Any) -> Any:
        try:
            number, text = self.add(request.task, request.position)
        except TaskError as refused:
            return _ADD.Response(success=False, message=str(refused), id=0)
        return _ADD.Response(success=True, message=text, id=number)

    def _done(self, kind: ServiceType, act: Callable[..., str], *arguments: int) -> Any:
        """Do what was asked, and return the response that says so, or why not."""
        try:
            message = act(*arguments)
        except TaskError as refused:
            return kind.Response(success=False, message=str(refused))
        self._tell()
        return kind.Response(success=True, message=message)

    def _cancel(self, number: int) -> str:
        active = self.queue.active
        if active is not None and active.id == number:
            self._break_off("")
            return f"{active.text} is cancelled"
        return f"{self.queue.drop(number).text} is cancelled"

    def _move(self, number: int, position: int) -> str:
        entry = self.queue.move(number, position)
        return f"{entry.text} is number {self.queue.pending.index(entry) + 1} of those that wait"

    def _clear(self) -> str:
        waiting = [entry.id for entry in self.queue.pending]
        for number in waiting:
            self.queue.drop(number)
        if self.queue.active is not None:
            self._break_off("")
        return "all tasks are cancelled"

    def _pause(self) -> str:
        self._held_by = "paused by an operator"
        return "what is under way goes on, the next one waits"

    def _resume(self) -> str:
        if self._stopped_by is not None:
            raise TaskError(f"the emergency stop by {self._stopped_by} holds the robot; release it first")
        self._held_by = ""
        return "the queue goes on"

    # What the robot does

    def _on_guard(self, message: DiagnosticArray) -> None:
        status = GuardStatus.of_message(message)
        if status is None:
            return
        if status.is_stopped and self._stopped_by is None:
            why = f"emergency stop by {status.stopped_by}"
            if self.queue.active is not None or self._is_tidying:
                self._break_off(why)
            self._held_by = why
            self._tell()
        self._stopped_by = status.stopped_by

    def _tick(self) -> None:
        if self._mission.done or self._robot_pose.in_map() is None:
            return
        if self._tree is None:
            self._begin()
        if self._tree is None:
            return
        status = self._tree.execute_tick()
        active = self.queue.active
        if status.is_completed:
            self._end(status)
        elif active is not None and active.step != self._mission.state:
            active.step = self._mission.state
            self._tell()

    def _begin(self) -> None:
        """Put away what is to be put away, else take the next task."""
        if self._held_by:
            return
        tidy = next((tree for kind in self._kinds.values() if (tree := kind.tidy()) is not None), None)
        if tidy is not None:
            self._tree, self._is_tidying = tidy, True
            self._mission.enter("put away what was broken off")
            return
        entry = self.queue.begin()
        if entry is None:
            if not self._waits_for_more:
                self._mission.finish(succeeded=True)
            return
        self._mission.reason = ""
        self._mission.enter(f"task {entry.id}: {entry.text}")
        entry.step = self._mission.state
        try:
            self._tree = self._kinds[entry.task.type].tree(entry.task)
        except TaskError as refused:
            self._mission.note(str(refused))
            self._end(Status.FAILURE)
            return
        self._tell()

    def _end(self, status: Status) -> None:
        self._tree = None
        succeeded = status is Status.SUCCESS
        reason = "" if succeeded else self._mission.reason or f"{self._mission.state}: failed"
        if self._is_tidying:
            self._is_tidying, what = False, "what was broken off"
        else:
            entry = self.queue.end(State.SUCCEEDED if succeeded else State.FAILED, reason)
            what = f"task {entry.id}"
        if not succeeded and not self._waits_for_more:
            self._mission.finish(succeeded=False)
        elif not succeeded:
            self._held_by = f"{what} failed: {reason}"
        elif not self.queue.pending and self._waits_for_more:
            self._mission.enter("waits for tasks")
        self._tell()

    def _break_off(self, error: str) -> None:
        """End the task under way, and whatever it does, here and now."""
        if self._tree is not None:
            self._tree.reset()
        self._tree = None
        if self.queue.active is not None:
            entry = self.queue.end(State.CANCELED, error)
            self._mission.enter(f"task {entry.id}: cancelled")
        self._is_tidying = False

    def _tell(self) -> None:
        tasks = [
            self._status_type(
                id=entry.id,
                task=entry.task,
                text=entry.text,
                state=int(entry.state),
                step=entry.step,
                error=entry.error,
            )
            for entry in self.queue.entries
        ]
        told = self._queue_type(paused=bool(self._held_by), reason=self._held_by, tasks=tasks)
        self._publisher.publish(told)
