"""A robot's queue of tasks: what it takes, in which order it does it, and what holds it."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import pytest

from tests.nodes.conftest import Bench, Robot, map_of_room, open_room
from twin.bridge import types
from twin.bridge.action_types import NavigateToPose, Wait
from twin.bridge.actions import ActionServer, GoalHandle
from twin.bridge.conversions import pose2_from_pose
from twin.bridge.msgs import DiagnosticArray, duration, new, ns
from twin.bridge.qos import LATCHED
from twin.bridge.srvs import Trigger
from twin.bridge.types import ActionType, ServiceType
from twin.geometry import Pose2
from twin.nodes.guard.status import GuardStatus
from twin.nodes.messages import pose_stamped
from twin.nodes.missions.mission_node import MissionNode
from twin.nodes.missions.tasks.kinds import DriveTo, WaitFor
from twin.nodes.missions.tasks.server import TaskServer
from twin.nodes.navigation.mapping.map_server import MapServerNode

PENDING, ACTIVE, SUCCEEDED, FAILED, CANCELED = range(5)
Task: Any = types.get("twin_msgs/msg/Task")


class Queue:
    """A robot with a queue, and servers that take a second for each goal."""

    def __init__(self, bench: Bench, *first: Any, fails: str = "", **options: Any) -> None:
        self.bench = bench
        self.goals: list[Any] = []
        self.fails = fails
        """Reason with which goals fail from now on."""
        MapServerNode(bench.bus, map_of_room())
        pose = Robot(bench, open_room()).pose_lookup
        for name, kind in (("navigate_to_pose", NavigateToPose), ("wait", Wait)):
            self._serve(name, kind)
        self.mission = MissionNode(bench.bus)
        kinds = [DriveTo(self.mission, pose, {"door": Pose2(1.0, 0.5, 0.0)}, 0.2), WaitFor(self.mission)]
        self.server = TaskServer(self.mission, kinds, pose, **options)
        self.told: list[Any] = []
        bench.node.create_subscription(
            types.get("twin_msgs/msg/TaskQueue"), "tasks", self.told.append, LATCHED
        )
        self.guard = bench.node.create_publisher(DiagnosticArray, "guard/status", LATCHED)
        for each in first:
            self.server.add(new(Task, **each))
        bench.run(0.5)

    def _serve(self, name: str, kind: ActionType) -> None:
        def execute(handle: GoalHandle) -> Generator[None, None, Any]:
            self.goals.append(handle.request)
            start = self.bench.now_s
            while self.bench.now_s < start + 1.0:
                if handle.is_cancel_requested:
                    handle.canceled()
                    self.goals.append("cancelled")
                    return new(kind.Result)
                yield
            if self.fails:
                handle.abort()
                return new(kind.Result, error_msg=self.fails)
            handle.succeed()
            return new(kind.Result)

        ActionServer(self.bench.node, kind, name, execute)

    def ask(self, service: str, kind: str, **fields: Any) -> Any:
        return self.bench.call(ServiceType(kind), service, new(types.get(f"{kind}_Request"), **fields))

    def add(self, position: int = 0, **task: Any) -> Any:
        return self.ask("add_task", "twin_msgs/srv/AddTask", task=new(Task, **task), position=position)

    def tell(self, service: str) -> Any:
        return self.bench.call(Trigger, service, Trigger.Request())

    def stop(self, by: str | None) -> None:
        status = GuardStatus(stamp_ns=0, stopped_by=by, stops=1, in_charge="", warnings=(), verdicts={})
        self.guard.publish(status.message())
        self.bench.run(0.1)

    @property
    def states(self) -> dict[int, int]:
        return {each.id: each.state for each in self.told[-1].tasks}

    @property
    def waiting(self) -> list[int]:
        return [number for number, state in self.states.items() if state == PENDING]

    def until(self, number: int, state: int) -> Any:
        self.bench.until(lambda: self.states.get(number) == state, 10.0)
        return next(each for each in self.told[-1].tasks if each.id == number)


def test_tasks_are_done_in_their_order_and_everybody_is_told(bench: Bench) -> None:
    queue = Queue(bench)
    assert (answer := queue.add(type="drive_to", place="door")).message == "drive to door"
    assert queue.add(type="wait", duration=duration(2_500_000_000)).message == "wait 2.5 s"
    assert queue.until(answer.id, ACTIVE).step == "task 1: drive to door"
    assert queue.waiting == [2]
    queue.until(2, SUCCEEDED)
    assert queue.states == {1: SUCCEEDED, 2: SUCCEEDED}
    assert pose2_from_pose(queue.goals[0].pose.pose) == Pose2(1.0, 0.5, 0.0)
    assert ns(queue.goals[1].time) == 2_500_000_000
    assert not queue.mission.done, "it waits for more"
    assert queue.mission.state == "waits for tasks"


@pytest.mark.parametrize(
    ("task", "reason"),
    [
        ({"type": "fly"}, "there are no tasks of type 'fly'; Valid: drive_to, wait"),
        ({"type": "drive_to", "place": "dor"}, "there is no place 'dor'; did you mean 'door'? Valid: door"),
        ({"type": "wait"}, "a wait of 0 s is none; valid: a duration of more than 0 s"),
        (
            {"type": "drive_to", "pose": pose_stamped(Pose2(0.0, 0.0, 0.0), "odom", 0)},
            "the pose is in the frame 'odom'; valid: map",
        ),
        (
            {"type": "drive_to", "pose": pose_stamped(Pose2(float("nan"), 0.0, 0.0), "map", 0)},
            "the pose is not finite; valid: x and y in m, and a quaternion",
        ),
        (
            {"type": "drive_to", "pose": pose_stamped(Pose2(99.0, 0.0, 0.0), "map", 0)},
            "(99.00, 0.00) is in a wall, or cannot be reached; the nearest place that can is (",
        ),
    ],
)  # fmt: skip
def test_what_cannot_be_done_is_refused_with_what_can(bench: Bench, task: Any, reason: str) -> None:
    queue = Queue(bench)
    answer = queue.add(**task)
    assert (answer.success, answer.id) == (False, 0)
    assert answer.message.startswith(reason)
    assert queue.states == {}


def test_who_waits_is_moved_cancelled_and_cleared(bench: Bench) -> None:
    queue = Queue(bench)
    assert queue.tell("pause_tasks").success
    for _ in range(3):
        queue.add(type="wait", duration=duration(10**9))
    assert queue.add(position=1, type="drive_to", place="door").id == 4
    bench.run(1.0)
    assert queue.told[-1].paused
    assert queue.waiting == [4, 1, 2, 3], "a queue that is held begins nothing"

    def move(number: int, position: int) -> Any:
        return queue.ask("move_task", "twin_msgs/srv/MoveTask", id=number, position=position)

    def cancel(number: int) -> Any:
        return queue.ask("cancel_task", "twin_msgs/srv/CancelTask", id=number)

    assert move(3, 2).message == "wait 1 s is number 2 of those that wait"
    assert move(4, 0).success
    bench.run(0.1)
    assert queue.waiting == [3, 1, 2, 4]
    assert cancel(1).success
    assert cancel(1).message == "task 1 (wait 1 s) was cancelled, and cannot be cancelled"
    assert move(9, 1).message == "there is no task 9; valid: 3, 2, 4"
    assert queue.tell("resume_tasks").success
    queue.until(3, ACTIVE)
    assert move(3, 2).message == "task 3 (wait 1 s) is under way, and cannot be moved"
    assert cancel(3).success
    queue.until(2, ACTIVE)
    assert queue.goals[-2] == "cancelled", "its server was told"
    assert queue.tell("clear_tasks").success
    bench.run(0.5)
    assert queue.states == {1: CANCELED, 3: CANCELED, 2: CANCELED, 4: CANCELED}
    assert queue.goals[-1] == "cancelled"


def test_a_task_that_fails_holds_the_queue_and_says_why(bench: Bench) -> None:
    queue = Queue(bench)
    queue.fails = "no way"
    for _ in range(2):
        queue.add(type="drive_to", place="door")
    assert queue.until(1, FAILED).error == "task 1: drive to door: NavigateTo: no way"
    bench.run(1.0)
    assert queue.told[-1].reason == "task 1 failed: task 1: drive to door: NavigateTo: no way"
    assert queue.waiting == [2]
    queue.fails = ""
    assert queue.tell("resume_tasks").success
    queue.until(2, SUCCEEDED)
    assert not queue.told[-1].paused


def test_an_emergency_stop_ends_what_is_under_way_and_holds_the_queue_past_its_release(bench: Bench) -> None:
    queue = Queue(bench)
    for _ in range(2):
        queue.add(type="drive_to", place="door")
    queue.until(1, ACTIVE)
    queue.stop("Mei")
    assert queue.states == {1: CANCELED, 2: PENDING}
    assert queue.told[-1].tasks[0].error == queue.told[-1].reason == "emergency stop by Mei"
    assert queue.tell("resume_tasks").message == (
        "the emergency stop by Mei holds the robot; release it first"
    )
    queue.stop(None)
    bench.run(1.0)
    assert queue.waiting == [2], "a release moves nothing by itself"
    assert queue.tell("resume_tasks").success
    queue.until(2, SUCCEEDED)


@pytest.mark.parametrize("fails", ["", "no way"])
def test_a_mission_that_waits_for_no_more_ends_with_its_last_task_or_the_first_that_fails(
    bench: Bench, fails: str
) -> None:
    door = {"type": "drive_to", "place": "door"}
    queue = Queue(bench, door, door, fails=fails, waits_for_more=False)
    bench.until(lambda: queue.mission.done, 10.0)
    assert queue.mission.succeeded is not bool(fails)
    assert queue.mission.reason == ("task 1: drive to door: NavigateTo: no way" if fails else "")
    assert len(queue.goals) == (1 if fails else 2)
