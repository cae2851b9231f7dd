"""The mission's tree, with servers that answer as the test says: order, retries, and reasons to give up."""

from __future__ import annotations

import re
from collections.abc import Callable, Generator, Iterator
from typing import Any

import numpy as np
import pytest

from twin.bridge.action_types import (
    DockRobot,
    FollowJointTrajectory,
    GripperCommand,
    NavigateToPose,
    UndockRobot,
)
from twin.bridge.actions import ActionServer, GoalHandle
from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.conversions import pose2_from_pose, pose_from_pose2
from twin.bridge.msgs import JointState, PoseArray, String, header, new
from twin.bridge.srvs import SetBool
from twin.bridge.tf import TransformBuffer
from twin.bridge.types import ActionType
from twin.geometry import Pose2, Pose3
from twin.manipulation.telescopic_arm import GraspPose
from twin.models import load
from twin.nodes.navigation.robot_pose import Frames, RobotPose
from twin.runtime.defaults import from_description as derive
from twin.warehouse.pick_and_place import PickAndPlaceNode, PickAndPlaceTask
from twin.warehouse.shelf import Slot, Tote


def slot(name: str, face: Pose2, height: float) -> Slot:
    """A slot before which a robot stands with the heading of `face`, a point of the slot's front edge."""
    front = Pose3.from_pose2(face @ Pose2(0.0, 0.0, np.pi), height)
    return Slot(shelf=name, level=0, index=0, T_map_slot=front)


def task(name: str = "tote_a", height: float = 0.8) -> PickAndPlaceTask:
    """Carry a tote from a shelf whose surface is so high [m]."""
    shelf, size = slot("shelf", Pose2(5.0, 2.0, np.pi / 2), height), (0.30, 0.24, 0.18)
    tote = Tote(
        name=name, slot=shelf, T_map_tote=shelf.standing(0.30, 0.18, 0.05), size=size, mass=2.5,
        friction=0.6, rgba=(0.8, 0.2, 0.1, 1.0),
    )  # fmt: skip
    return PickAndPlaceTask(tote=tote, place=slot("table", Pose2(8.0, 0.0, 0.0), 0.4))


TOTE_IN_BASE = Pose2(0.6, 0.02, 0.05)

Answer = Callable[[GoalHandle], Any]


class Robot:
    """Servers for everything the mission asks of a robot; each action ends after a tick, as `answers` say."""

    def __init__(self, bus: Bus, clock: Clock) -> None:
        self.bus, self.clock = bus, clock
        description = load("warehouse_bot")
        manipulator = derive.manipulator(description)
        assert manipulator is not None
        self.manipulator = manipulator
        self.positions = dict.fromkeys((*manipulator.arm_joints, manipulator.gripper_joint), 0.0)
        self.sees_tote = True
        self.totes_in_base = [TOTE_IN_BASE]
        self.grips = True
        self.stalls = True
        self.log: list[str] = []
        self.at_closing: list[GraspPose] = []
        self.gripping = False
        self.haste: list[tuple[bool, float]] = []
        """Of every longer move: whether it carried something, and its top speed as a share of the limit."""
        self.failures: dict[str, list[str]] = {}
        """Action -> reasons with which its next goals fail."""
        self.effort = 80.0
        """Of the finger while it grips [N]."""
        self.driving_takes_ns = 20_000_000
        self.transforms = TransformBuffer()
        self.node = bus.create_node("robot")
        self._serve("navigate_to_pose", NavigateToPose, self._navigate)
        self._serve("dock_robot", DockRobot, lambda goal: f"dock {goal.dock_type}")
        self._serve("undock_robot", UndockRobot, lambda goal: f"undock {goal.dock_type}")
        self._serve("arm_controller/follow_joint_trajectory", FollowJointTrajectory, self._move)
        self._serve("gripper_controller/gripper_cmd", GripperCommand, self._grip)
        self.node.create_service(SetBool, "tote_detector/enable", self._enable)
        self._detecting = False
        self._joints = self.node.create_publisher(JointState, "joint_states", 1)
        self._totes = self.node.create_publisher(PoseArray, "tote_poses", 1)
        self.states: list[str] = []
        bus.create_node("watcher").create_subscription(
            String, "mission/state", lambda message: self.states.append(message.data)
        )

    def run(self, tasks: list[PickAndPlaceTask] | None = None, seconds: float = 120.0) -> PickAndPlaceNode:
        """Run a mission to its end."""
        mission = PickAndPlaceNode(
            self.bus,
            self.manipulator.arm,
            gripper_joint=self.manipulator.gripper_joint,
            gripper_open=self.manipulator.gripper_open,
            robot_pose=RobotPose(self.transforms, Frames()),
        )
        mission.carry(tasks or [task()])
        while not mission.done:
            assert self.clock.now_ns < seconds * 1e9, f"no end; it is at {mission.state!r}"
            self.advance()
        self.bus.spin()  # the last words arrive
        return mission

    def advance(self) -> None:
        """Let 20 ms pass, sense, and let all nodes run."""
        self.clock.now_ns += 20_000_000
        names = list(self.positions)
        zeros, values = np.zeros(len(names)), np.array(list(self.positions.values()))
        effort = np.array([-self.effort * (name == self.manipulator.gripper_joint) for name in names])
        self._joints.publish(
            JointState(header=header(0, ""), name=names, position=values, velocity=zeros, effort=effort)
        )
        if self.sees_tote and self._detecting and self.clock.now_ns % 100_000_000 == 0:
            poses = [pose_from_pose2(pose) for pose in self.totes_in_base]
            stamp = header(self.clock.now_ns, "base_footprint")
            self._totes.publish(PoseArray(header=stamp, poses=poses))
        self.bus.spin()

    def _serve(self, name: str, action: ActionType, perform: Callable[[Any], Any]) -> None:
        def execute(handle: GoalHandle) -> Generator[None, None, Any]:
            start = self.clock.now_ns
            yield
            while name == "navigate_to_pose" and self.clock.now_ns - start < self.driving_takes_ns:
                if handle.is_cancel_requested:
                    self.log.append(f"cancelled at {self.clock.now_ns * 1e-9:.1f} s")
                    handle.canceled()
                    return new(action.Result)
                yield
            if self.failures.get(name):
                handle.abort()
                key = "error_string" if action is FollowJointTrajectory else "error_msg"
                return new(action.Result, **{key: self.failures[name].pop(0)})
            done = perform(handle.request)
            if not isinstance(done, str):
                return done
            self.log.append(done)
            return new(action.Result)

        ActionServer(self.node, action, name, execute)

    def _enable(self, request: Any) -> Any:
        self._detecting = request.data
        return new(SetBool.Response, success=True)

    def _navigate(self, goal: Any) -> str:
        pose = pose2_from_pose(goal.pose.pose)
        return f"go {pose.x:.2f} {pose.y:.2f} {pose.yaw:.2f}"

    def _move(self, goal: Any) -> str:
        rates = np.abs([point.velocities for point in goal.trajectory.points]).max(axis=0)
        limits = [self.manipulator.arm.limits[name].max_velocity for name in goal.trajectory.joint_names]
        if goal.trajectory.points[-1].time_from_start.sec >= 1:
            self.haste.append((self.gripping, float(np.max(rates / limits))))
        target = dict(zip(goal.trajectory.joint_names, goal.trajectory.points[-1].positions, strict=True))
        self.positions |= {name: float(value) for name, value in target.items()}
        return "move"

    def _grip(self, goal: Any) -> Any:
        wanted = float(goal.command.position)
        closing = wanted == 0.0
        if closing:
            self.at_closing.append(self.grasp)
        holds = closing and self.grips
        position = 0.12 if holds else wanted
        self.positions[self.manipulator.gripper_joint] = position
        self.log.append("close" if closing else "open")
        self.gripping = holds
        return new(
            GripperCommand.Result,
            position=position,
            effort=self.effort,
            stalled=holds and self.stalls,
            reached_goal=not holds,
        )

    @property
    def grasp(self) -> GraspPose:
        """Where the gripper is now."""
        return self.manipulator.arm.forward(self.positions)[0]


@pytest.fixture
def robot() -> Iterator[Robot]:
    clock = Clock()
    with Bus.open(clock) as bus:
        yield Robot(bus, clock)


def steps(robot: Robot) -> list[str]:
    return [entry for entry in robot.log if entry != "move"]


def test_one_tote_is_fetched_and_set_down(robot: Robot) -> None:
    mission = robot.run()
    assert mission.succeeded
    assert mission.reason == ""
    assert steps(robot) == [
        "go 5.00 0.70 1.57",  # the staging pose 1.3 m before the shelf's face, looking at it
        "open",
        "dock tote",
        "close",
        "undock shelf",
        "go 6.70 0.00 0.00",
        "dock table",
        "open",
        "undock table",
    ]
    assert robot.states[-1] == "done"
    words = ["drive to shelf/0/0", "dock at shelf/0/0", "look", "reach", "grasp", "retract", "back off",
             "carry to table/0/0", "dock at table/0/0", "set down", "release", "back off"]  # fmt: skip
    assert robot.states[:-1] == [f"tote_a: {word}" for word in words]


def test_it_reaches_for_where_the_tote_is_seen_not_for_where_the_plan_says(robot: Robot) -> None:
    robot.run()
    centre = TOTE_IN_BASE @ Pose2(0.15, 0.0, 0.0)
    at = robot.at_closing[0]
    assert at.x == pytest.approx(centre.x, abs=0.02)
    assert at.z == pytest.approx(0.8 + 0.09), "the middle of the tote's height"
    assert at.yaw == pytest.approx(TOTE_IN_BASE.yaw)


def test_a_loaded_arm_moves_at_half_its_speed(robot: Robot) -> None:
    robot.run()
    loaded = [share for carries, share in robot.haste if carries]
    free = [share for carries, share in robot.haste if not carries]
    assert max(loaded) == pytest.approx(0.5, abs=0.02)
    assert max(free) == pytest.approx(1.0, abs=0.02)


def test_two_totes_come_one_after_the_other(robot: Robot) -> None:
    tasks = [task("tote_a"), task("tote_b")]
    assert robot.run(tasks).succeeded
    assert steps(robot).count("close") == 2
    first_b = next(i for i, state in enumerate(robot.states) if state.startswith("tote_b"))
    assert all(state.startswith("tote_a") for state in robot.states[:first_b])


def test_a_gripper_closed_on_nothing_tries_again_and_then_gives_up(robot: Robot) -> None:
    robot.grips = False
    mission = robot.run()
    assert mission.succeeded is False
    assert steps(robot).count("close") == 3
    assert "closed on nothing of 0.24 m width: finger at 0.000 m" in mission.reason
    assert "tote_a: grasp" in mission.reason
    assert "go 6.70 0.00 0.00" not in robot.log, "nothing is carried away"
    assert robot.states[-1] == "failed"


def test_fingers_that_stop_at_the_right_width_by_themselves_hold_nothing(robot: Robot) -> None:
    robot.stalls = False
    mission = robot.run()
    assert mission.succeeded is False
    assert "closed on nothing" in mission.reason


def test_between_two_attempts_it_lets_go_and_drives_to_the_staging_pose_again(robot: Robot) -> None:
    robot.failures["dock_robot"] = ["no tote in sight"]
    assert robot.run().succeeded
    at = steps(robot)
    assert at[1:7] == ["open", "open", "undock shelf", "go 5.00 0.70 1.57", "open", "dock tote"]


def test_a_table_that_was_missed_is_docked_at_again_with_the_tote_in_the_gripper(robot: Robot) -> None:
    def miss() -> None:
        if robot.states and robot.states[-1] == "tote_a: dock at table/0/0" and not missed:
            missed.append(True)
            robot.failures["dock_robot"] = ["docking failed: missed"]

    missed: list[bool] = []
    robot.node.create_timer(20_000_000, miss)
    assert robot.run().succeeded
    at = steps(robot)
    tail = ["undock shelf", "go 6.70 0.00 0.00", "undock table", "go 6.70 0.00 0.00", "dock table", "open"]
    assert at[at.index("close") + 1 :][:6] == tail


def test_a_blocked_reach_is_retracted_before_anything_moves(robot: Robot) -> None:
    def block() -> None:
        if robot.states and robot.states[-1] == "tote_a: reach" and not blocked:
            blocked.append(True)
            robot.log.append("reach")
            robot.failures["arm_controller/follow_joint_trajectory"] = ["'arm_stage_1_joint' is away"]

    blocked: list[bool] = []
    robot.node.create_timer(20_000_000, block)
    assert robot.run().succeeded
    at = robot.log[robot.log.index("reach") :]
    assert at[:5] == ["reach", "open", "move", "undock shelf", "move"]
    assert "go 5.00 0.70 1.57" in at


def test_a_neighbours_tote_is_not_reached_for(robot: Robot) -> None:
    robot.totes_in_base = [Pose2(0.6, 0.2, 0.0), Pose2(0.6, -0.4, 0.0)]
    mission = robot.run()
    assert mission.succeeded is False
    assert "no tote straight ahead" in mission.reason
    assert "close" not in robot.log


def test_without_a_tote_in_sight_it_does_not_reach(robot: Robot) -> None:
    robot.sees_tote = False
    mission = robot.run()
    assert mission.succeeded is False
    assert "close" not in robot.log
    assert not any(state.endswith("reach") for state in robot.states)


def fingers_close(robot: Robot) -> None:
    robot.positions[robot.manipulator.gripper_joint] = 0.09


def grip_fails(robot: Robot) -> None:
    robot.effort = 0.0


@pytest.mark.parametrize(
    ("happens", "told"),
    [
        (fingers_close, "finger at 0.090 m instead of 0.120 m"),
        (grip_fails, "finger presses with 0 N instead of 80 N"),
    ],
)
def test_a_tote_lost_on_the_way_ends_the_drive_at_once(
    robot: Robot, happens: Callable[[Robot], None], told: str
) -> None:
    robot.driving_takes_ns = 20_000_000_000
    robot.transforms.set_transform(
        "map", "base_footprint", 0, Pose3.from_xyz_rpy((6.0, 1.0, 0.0)), static=True
    )
    lost: list[float] = []

    def lose() -> None:
        if robot.states and robot.states[-1] == "tote_a: carry to table/0/0" and not lost:
            lost.append(robot.clock.now_ns * 1e-9)
            happens(robot)

    robot.node.create_timer(20_000_000, lose)
    mission = robot.run()
    assert mission.succeeded is False
    noticed = re.search(r"lost tote_a at ([\d.]+) s, at \(6.00, 1.00\): (.*)", mission.reason)
    assert noticed is not None
    assert lost[0] < float(noticed[1]) < lost[0] + 0.3
    assert noticed[2] == told
    assert robot.log[-1].startswith("cancelled"), "the drive ends, too"


def test_navigation_that_fails_ends_the_mission_with_its_reason(robot: Robot) -> None:
    robot.failures["navigate_to_pose"] = ["no path from (0.00, 0.00) to (5.00, 0.70)"]
    mission = robot.run()
    assert mission.succeeded is False
    assert mission.reason == (
        "tote_a: drive to shelf/0/0: NavigateTo[shelf/0/0]: no path from (0.00, 0.00) to (5.00, 0.70)"
    )


def test_an_arm_that_is_blocked_is_named(robot: Robot) -> None:
    reason = "'lift_joint' is +0.2000 away from its goal, 0.005 is allowed"
    robot.failures["arm_controller/follow_joint_trajectory"] = [reason]
    mission = robot.run()
    assert mission.succeeded is False
    assert reason in mission.reason


def test_a_tote_out_of_reach_is_said_before_anything_is_grasped(robot: Robot) -> None:
    mission = robot.run([task(height=3.0)])
    assert mission.succeeded is False
    assert "cannot reach" in mission.reason
    assert "close" not in robot.log
