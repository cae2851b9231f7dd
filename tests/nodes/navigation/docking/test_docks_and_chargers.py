"""docking_server with a database of docks: staging, chargers, detectors of others."""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.nodes.conftest import TICK_NS, Bench
from tests.nodes.navigation.docking.dock import Dock
from twin.bridge.action_types import (
    DockRobot,
    NavigateToPose,
    UndockRobot,
)
from twin.bridge.actions import ActionServer, GoalHandle
from twin.bridge.conversions import pose2_from_pose, pose_from_pose3
from twin.bridge.msgs import (
    BatteryState,
    GoalStatus,
    PoseStamped,
    header,
    new,
)
from twin.geometry import Pose2, Pose3
from twin.navigation.docking.docks import Dock as DockEntry
from twin.navigation.docking.docks import DockDatabase, DockType
from twin.nodes.messages import pose_stamped
from twin.nodes.navigation.docking.config import DockingServerConfig
from twin.sim.looks.tags import T_TAG_PRINT

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
    into_the_dock = {"external_detection_rotation_pitch": 0.0, "external_detection_rotation_roll": 0.0}
    charger = Charger(bench, DockType(use_external_detection_pose=True, **into_the_dock))
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


def test_the_tag_of_a_dock_is_stood_before_as_nav2_has_it(bench: Bench) -> None:
    charger = Charger(bench, DockType(use_external_detection_pose=True))
    # x to the right of the print, y up, z out of the dock, as apriltag_ros has the frame of a tag
    face = Pose3.from_xyz_rpy((2.0, 0.03, 0.4), (0.0, 0.0, math.pi)) @ T_TAG_PRINT
    noise = np.random.default_rng(3)

    def detect() -> None:
        wrong = Pose3.from_xyz_rpy(noise.normal(0.0, 0.02, 3), (0.0, 0.0, 0.0))
        stamp = header(bench.clock.now_ns - TICK_NS, "map")
        charger.detector.publish(PoseStamped(header=stamp, pose=pose_from_pose3(wrong @ face)))

    bench.each_tick.append(detect)
    assert charger.dock_by_id().result.success
    assert charger.robot.pose == pytest.approx((1.45, 0.03, 0.0), abs=0.02), "noise is filtered"
