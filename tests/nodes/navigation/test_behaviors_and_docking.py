"""behavior_server, docking_server and tote_detector on ideal wheels and synthetic scans."""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.nodes.conftest import TICK_NS, Bench, Robot, Room, box, open_room, scan
from twin.bridge.action_types import (
    AssistedTeleop,
    BackUp,
    DockRobot,
    DriveOnHeading,
    NavigateToPose,
    Spin,
    UndockRobot,
    Wait,
)
from twin.bridge.actions import ActionClient, ActionServer, GoalHandle
from twin.bridge.conversions import pose2_from_pose, pose_from_pose2, twist_from_planar
from twin.bridge.msgs import (
    BatteryState,
    Empty,
    GoalStatus,
    LaserScan,
    Point,
    PoseArray,
    PoseStamped,
    Twist,
    duration,
    header,
    new,
)
from twin.bridge.qos import SENSOR_DATA
from twin.bridge.srvs import SetBool
from twin.bridge.types import ActionType
from twin.geometry import Pose2, wrap_angle
from twin.navigation.costmaps.layered_costmap import CostmapConfig
from twin.navigation.docking.docks import Dock as DockEntry
from twin.navigation.docking.docks import DockDatabase, DockType
from twin.navigation.recovery import BehaviorConfig
from twin.nodes.messages import pose_stamped
from twin.nodes.navigation.behavior_server import BehaviorServerNode
from twin.nodes.navigation.costmap import CostmapNode, CostmapNodeConfig
from twin.nodes.navigation.docking_server import DockingServerConfig, DockingServerNode
from twin.nodes.tote_detector import ToteDetectorNode

FOOTPRINT = ((0.15, 0.15), (-0.15, 0.15), (-0.15, -0.15), (0.15, -0.15))
LONG = duration(30_000_000_000)


class Behaviors:
    def __init__(self, bench: Bench) -> None:
        self.bench = bench
        self.robot = Robot(bench, open_room())
        rolling = CostmapConfig(footprint=FOOTPRINT, rolling_window=True)
        config = CostmapNodeConfig(name="local_costmap", frame="odom", layers=rolling)
        costmap = CostmapNode(bench.bus, self.robot.pose_lookup, config)
        behavior = BehaviorConfig(footprint=FOOTPRINT)
        BehaviorServerNode(bench.bus, self.robot.pose_lookup, behavior, costmap=costmap)
        bench.run(0.5)

    def send(self, action: ActionType, name: str, **fields: Any) -> Any:
        return ActionClient(self.bench.node, action, name).send_goal(new(action.Goal, **fields))

    def do(self, action: ActionType, name: str, **fields: Any) -> Any:
        goal = self.send(action, name, **fields)
        self.bench.until(lambda: goal.done)
        self.bench.run(0.3)
        return goal


@pytest.fixture
def behaviors(bench: Bench) -> Behaviors:
    return Behaviors(bench)


@pytest.mark.parametrize("angle", [math.pi / 2, -math.pi / 2, 1.5 * math.pi])
def test_spin_turns_by_the_angle_on_the_spot(behaviors: Behaviors, angle: float) -> None:
    goal = behaviors.do(Spin, "spin", target_yaw=angle, time_allowance=LONG)
    assert goal.succeeded
    pose = behaviors.robot.pose
    assert abs(wrap_angle(pose.yaw - angle)) < 0.05
    assert math.hypot(pose.x, pose.y) < 1e-6
    turned = np.array([w for _, w in behaviors.robot.commands]).sum() * TICK_NS * 1e-9
    assert turned == pytest.approx(angle, abs=0.1), "the way round that was asked for, all of it"


def test_drive_on_heading_and_backup_are_straight(behaviors: Behaviors) -> None:
    ahead = Point(x=0.5, y=0.0, z=0.0)
    goal = behaviors.do(DriveOnHeading, "drive_on_heading", target=ahead, speed=0.2, time_allowance=LONG)
    assert goal.succeeded
    assert behaviors.robot.pose == pytest.approx((0.5, 0.0, 0.0), abs=0.02)
    back = Point(x=0.3, y=0.0, z=0.0)
    assert behaviors.do(BackUp, "backup", target=back, speed=0.1, time_allowance=LONG).succeeded
    assert behaviors.robot.pose == pytest.approx((0.2, 0.0, 0.0), abs=0.02)
    assert min(v for v, _ in behaviors.robot.commands) == pytest.approx(-0.1)
    assert max(v for v, _ in behaviors.robot.commands) == pytest.approx(0.2)


def test_driving_into_a_wall_is_refused_before_it(behaviors: Behaviors) -> None:
    behaviors.robot.room.add_box(0.8, -1.0, 1.0, 1.0)
    behaviors.bench.run(0.5)
    ahead = Point(x=2.0, y=0.0, z=0.0)
    goal = behaviors.do(DriveOnHeading, "drive_on_heading", target=ahead, speed=0.2, time_allowance=LONG)
    assert goal.status == GoalStatus.STATUS_ABORTED
    assert (goal.result.error_code, goal.result.error_msg) == (723, "drive_on_heading: collision ahead")
    assert behaviors.robot.pose.x < 0.8 - 0.15
    assert behaviors.robot.commands[-1] == (0.0, 0.0)


def test_a_behavior_that_takes_too_long_is_aborted(behaviors: Behaviors) -> None:
    behaviors.robot.stuck = True
    goal = behaviors.do(Spin, "spin", target_yaw=1.0, time_allowance=duration(1_000_000_000))
    assert (goal.result.error_code, goal.result.error_msg) == (701, "spin: timeout")


def test_wait_waits_without_driving(behaviors: Behaviors) -> None:
    began = behaviors.bench.now_s
    goal = behaviors.send(Wait, "wait", time=duration(2_000_000_000))
    behaviors.bench.until(lambda: goal.done)
    assert goal.succeeded
    assert behaviors.bench.now_s - began == pytest.approx(2.0, abs=0.1)
    assert set(behaviors.robot.commands) <= {(0.0, 0.0)}


def test_a_cancelled_behavior_stops_the_robot(behaviors: Behaviors) -> None:
    goal = behaviors.send(Spin, "spin", target_yaw=3.0, time_allowance=LONG)
    behaviors.bench.run(1.0)
    assert behaviors.robot.joints.velocity.any()
    goal.cancel()
    behaviors.bench.until(lambda: goal.done, 0.2)
    assert goal.status == GoalStatus.STATUS_CANCELED
    behaviors.bench.run(0.3)
    assert not behaviors.robot.joints.velocity.any()


def test_feedback_tells_how_far_it_is(behaviors: Behaviors) -> None:
    told: list[Any] = []
    client = ActionClient(behaviors.bench.node, DriveOnHeading, "drive_on_heading")
    target = Point(x=0.5, y=0.0, z=0.0)
    goal = client.send_goal(
        new(DriveOnHeading.Goal, target=target, speed=0.2, time_allowance=LONG), told.append
    )
    behaviors.bench.until(lambda: goal.done)
    driven = [message.distance_traveled for message in told]
    assert driven == sorted(driven)
    assert driven[0] == 0.0
    assert driven[-1] == pytest.approx(0.5, abs=0.02)
    assert goal.result.total_elapsed_time.sec >= 2


@pytest.mark.parametrize(
    ("action", "name", "x", "y", "speed", "code"),
    [
        (BackUp, "backup", 0.3, 0.1, 0.1, 713),
        (DriveOnHeading, "drive_on_heading", 0.3, 0.1, 0.1, 724),
        (DriveOnHeading, "drive_on_heading", 0.3, 0.0, -0.1, 724),
    ],
)
def test_a_goal_that_makes_no_sense_is_aborted(
    behaviors: Behaviors, action: ActionType, name: str, x: float, y: float, speed: float, code: int
) -> None:
    goal = behaviors.do(action, name, target=Point(x=x, y=y, z=0.0), speed=speed, time_allowance=LONG)
    assert (goal.result.error_code, goal.result.error_msg) == (code, f"{name}: invalid input")


# assisted teleop


def test_assisted_teleop_does_what_is_steered_but_never_hits(behaviors: Behaviors) -> None:
    bench, robot = behaviors.bench, behaviors.robot
    robot.room.add_box(1.0, -1.0, 1.2, 1.0)
    steer = bench.node.create_publisher(Twist, "cmd_vel_assisted_teleop", 10)
    goal = behaviors.send(AssistedTeleop, "assisted_teleop", time_allowance=LONG)
    bench.run(0.5)
    steer.publish(twist_from_planar(0.3, 0.0))
    bench.run(0.3)
    assert robot.commands[-1] == (0.3, 0.0), "far away from everything it does as it is told"
    bench.run(8.0)
    assert robot.pose.x < 1.0 - 0.15, "the wall is not touched"
    assert robot.pose.x > 0.6
    assert robot.commands[-1] == (0.0, 0.0)
    steer.publish(twist_from_planar(-0.3, 0.0))
    bench.run(1.0)
    assert robot.commands[-1] == (-0.3, 0.0), "away from the wall it may"
    bench.node.create_publisher(Empty, "preempt_teleop", 10).publish(Empty())
    bench.until(lambda: goal.done, 0.5)
    assert goal.succeeded
    bench.run(0.2)
    assert robot.commands[-1] == (0.0, 0.0)


def test_assisted_teleop_ends_when_its_time_is_over(behaviors: Behaviors) -> None:
    goal = behaviors.do(AssistedTeleop, "assisted_teleop", time_allowance=duration(1_000_000_000))
    assert (goal.result.error_code, goal.result.error_msg) == (731, "assisted_teleop: timeout")


@pytest.mark.parametrize(
    ("action", "name", "fields"),
    [
        (Spin, "spin", {"target_yaw": math.nan}),
        (BackUp, "backup", {"target": Point(x=math.inf, y=0.0, z=0.0), "speed": 0.1}),
        (DriveOnHeading, "drive_on_heading", {"target": Point(x=1.0, y=0.0, z=0.0), "speed": math.nan}),
    ],
)
def test_a_goal_that_is_not_finite_is_rejected(
    behaviors: Behaviors, action: ActionType, name: str, fields: dict[str, Any]
) -> None:
    goal = behaviors.do(action, name, **fields)
    assert goal.accepted is False
    assert not behaviors.robot.commands


# docking_server


class Dock:
    """A shelf's face 2 m ahead, and if `tote` a tote 0.05 m behind it that the tote detector would report."""

    FACE = Pose2(2.0, 0.0, 0.0)

    def __init__(
        self, bench: Bench, *, start: Pose2, shelf: bool = True, config: DockingServerConfig | None = None
    ) -> None:
        self.bench = bench
        room = Room(box(-4.0, -4.0, 4.0, 4.0))
        if shelf:
            room.add_box(2.0, -1.5, 2.6, 1.5)
        self.robot = Robot(bench, room, cmd_vel="cmd_vel_docking", start=start)
        DockingServerNode(bench.bus, self.robot.pose_lookup, config)
        self.told: list[Any] = []
        self.dock_client = ActionClient(bench.node, DockRobot, "dock_robot")
        self.undock_client = ActionClient(bench.node, UndockRobot, "undock_robot")
        self._totes = bench.node.create_publisher(PoseArray, "tote_poses", 1)
        bench.run(0.5)

    def send(self, kind: str = "table", believed: Pose2 | None = None, **fields: Any) -> Any:
        docked = (believed or self.FACE) @ Pose2(-0.55, 0.0, 0.0)
        wanted = {"use_dock_id": False, "navigate_to_staging_pose": False, "dock_type": kind} | fields
        return self.dock_client.send_goal(
            new(DockRobot.Goal, dock_pose=pose_stamped(docked, "map", 0), **wanted), self.told.append
        )

    def dock(self, kind: str = "table", believed: Pose2 | None = None) -> Any:
        goal = self.send(kind, believed)
        self.bench.until(lambda: goal.done, 120.0)
        self.bench.run(0.5)
        return goal

    def show_totes(self, *ys: float, first: float | None = None) -> None:
        """Report, at every tick, totes at lateral positions `ys` of the face; at first one at `first`."""
        once = [] if first is None else [first]

        def report() -> None:
            shown = [once.pop()] if once else ys
            in_base = [self.robot.pose.inverse() @ Pose2(2.05, y, 0.0) for y in shown]
            in_base.sort(key=lambda pose: abs(pose.y))
            poses = [pose_from_pose2(pose) for pose in in_base]
            stamp = header(self.bench.clock.now_ns - TICK_NS, "base_footprint")
            self._totes.publish(PoseArray(header=stamp, poses=poses))

        self.bench.each_tick.append(report)

    def undock(self) -> float:
        """Undock; return how far the robot drove back."""
        before = self.robot.pose
        goal = self.undock_client.send_goal(new(UndockRobot.Goal, dock_type="table"))
        self.bench.until(lambda: goal.done)
        assert goal.result.success
        self.bench.run(0.5)
        return before.distance(self.robot.pose)


def test_docking_corrects_a_wrong_belief_by_the_scan(bench: Bench) -> None:
    dock = Dock(bench, start=Pose2(0.7, 0.03, 0.05))
    goal = dock.dock(believed=Pose2(2.08, 0.0, 0.06))
    assert goal.result.success
    pose = dock.robot.pose
    assert pose.x == pytest.approx(2.0 - 0.55, abs=0.015), "the distance is the scan's, not the map's"
    assert abs(pose.yaw) < math.radians(2.0), "and so is the heading"
    assert not dock.robot.joints.velocity.any()


def test_docking_at_a_tote_lines_up_with_it(bench: Bench) -> None:
    dock = Dock(bench, start=Pose2(0.7, 0.0, 0.0))
    dock.show_totes(0.06)
    assert dock.dock("tote").result.success
    assert dock.robot.pose.y == pytest.approx(0.06, abs=0.015)
    assert dock.robot.pose.x == pytest.approx(1.45, abs=0.015)


def test_a_wrong_first_sight_of_the_tote_is_corrected_on_the_way(bench: Bench) -> None:
    dock = Dock(bench, start=Pose2(0.7, 0.0, 0.0))
    goal = dock.send("tote")
    bench.run(0.1)
    dock.show_totes(0.0, first=0.12)
    bench.until(lambda: goal.done, 60.0)
    assert goal.result.success
    assert dock.robot.pose.y == pytest.approx(0.0, abs=0.015)


def test_a_tote_of_the_neighbouring_slot_is_not_the_one(bench: Bench) -> None:
    dock = Dock(bench, start=Pose2(0.7, 0.0, 0.0))
    dock.show_totes(0.5)
    goal = dock.dock("tote")
    assert (goal.result.success, goal.result.error_code) == (False, 904)
    assert goal.result.error_msg == "no tote in sight"


@pytest.mark.parametrize("yaw", [0.0, 0.3, -0.3])
def test_of_two_totes_that_of_the_slot_counts_however_the_robot_is_turned(bench: Bench, yaw: float) -> None:
    dock = Dock(bench, start=Pose2(0.7, 0.08, yaw))
    dock.show_totes(-0.5, 0.02, 0.5)
    assert dock.dock("tote").result.success
    assert dock.robot.pose.y == pytest.approx(0.02, abs=0.01)
    assert abs(dock.robot.pose.yaw) < math.radians(1.0)


def test_a_dock_that_was_missed_is_approached_again_from_the_staging_distance(bench: Bench) -> None:
    """At the end the tote turns out to stand further aside: there is no way left to correct that."""
    dock = Dock(bench, start=Pose2(0.7, 0.0, 0.0))
    dock.show_totes(0.0)
    goal = dock.send("tote")
    bench.until(lambda: dock.robot.pose.x > 1.4, 60.0)
    bench.each_tick.pop()
    dock.show_totes(0.06)
    furthest_back = []
    bench.each_tick.append(lambda: furthest_back.append(dock.robot.pose.x))
    bench.until(lambda: goal.done, 60.0)
    assert (goal.result.success, goal.result.num_retries) == (True, 1)
    assert min(furthest_back) == pytest.approx(0.7, abs=0.03)
    assert dock.robot.pose.y == pytest.approx(0.06, abs=0.01)


def test_a_dock_that_is_not_there_is_not_docked_at(bench: Bench) -> None:
    dock = Dock(bench, start=Pose2(0.7, 0.0, 0.0), shelf=False)
    goal = dock.dock()
    assert goal.status == GoalStatus.STATUS_ABORTED
    assert (goal.result.error_code, goal.result.error_msg) == (904, "no face of the dock in sight")
    assert dock.robot.pose.x == pytest.approx(0.7)


def test_undocking_backs_off_straight_to_where_staging_is(bench: Bench) -> None:
    dock = Dock(bench, start=Pose2(1.45, 0.0, 0.0))
    assert dock.undock() == pytest.approx(0.75, abs=0.02)
    assert dock.robot.pose == pytest.approx((0.7, 0.0, 0.0), abs=0.02)
    assert max(v for v, _ in dock.robot.commands) <= 0.0
    assert not any(w for _, w in dock.robot.commands)


def test_undocking_after_no_docking_does_not_back_into_what_is_behind(bench: Bench) -> None:
    """No tote was in sight: the robot stands where it was staged and has no way to go back."""
    dock = Dock(bench, start=Pose2(0.72, 0.0, 0.0))
    assert not dock.dock("tote").result.success
    assert dock.undock() == pytest.approx(0.02, abs=0.02)


def test_a_cancelled_docking_stops(bench: Bench) -> None:
    dock = Dock(bench, start=Pose2(0.5, 0.0, 0.0))
    goal = dock.send()
    bench.run(1.5)
    assert dock.robot.joints.velocity.any()
    goal.cancel()
    bench.until(lambda: goal.done, 1.0)
    assert goal.status == GoalStatus.STATUS_CANCELED
    bench.run(0.5)
    assert not dock.robot.joints.velocity.any()


# the database of docks, staging, chargers


CHARGER = DockType(is_charger=True, face_width=0.6)


class Charger(Dock):
    """A charger, 0.6 m wide, whose middle is 0.05 m aside of where the database has it."""

    def __init__(
        self, bench: Bench, type_: DockType = CHARGER, *, x: float = 0.7, accept: bool = True
    ) -> None:
        docks = {"home": dock_entry("charger"), "odd": dock_entry("no_such_type")}
        database = DockDatabase(types={"charger": type_}, docks=docks)
        config = DockingServerConfig(database=database, max_retries=1)
        super().__init__(bench, start=Pose2(x, 0.0, 0.0), shelf=False, config=config)
        self.robot.room.add_box(2.0, -0.25, 2.3, 0.35)
        self.staged: list[Pose2] = []
        self.accept, self.arrives = accept, True
        ActionServer(bench.node, NavigateToPose, "navigate_to_pose", self._navigate)
        self.battery = bench.node.create_publisher(BatteryState, "battery_state", 1)
        self.detector = bench.node.create_publisher(PoseStamped, "detected_dock_pose", 1)
        bench.run(0.5)

    def _navigate(self, handle: GoalHandle) -> Generator[None, None, Any]:
        self.staged.append(pose2_from_pose(handle.request.pose.pose))
        while not self.arrives:
            if handle.is_cancel_requested:
                handle.canceled()
                self.staged.append(Pose2(0.0, 0.0, 0.0))
                return new(NavigateToPose.Result)
            yield
        if self.accept:
            self.robot.start = self.staged[-1] @ self.robot.drive.odometry.pose.inverse()
            return new(NavigateToPose.Result)
        handle.abort()
        return new(NavigateToPose.Result, error_code=208, error_msg="no way")

    def dock_by_id(self, name: str = "home", **fields: Any) -> Any:
        goal = self.dock_client.send_goal(
            new(DockRobot.Goal, use_dock_id=True, dock_id=name, **fields), self.told.append
        )
        self.bench.until(lambda: goal.done, 120.0)
        self.bench.run(0.3)
        return goal


def dock_entry(type_: str) -> DockEntry:
    return DockEntry(type=type_, pose=Pose2(1.45, 0.0, 0.0))


def test_a_dock_of_the_database_is_staged_docked_at_and_left(bench: Bench) -> None:
    charger = Charger(bench, x=-1.0)
    goal = charger.dock_by_id()
    assert goal.result.success, goal.result.error_msg
    assert charger.staged == [pytest.approx((0.7, 0.0, 0.0))]
    assert charger.robot.pose == pytest.approx((1.45, 0.05, 0.0), abs=0.015), "its middle is the scan's"
    states = [message.state for message in charger.told]
    assert sorted(set(states), key=states.index) == [1, 2, 3]
    undocked = charger.undock_client.send_goal(new(UndockRobot.Goal))
    bench.until(lambda: undocked.done)
    assert undocked.succeeded, "of what type it is, the server knows"
    assert charger.robot.pose.x == pytest.approx(0.7, abs=0.02)


def test_near_the_staging_pose_nothing_is_navigated(bench: Bench) -> None:
    charger = Charger(bench, x=0.65)
    assert charger.dock_by_id().result.success
    assert charger.staged == []


@pytest.mark.parametrize(
    ("name", "code", "reason"),
    [("hom", 901, "did you mean 'home'"), ("odd", 902, "there is no dock type 'no_such_type'")],
)
def test_a_dock_that_is_unknown_is_not_looked_for(bench: Bench, name: str, code: int, reason: str) -> None:
    goal = Charger(bench).dock_by_id(name)
    assert goal.status == GoalStatus.STATUS_ABORTED
    assert goal.result.error_code == code
    assert reason in goal.result.error_msg


def test_a_staging_pose_that_cannot_be_reached_ends_it(bench: Bench) -> None:
    charger = Charger(bench, x=-1.0, accept=False)
    goal = charger.dock_by_id()
    assert (goal.result.error_code, goal.result.error_msg) == (
        903,
        "cannot drive to the staging pose: no way",
    )


def test_staging_has_its_time(bench: Bench) -> None:
    charger = Charger(bench, x=-1.0)
    charger.arrives = False
    goal = charger.dock_by_id(max_staging_time=1.0)
    assert (goal.result.error_code, goal.result.error_msg) == (903, "not at the staging pose after 1 s")
    assert len(charger.staged) == 2, "the navigation was cancelled"


def test_a_charger_that_does_not_charge_is_tried_again_and_given_up(bench: Bench) -> None:
    charger = Charger(bench, replace(CHARGER, use_battery_status=True))
    goal = charger.dock_by_id()
    assert (goal.result.error_code, goal.result.num_retries) == (906, 1)
    assert {message.state for message in charger.told} == {2, 3, 4, 5}


def test_a_battery_that_is_charged_tells_that_it_docked(bench: Bench) -> None:
    charger = Charger(bench, replace(CHARGER, use_battery_status=True))
    bench.each_tick.append(lambda: charger.battery.publish(new(BatteryState, current=2.0)))
    assert charger.dock_by_id().result.success


@pytest.mark.parametrize("lost", [False, True])
def test_a_detector_of_somebody_else_tells_where_the_dock_is(bench: Bench, lost: bool) -> None:
    charger = Charger(bench, DockType(use_external_detection_pose=True))
    at = Pose2(2.0, 0.03, 0.0)

    def detect() -> None:
        if not (lost and charger.robot.pose.x > 1.0):
            charger.detector.publish(pose_stamped(at, "map", bench.clock.now_ns - TICK_NS))

    bench.each_tick.append(detect)
    goal = charger.dock_by_id()
    assert goal.result.success is not lost
    if lost:
        assert (goal.result.error_code, goal.result.num_retries) == (904, 1)
    else:
        assert charger.robot.pose == pytest.approx((1.45, 0.03, 0.0), abs=0.015)


# tote_detector


class Palm:
    """Palm scans of what stands before a robot at the origin; the lidar frame serves as the palm's."""

    def __init__(self, bench: Bench) -> None:
        self.bench = bench
        self.robot = Robot(bench, Room(box(-9, -9, 9, 9)))
        self.seen = bench.listen(PoseArray, "tote_poses")
        ToteDetectorNode(bench.bus, self.robot.pose_lookup)
        self._publisher = bench.node.create_publisher(LaserScan, "palm_scan", SENSOR_DATA)
        self.angles = np.radians(np.arange(-45.0, 45.25, 0.5))
        bench.run(0.2)
        self.enable(True)

    def enable(self, on: bool) -> None:
        assert self.bench.call(SetBool, "tote_detector/enable", SetBool.Request(data=on)).success

    def look(self, segments: np.ndarray, noise: float = 0.0) -> list[Pose2]:
        """Scan and return the totes that were detected."""
        del self.seen[:]
        room = Room(segments, angles=self.angles, max_range=4.0)
        ranges = room.ranges(self.robot.T_base_lidar)
        ranges += (
            np.random.Generator(np.random.Philox(key=1)).normal(0.0, noise, len(ranges)) if noise else 0.0
        )
        stamp = self.bench.clock.now_ns - TICK_NS
        self._publisher.publish(scan(ranges, self.angles, stamp, max_range=4.0))
        self.bench.run(0.1)
        assert all(message.header.frame_id == "base_footprint" for message in self.seen)
        return [pose2_from_pose(pose) for message in self.seen for pose in message.poses]


@pytest.fixture
def palm(bench: Bench) -> Palm:
    return Palm(bench)


def tote(pose: Pose2, width: float = 0.24, depth: float = 0.3) -> np.ndarray:
    """A box whose front face's centre is at `pose`, x into it."""
    segments = box(0.0, -width / 2, depth, width / 2)
    return pose.apply(segments.reshape(-1, 2)).reshape(-1, 2, 2)


@pytest.mark.parametrize("pose", [Pose2(0.7, 0.0, 0.0), Pose2(0.8, 0.1, 0.15), Pose2(0.6, -0.08, -0.2)])
def test_a_tote_is_found_where_it_stands(palm: Palm, pose: Pose2) -> None:
    (found,) = palm.look(tote(pose), noise=0.003)
    assert found.distance(pose) < 0.015
    assert abs(wrap_angle(found.yaw - pose.yaw)) < 0.06


@pytest.mark.parametrize(
    "segments",
    [
        tote(Pose2(0.7, 0.0, 0.0), width=0.40),
        tote(Pose2(0.7, 0.0, 0.0), width=0.12),
        tote(Pose2(1.9, 0.0, 0.0)),
        box(-9.0, -9.0, 9.0, 9.0),
    ],
    ids=["too wide", "too narrow", "too far", "nothing"],
)
def test_other_things_are_no_tote(palm: Palm, segments: np.ndarray) -> None:
    assert palm.look(segments) == []


def test_it_looks_only_while_it_is_asked_to(palm: Palm) -> None:
    palm.enable(False)
    assert palm.look(tote(Pose2(0.7, 0.0, 0.0))) == []
    palm.enable(True)
    assert len(palm.look(tote(Pose2(0.7, 0.0, 0.0)))) == 1


def test_of_two_totes_the_one_straight_ahead_comes_first(palm: Palm) -> None:
    both = np.concatenate([tote(Pose2(0.8, 0.35, 0.0)), tote(Pose2(0.8, 0.02, 0.0))])
    assert [pose.y for pose in palm.look(both)] == pytest.approx([0.02, 0.35], abs=0.015)
