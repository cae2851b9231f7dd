"""Tasks that carry totes, with servers that answer as the test says: where totes are, what is put away."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from tests.warehouse.test_pick_and_place import Robot, steps
from twin.bridge import types
from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.msgs import new
from twin.errors import TaskError
from twin.navigation.behavior_trees.node import Status
from twin.nodes.navigation.robot_pose import Frames, RobotPose
from twin.warehouse import arena as arenas
from twin.warehouse.carrying import Carry
from twin.warehouse.pick_and_place import PickAndPlaceNode


class Carrier:
    """A robot that carries."""

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self.node = PickAndPlaceNode(
            robot.bus,
            robot.manipulator.arm,
            gripper_joint=robot.manipulator.gripper_joint,
            gripper_open=robot.manipulator.gripper_open,
            robot_pose=RobotPose(robot.transforms, Frames()),
        )
        self.carry = Carry(self.node, arenas.load("warehouse"))

    def check(self, tote: str, to: str = "unloading") -> str:
        return self.carry.check(task(tote, to))

    def tick(self, tree: Any) -> Status:
        """Tick a tree every 0.1 s, as the queue does."""
        for _ in range(5):
            self.robot.advance()
        return tree.execute_tick()

    def run(self, tree: Any, until: str = "") -> Status:
        """Tick a tree to its end, or until the robot did something."""
        for _ in range(1000):
            status = self.tick(tree)
            if status.is_completed or (until and until in self.robot.log):
                return status
        raise AssertionError(f"no end; it is at {self.node.state!r}")


def task(tote: str, to: str = "unloading") -> Any:
    return new(types.get("twin_msgs/msg/Task"), type="carry", tote=tote, to=to)


@pytest.fixture
def carrier() -> Iterator[Carrier]:
    clock = Clock()
    with Bus.open(clock) as bus:
        yield Carrier(Robot(bus, clock))


def test_what_is_not_there_and_what_has_no_room_is_refused(carrier: Carrier) -> None:
    assert carrier.check("tote_a") == "carry tote_a to unloading"
    for tote, to, why in (
        (
            "tote_d",
            "unloading",
            "there is no tote 'tote_d'; did you mean 'tote_c'? Valid: tote_a, tote_b, tote_c",
        ),
        ("tote_a", "start", "tote_a cannot be carried to 'start'; Valid: unloading, unloading/0/0"),
    ):
        with pytest.raises(TaskError) as refused:
            carrier.check(tote, to)
        assert str(refused.value).startswith(why)
    assert carrier.run(carrier.carry.tree(task("tote_a", "unloading/0/1"))) is Status.SUCCESS
    with pytest.raises(TaskError, match=r"tote_a stands in unloading/0/1 already; .*Valid: tote_b, tote_c"):
        carrier.check("tote_a")
    with pytest.raises(TaskError, match=r"there is no room in unloading/0/1; "):
        carrier.check("tote_b", "unloading/0/1")


def test_what_was_broken_off_is_put_away_and_the_tote_carried_on(carrier: Carrier) -> None:
    tree = carrier.carry.tree(task("tote_a"))
    assert carrier.carry.tidy() is not None, "even a task that has only begun"
    carrier.run(tree, until="close")
    carrier.tick(tree)
    tree.reset()
    assert carrier.node.holds is not None

    # The robot is docked with a tote between its fingers: it lifts, backs off, and keeps it.
    carrier.robot.log.clear()
    tidy = carrier.carry.tidy()
    assert carrier.run(tidy) is Status.SUCCESS
    assert steps(carrier.robot) == ["undock shelf"]
    assert carrier.carry.tidy() is None
    with pytest.raises(TaskError, match="the gripper holds tote_a; carry that first"):
        carrier.carry.tree(task("tote_b"))

    # The same task again goes on where it was.
    carrier.robot.log.clear()
    assert carrier.run(carrier.carry.tree(task("tote_a"))) is Status.SUCCESS
    assert steps(carrier.robot)[1:] == ["dock table", "open", "undock table"]
    assert carrier.carry.tidy() is None


def test_who_holds_nothing_lets_go_before_it_backs_off(carrier: Carrier) -> None:
    tree = carrier.carry.tree(task("tote_a"))
    carrier.run(tree, until="dock tote")
    carrier.tick(tree)
    tree.reset()
    carrier.robot.log.clear()
    assert carrier.run(carrier.carry.tidy()) is Status.SUCCESS
    assert steps(carrier.robot) == ["open", "undock shelf"]
    assert carrier.check("tote_a"), "it stands where it stood"


def test_nobody_knows_where_a_tote_is_that_was_lost(carrier: Carrier) -> None:
    carrier.robot.stalls = True
    tree = carrier.carry.tree(task("tote_a"))
    carrier.run(tree, until="undock shelf")
    carrier.robot.positions[carrier.robot.manipulator.gripper_joint] = 0.0
    assert carrier.run(tree) is Status.FAILURE
    with pytest.raises(TaskError, match=r"tote_a was lost on the way; .*Valid: tote_b, tote_c"):
        carrier.check("tote_a")
