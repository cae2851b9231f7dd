"""The navigator with all its servers in a small room: from a goal to the place, or to the reason why not."""

from __future__ import annotations

import math
from collections.abc import Generator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.nodes.conftest import ORIGIN, Bench, Robot, map_of_room, open_room
from twin.bridge.action_types import ComputePathThroughPoses, NavigateThroughPoses, NavigateToPose
from twin.bridge.actions import ActionClient, ActionServer, GoalHandle
from twin.bridge.conversions import pose2_from_pose
from twin.bridge.msgs import BehaviorTreeLog, GoalStatus, PoseStamped, new
from twin.bridge.srvs import Toggle
from twin.errors import NavigationError
from twin.geometry import Pose2
from twin.navigation.control.goal_checker import GoalCheckerConfig
from twin.navigation.control.regulated_pure_pursuit.config import RegulatedPurePursuitConfig
from twin.navigation.costmaps.layered_costmap import CostmapConfig
from twin.navigation.planning.config import PlannerConfig
from twin.navigation.recovery import BehaviorConfig
from twin.nodes.messages import path_msg, pose_stamped
from twin.nodes.navigation.behavior_server import BehaviorServerNode
from twin.nodes.navigation.bt_navigator import BtNavigatorNode
from twin.nodes.navigation.bt_navigator_config import BtNavigatorConfig
from twin.nodes.navigation.controller_server.config import ControllerServerConfig
from twin.nodes.navigation.controller_server.server import ControllerServerNode
from twin.nodes.navigation.costmaps.config import CostmapNodeConfig
from twin.nodes.navigation.costmaps.costmap import CostmapNode
from twin.nodes.navigation.mapping.map_server import MapServerNode
from twin.nodes.navigation.planning.planner_server import PlannerServerNode

HALF = 0.15
FOOTPRINT = ((HALF, HALF), (-HALF, HALF), (-HALF, -HALF), (HALF, -HALF))


class Stack:
    """A robot with everything that navigates it."""

    def __init__(self, bench: Bench, config: BtNavigatorConfig | None = None, start: Pose2 = ORIGIN) -> None:
        bus = bench.bus
        self.bench, self.room = bench, open_room()
        self.robot = Robot(bench, self.room, start=start)
        pose = self.robot.pose_lookup
        MapServerNode(bus, map_of_room())
        layers = CostmapConfig(footprint=FOOTPRINT, inflation_radius=0.4)
        costmap = CostmapNode(bus, pose, CostmapNodeConfig(name="global_costmap", frame="map", layers=layers))
        rolling = CostmapConfig(footprint=FOOTPRINT, inflation_radius=0.4, rolling_window=True)
        local = CostmapNode(bus, pose, CostmapNodeConfig(name="local_costmap", frame="odom", layers=rolling))
        PlannerServerNode(bus, pose, costmap, config=PlannerConfig(tolerance=0.1, allow_unknown=False))
        ControllerServerNode(
            bus,
            pose,
            local,
            np.array(FOOTPRINT),
            ControllerServerConfig(
                controllers={"FollowPath": RegulatedPurePursuitConfig(xy_goal_tolerance=0.05)},
                goal_checkers={
                    "general_goal_checker": GoalCheckerConfig(xy_goal_tolerance=0.05, yaw_goal_tolerance=0.1)
                },
            ),
        )
        BehaviorServerNode(bus, pose, BehaviorConfig(footprint=FOOTPRINT), costmap=local)
        self.navigator = BtNavigatorNode(bus, pose, config)
        self.to_pose = ActionClient(bench.node, NavigateToPose, "navigate_to_pose")
        self.through = ActionClient(bench.node, NavigateThroughPoses, "navigate_through_poses")
        self.feedback: list[Any] = []
        bench.run(1.0)

    def go(self, x: float, y: float, yaw: float = 0.0, tree: str = "", frame: str = "map") -> Any:
        goal = pose_stamped(Pose2(x, y, yaw), frame, self.bench.clock.now_ns)
        message = new(NavigateToPose.Goal, pose=goal, behavior_tree=tree)
        return self.to_pose.send_goal(message, self.feedback.append)

    def until_done(self, sent: Any, seconds: float = 60.0) -> Any:
        self.bench.until(lambda: sent.done, seconds)
        return sent.result

    @property
    def speed(self) -> float:
        return abs(self.robot.commands[-1][0]) + abs(self.robot.commands[-1][1])


@pytest.fixture
def stack(bench: Bench) -> Stack:
    return Stack(bench)


def test_it_drives_to_the_goal_and_says_how_far_it_is(stack: Stack) -> None:
    sent = stack.go(1.0, 0.5, math.pi / 2)
    result = stack.until_done(sent)
    assert sent.succeeded
    assert (result.error_code, result.error_msg) == (0, "")
    assert stack.robot.pose.distance(Pose2(1.0, 0.5, 0.0)) < 0.06
    assert stack.navigator.recoveries == 0
    left = [message.distance_remaining for message in stack.feedback]
    assert max(left) == pytest.approx(math.hypot(1.0, 0.5), abs=0.15)
    assert left[-1] < 0.1
    driving = [m for m in stack.feedback if m.estimated_time_remaining.sec > 0]
    assert driving, "an estimate of the time while it drives"
    assert stack.feedback[-1].navigation_time.sec >= 1
    assert stack.feedback[-1].number_of_recoveries == 0


def test_a_goal_from_rviz_and_a_goal_in_another_frame(bench: Bench, stack: Stack) -> None:
    rviz = bench.node.create_publisher(PoseStamped, "goal_pose", 10)
    bench.run(0.1)
    rviz.publish(pose_stamped(Pose2(0.6, 0.0, 0.0), "map", 0))
    bench.until(lambda: stack.robot.pose.x > 0.55, 20.0)
    bench.run(3.0)
    sent = stack.go(0.5, 0.0, 0.0, frame="base_footprint")
    stack.until_done(sent)
    assert sent.succeeded
    assert stack.robot.pose.x == pytest.approx(1.1, abs=0.1)


# What cannot be reached: the reason is in the result, and the robot stays or stops

BAD_GOALS = [
    (
        Pose2(1.75, 1.25, 0.0),
        "map",
        206,
        "nothing is free within 0.1 m of the goal (1.75, 1.25)",
    ),  # in a pillar
    (Pose2(50.0, 0.0, 0.0), "map", 204, "(50.00, 0.00) is outside the costmap"),
    (Pose2(-3.3, 0.0, 0.0), "map", 206, "nothing is free"),  # unknown
    (Pose2(math.nan, 0.0, 0.0), "map", 204, "is not finite"),
    (Pose2(1.0, 0.0, 0.0), "moon", 9002, "the goal's frame 'moon' is not connected to the map's"),
]


@pytest.mark.parametrize(("goal", "frame", "code", "reason"), BAD_GOALS)
def test_a_goal_that_no_recovery_helps_is_aborted_at_once(
    bench: Bench, goal: Pose2, frame: str, code: int, reason: str
) -> None:
    stack = Stack(bench)
    sent = stack.go(*goal, frame=frame)
    result = stack.until_done(sent, 3.0)
    assert sent.status == GoalStatus.STATUS_ABORTED
    assert result.error_code == code
    assert reason in result.error_msg
    assert stack.navigator.recoveries == 0
    assert stack.robot.pose == ORIGIN


def test_a_start_in_collision_is_aborted_with_its_reason(bench: Bench) -> None:
    stack = Stack(bench, start=Pose2(1.75, 1.25, 0.0))
    result = stack.until_done(stack.go(0.0, 0.0), 3.0)
    assert result.error_code == 205
    assert "the start (1.75, 1.25) is inside an obstacle" in result.error_msg


def test_a_robot_that_is_not_localised_is_not_sent_anywhere(bench: Bench) -> None:
    stack = Stack.__new__(Stack)
    robot_localised = Robot.__init__

    def lost(self: Robot, *args: Any, **given: Any) -> None:
        robot_localised(self, *args, **given)
        self.localised = False

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Robot, "__init__", lost)
        stack.__init__(bench)  # type: ignore[misc]
    result = stack.until_done(stack.go(1.0, 0.0), 3.0)
    assert (result.error_code, result.error_msg) == (9002, "the robot is not localised")


def test_a_walled_in_goal_ends_after_all_recoveries(bench: Bench) -> None:
    stack = Stack(bench)
    stack.room.add_box(-1.5, -2.0, -1.4, 2.0)  # a wall across the room that is on no map
    bench.run(1.0)
    before = bench.clock.now_ns
    result = stack.until_done(stack.go(-2.3, 0.0), 120.0)
    assert result.error_code == 208
    assert "no path from" in result.error_msg
    assert stack.navigator.recoveries == 6, "clear, back up, spin, wait, clear, back up"
    assert stack.feedback[-1].number_of_recoveries > 6, "Nav2 counts every costmap cleared"
    assert bench.clock.now_ns - before > 5e9, "it has waited once"


# Pre-emption and cancel


def test_a_new_goal_takes_over_without_a_stop(bench: Bench, stack: Stack) -> None:
    first = stack.go(2.4, 0.0)
    bench.until(lambda: stack.robot.pose.x > 0.5, 20.0)
    slow = len(stack.robot.commands)
    second = stack.go(2.6, -0.25)
    bench.until(lambda: first.done, 1.0)
    assert first.status == GoalStatus.STATUS_ABORTED
    assert first.result.error_msg == "preempted by another goal"
    bench.run(1.5)
    assert min(v for v, _ in stack.robot.commands[slow:]) > 0.1, "it never stood still"
    stack.until_done(second)
    assert second.succeeded
    assert stack.robot.pose.distance(Pose2(2.6, -0.25, 0.0)) < 0.06


def test_a_goal_that_takes_over_on_the_last_step_is_not_called_reached(bench: Bench, stack: Stack) -> None:
    """Nav2's trees plan once a second; the old goal may be reached before the new one is planned."""
    stack.go(0.8, 0.0)
    bench.until(lambda: stack.robot.pose.x > 0.74, 20.0)
    second = stack.go(-0.8, 0.0)
    stack.until_done(second)
    assert second.succeeded
    assert stack.robot.pose.distance(Pose2(-0.8, 0.0, 0.0)) < 0.06


def test_another_tree_cannot_take_over(bench: Bench, stack: Stack, tmp_path: Path) -> None:
    other = tmp_path / "other.xml"
    other.write_text(
        '<root BTCPP_format="4"><BehaviorTree ID="A"><Wait wait_duration="1"/></BehaviorTree></root>'
    )
    first = stack.go(2.0, 0.0)
    bench.run(1.0)
    result = stack.until_done(stack.go(1.0, 0.0, tree=str(other)), 1.0)
    assert result.error_code == 9000
    assert "cancel its goal for another tree" in result.error_msg
    stack.until_done(first)
    assert first.succeeded, "the first goal goes on"


def test_a_cancel_stops_the_robot(bench: Bench, stack: Stack) -> None:
    sent = stack.go(2.4, 0.0)
    bench.until(lambda: stack.robot.pose.x > 0.5, 20.0)
    sent.cancel()
    bench.until(lambda: sent.done, 0.3)
    assert sent.status == GoalStatus.STATUS_CANCELED
    bench.run(0.5)
    assert stack.speed == 0.0
    again = stack.go(0.0, 0.0)
    stack.until_done(again)
    assert again.succeeded


# Trees


def tree(tmp_path: Path, inside: str) -> str:
    file = tmp_path / "mine.xml"
    file.write_text(f'<root BTCPP_format="4"><BehaviorTree ID="Mine">{inside}</BehaviorTree></root>')
    return str(file)


def test_a_goal_may_bring_its_tree(bench: Bench, stack: Stack, tmp_path: Path) -> None:
    square = '<Sequence><DriveOnHeading dist_to_travel="0.4" speed="0.2"/><Spin spin_dist="1.57"/></Sequence>'
    sent = stack.go(0.0, 0.0, tree=tree(tmp_path, f'<Repeat num_cycles="2">{square}</Repeat>'))
    stack.until_done(sent)
    assert sent.succeeded
    assert stack.robot.pose.x == pytest.approx(0.4, abs=0.05)
    assert stack.robot.pose.y == pytest.approx(0.4, abs=0.05)
    assert stack.feedback[-1].number_of_recoveries == 2, "spins count unless is_recovery is false"
    named = stack.go(1.0, 0.0, tree="navigate_to_pose")
    stack.until_done(named)
    assert named.succeeded


def test_a_tree_switches_the_collision_monitor_and_cuts_paths(
    bench: Bench, stack: Stack, tmp_path: Path
) -> None:
    asked: list[bool] = []

    def on_toggle(request: Any) -> Any:
        asked.append(request.enable)
        return new(Toggle.Response, success=True)

    bench.node.create_service(Toggle, "collision_monitor/toggle", on_toggle)
    nodes = """<Sequence>
        <ToggleCollisionMonitor enable="false"/>
        <ComputePathToPose goal="{goal}" path="{whole}"/>
        <TruncatePathLocal input_path="{whole}" output_path="{path}" distance_forward="0.5"
            robot_frame="base_footprint"/>
        <FollowPath path="{path}"/>
        <ToggleCollisionMonitor/>
    </Sequence>"""
    sent = stack.go(1.0, 0.0, tree=tree(tmp_path, nodes))
    stack.until_done(sent)
    assert sent.succeeded
    assert asked == [False, True]
    assert stack.robot.pose.x == pytest.approx(0.5, abs=0.1)


def test_an_action_that_is_ticked_after_its_end_keeps_its_result(
    bench: Bench, stack: Stack, tmp_path: Path
) -> None:
    """A PipelineSequence ticks what has ended again and again while the last child is at work."""
    nodes = """<PipelineSequence>
        <ComputePathToPose goal="{goal}" path="{path}"/>
        <FollowPath path="{path}"/>
    </PipelineSequence>"""
    sent = stack.go(1.0, 0.0, tree=tree(tmp_path, nodes))
    stack.until_done(sent)
    assert sent.succeeded
    assert stack.robot.pose.x == pytest.approx(1.0, abs=0.06)


def test_a_tree_that_is_wrong_or_missing_ends_the_goal_not_the_run(stack: Stack, tmp_path: Path) -> None:
    result = stack.until_done(stack.go(1.0, 0.0, tree=tree(tmp_path, "<Spinn/>")), 1.0)
    assert result.error_code == 9001
    assert "mine.xml:1: there is no node <Spinn>; did you mean Spin" in result.error_msg
    result = stack.until_done(stack.go(1.0, 0.0, tree="navigate_to_poses"), 1.0)
    assert result.error_code == 9001
    assert "did you mean 'navigate_to_pose'?" in result.error_msg


def test_an_entry_of_the_blackboard_that_is_no_number_ends_the_goal(stack: Stack, tmp_path: Path) -> None:
    nodes = """<Sequence>
        <SetBlackboard value="soon" output_key="time"/>
        <Wait wait_duration="{time}"/>
    </Sequence>"""
    result = stack.until_done(stack.go(1.0, 0.0, tree=tree(tmp_path, nodes)), 1.0)
    assert result.error_code == 9000
    assert "Wait: wait_duration must be a number" in result.error_msg
    assert "{time} is 'soon'" in result.error_msg


def test_a_wrong_default_tree_is_refused_when_the_node_is_made(bench: Bench) -> None:
    with pytest.raises(NavigationError, match=r"there is no behaviour tree 'none\.xml'"):
        Stack(bench, BtNavigatorConfig(default_nav_to_pose_bt_xml="none.xml"))


def test_the_log_tells_every_change_of_status(bench: Bench, stack: Stack) -> None:
    got = bench.listen(BehaviorTreeLog, "behavior_tree_log", 100)
    stack.until_done(stack.go(0.5, 0.0))
    bench.run(0.1)
    changes = [change for message in got for change in message.event_log]
    status: dict[int, str] = {}
    for change in changes:
        assert status.get(change.uid, "IDLE") == change.previous_status, change.node_name
        status[change.uid] = change.current_status
    assert ("FollowPath", "RUNNING", "SUCCESS") in {
        (c.node_name, c.previous_status, c.current_status) for c in changes
    }


def test_of_two_actions_at_once_the_second_is_rejected(bench: Bench, stack: Stack) -> None:
    first = stack.go(0.5, 0.0)
    goal = pose_stamped(Pose2(-1.0, 0.0, 0.0), "map", bench.clock.now_ns)
    second = stack.through.send_goal(new(NavigateThroughPoses.Goal, poses=[goal]))
    bench.until(lambda: second.done, 1.0)
    assert second.accepted is False
    stack.until_done(first)
    assert first.succeeded


def test_through_poses_passes_them_all(bench: Bench, stack: Stack) -> None:
    """With a planner that joins straight lines."""

    def plan(handle: GoalHandle) -> Generator[None, None, Any]:
        yield
        corners = [stack.robot.pose, *(pose2_from_pose(goal.pose) for goal in handle.request.goals)]
        asked.append(len(corners) - 1)
        rows = [
            (a.x + t * (b.x - a.x), a.y + t * (b.y - a.y), math.atan2(b.y - a.y, b.x - a.x))
            for a, b in pairwise(corners)
            for t in np.linspace(0.0, 1.0, 20)
        ]
        path = path_msg(np.array(rows), "map", bench.clock.now_ns)
        return new(ComputePathThroughPoses.Result, path=path)

    asked: list[int] = []
    if not stack.navigator._context.action_client(  # the real one, where the planner server has it
        ComputePathThroughPoses, "compute_path_through_poses"
    ).server_is_ready:
        node = bench.bus.create_node("planner")
        ActionServer(node, ComputePathThroughPoses, "compute_path_through_poses", plan)
    bench.run(0.1)
    poses = [Pose2(1.0, -0.5, 0.0), Pose2(1.8, 0.0, 0.0), Pose2(1.0, 0.6, math.pi)]
    goals = [pose_stamped(pose, "map", 0) for pose in poses]
    seen: list[Pose2] = []
    bench.each_tick.append(lambda: seen.append(stack.robot.pose))
    feedback: list[Any] = []
    sent = stack.through.send_goal(new(NavigateThroughPoses.Goal, poses=goals), feedback.append)
    bench.run(0.5)
    other = stack.go(0.0, 0.0)
    bench.until(lambda: other.done, 1.0)
    assert other.accepted is False, "one goal at a time, of either action"
    stack.until_done(sent)
    assert sent.succeeded
    for pose in poses:
        assert min(pose.distance(at) for at in seen) < 0.7
    assert stack.robot.pose.distance(poses[-1]) < 0.06
    left = [message.number_of_poses_remaining for message in feedback]
    assert (left[0], left[-1]) == (3, 1)
    assert left == sorted(left, reverse=True)
