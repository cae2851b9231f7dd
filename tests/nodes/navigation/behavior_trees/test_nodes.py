"""Nav2's conditions, decorators and leaves by their names in the XML, on topics, transforms and servers."""

from __future__ import annotations

from collections.abc import Generator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.nodes.conftest import ORIGIN, TICK_S, Bench
from twin.bridge.actions import ActionClient, ActionServer, GoalHandle
from twin.bridge.conversions import pose2_from_pose
from twin.bridge.msgs import BatteryState, GoalStatus, Odometry, PoseStamped, header, new
from twin.bridge.srvs import GetCost
from twin.bridge.tf import TransformBroadcaster, transform_stamped
from twin.geometry import Pose2, Pose3
from twin.navigation.behavior_trees.blackboard import Blackboard
from twin.navigation.behavior_trees.factory import Tree, TreeBuilder
from twin.navigation.behavior_trees.node import Status
from twin.nodes.messages import path_array, path_msg, pose_stamped
from twin.nodes.navigation.behavior_trees.context import NavigatorContext
from twin.nodes.navigation.behavior_trees.families import CANCEL_NODES
from twin.nodes.navigation.behavior_trees.registry import NAVIGATOR_NODES
from twin.nodes.navigation.robot_pose import Frames, RobotPose
from twin.nodes.transforms import TransformListenerNode

SUCCESS, FAILURE, RUNNING = Status.SUCCESS, Status.FAILURE, Status.RUNNING


class Bed:
    """A tree of one node, ticked by hand, for a robot that is where `pose` says."""

    def __init__(self, bench: Bench, folder: Path) -> None:
        self.bench, self.pose, self.blackboard = bench, ORIGIN, Blackboard()
        self.ticks = 0
        """How often an AlwaysSuccess was ticked."""
        self._file = folder / "tree.xml"
        self._publishers: dict[str, Any] = {}
        self._tf = TransformBroadcaster(bench.node)
        self._context = NavigatorContext(
            bench.bus.create_node("navigator"),
            RobotPose(TransformListenerNode(bench.bus).buffer, Frames()),
            odom_topic="odom",
            filter_duration_ns=300_000_000,
            server_timeout_ns=1_000_000_000,
            goal_reached_tol=0.25,
        )
        self._context.on_transition = self._count
        bench.each_tick.append(self._tell_pose)

    def _count(self, node: Any, before: Status, now: Status) -> None:
        self.ticks += node.name == "AlwaysSuccess" and now is SUCCESS

    def _tell_pose(self) -> None:
        T_map_base = Pose3.from_pose2(self.pose)
        now = self.bench.clock.now_ns
        self._tf.send_transform(transform_stamped("map", "base_footprint", now, T_map_base))

    def load(self, text: str, **entries: Any) -> Tree:
        """Return the tree of `<text/>`, or of a whole element, with these entries on its blackboard."""
        inside = text if text.startswith("<") else f"<{text}/>"
        self._file.write_text(
            f'<root BTCPP_format="4"><BehaviorTree ID="A">{inside}</BehaviorTree></root>', encoding="utf-8"
        )
        for name, value in entries.items():
            self.blackboard.set(name, value)
        tree = TreeBuilder(self._file, NAVIGATOR_NODES).build(self._context, self.blackboard)
        self.bench.run(2 * TICK_S)
        return tree

    def at(self, x: float) -> None:
        """Put the robot at (x, 0)."""
        self.pose = Pose2(x, 0.0, 0.0)
        self.bench.run(2 * TICK_S)

    def hear(self, topic: str, message: Any) -> None:
        """Publish a message, and let it arrive."""
        if topic not in self._publishers:
            self._publishers[topic] = self.bench.node.create_publisher(type(message), topic, 10)
            self.bench.run(0.1)
        self._publishers[topic].publish(message)
        self.bench.run(2 * TICK_S)

    def drive(self, speed: float) -> None:
        """Tell odometry's speed, one message per tick."""
        now = self.bench.clock.now_ns
        message = new(Odometry, header=header(now, "odom"))
        message.twist.twist.linear.x = speed
        self.hear("odom", message)


@pytest.fixture
def bed(bench: Bench, tmp_path: Path) -> Bed:
    return Bed(bench, tmp_path)


def stamped(x: float, time_ns: int = 0) -> PoseStamped:
    return pose_stamped(Pose2(x, 0.0, 0.0), "map", time_ns)


def straight(first: float, last: float) -> Any:
    """A path along x, a pose every 0.1 m."""
    x = np.linspace(first, last, 1 + round((last - first) / 0.1))
    return path_msg(np.column_stack([x, 0.0 * x, 0.0 * x]), "map", 0)


def ends(path: Any) -> tuple[float, float]:
    points = path_array(path)
    return points[0, 0], points[-1, 0]


# Conditions

CHARGING = BatteryState.POWER_SUPPLY_STATUS_CHARGING
DISCHARGING = BatteryState.POWER_SUPPLY_STATUS_DISCHARGING
BATTERY = [
    ('IsBatteryLow min_battery="0.3"', {"percentage": 0.2}, SUCCESS),
    ('IsBatteryLow min_battery="0.3"', {"percentage": 0.4}, FAILURE),
    ('IsBatteryLow min_battery="11.5" is_voltage="true"', {"voltage": 11.0, "percentage": 0.9}, SUCCESS),
    ("IsBatteryCharging", {"power_supply_status": CHARGING}, SUCCESS),
    ("IsBatteryCharging", {"power_supply_status": DISCHARGING}, FAILURE),
]


@pytest.mark.parametrize(("text", "state", "says"), BATTERY)
def test_conditions_on_the_battery(bed: Bed, text: str, state: dict[str, Any], says: Status) -> None:
    tree = bed.load(f'{text} battery_topic="power"')
    assert tree.tick() is FAILURE, "nothing was heard yet"
    bed.hear("power", new(BatteryState, **state))
    assert tree.tick() is says


def test_a_bump_is_stuck_and_braking_is_not(bed: Bed) -> None:
    tree = bed.load("IsStuck")
    for speed, says in ((0.5, FAILURE), (0.45, FAILURE), (0.0, SUCCESS), (0.0, FAILURE)):
        bed.drive(speed)
        assert tree.tick() is says, speed


def test_a_goal_is_reached_within_the_tolerance(bed: Bed) -> None:
    tree = bed.load('GoalReached goal="{goal}"', goal=stamped(1.0))
    assert tree.tick() is FAILURE
    bed.at(0.8)
    assert tree.tick() is SUCCESS


def test_distance_is_counted_from_where_it_held_last(bed: Bed) -> None:
    tree = bed.load('DistanceTraveled distance="0.5"')
    for x, says in ((0.0, FAILURE), (0.4, FAILURE), (0.6, SUCCESS), (1.0, FAILURE), (1.2, SUCCESS)):
        bed.at(x)
        assert tree.tick() is says, x


def test_a_goal_is_nearby_when_little_of_the_path_is_left(bed: Bed) -> None:
    tree = bed.load('IsGoalNearby path="{path}" proximity_threshold="1.0"', path=straight(0.0, 2.0))
    assert tree.tick() is FAILURE
    bed.at(1.5)
    assert tree.tick() is SUCCESS


def test_poses_are_near_within_the_tolerance(bed: Bed) -> None:
    text = 'ArePosesNear ref_pose="{one}" target_pose="{two}" tolerance="0.3"'
    tree = bed.load(text, one=stamped(1.0), two=stamped(1.2))
    assert tree.tick() is SUCCESS
    bed.blackboard.set("two", stamped(1.4))
    assert tree.tick() is FAILURE


@pytest.mark.parametrize("text", ['TimeExpired seconds="1"', 'PathExpiringTimer seconds="1" path="{path}"'])
def test_time_expires_again_and_again(bed: Bed, text: str) -> None:
    tree = bed.load(text, path=straight(0.0, 1.0))
    for seconds, says in ((0.0, FAILURE), (0.9, FAILURE), (0.2, SUCCESS), (0.9, FAILURE), (0.2, SUCCESS)):
        bed.bench.run(seconds)
        assert tree.tick() is says


CODES = [
    ('AreErrorCodesPresent error_codes_to_check="3;5"', {5}),
    ("WouldAControllerRecoveryHelp", {100, 104, 105, 106}),
    ("WouldAPlannerRecoveryHelp", {200, 207, 208, 300, 307, 308}),
    ("WouldASmootherRecoveryHelp", {500, 502, 503, 504}),
]


@pytest.mark.parametrize(("text", "codes"), CODES)
def test_errors_that_a_recovery_may_help(bed: Bed, text: str, codes: set[int]) -> None:
    tree = bed.load(f'{text} error_code="{{code}}"')
    asked = (0, 5, *range(100, 110), *range(200, 210), *range(300, 310), *range(500, 510))

    def helps(code: int) -> bool:
        bed.blackboard.set("code", code)
        return tree.tick() is SUCCESS

    assert {code for code in asked if helps(code)} == codes


def test_frames_that_are_connected(bed: Bed) -> None:
    tree = bed.load('TransformAvailable parent="map" child="base_footprint"')
    assert tree.tick() is SUCCESS
    assert bed.load('TransformAvailable parent="map" child="moon"').tick() is FAILURE


# Decorators


def decorated(text: str) -> str:
    return f"<{text}><AlwaysSuccess/></{text.partition(' ')[0]}>"


def test_a_child_is_ticked_every_so_many_metres(bed: Bed) -> None:
    tree = bed.load(decorated('DistanceController distance="0.5"'))
    ticked = []
    for x in (0.0, 0.3, 0.6, 0.9, 1.2):
        bed.at(x)
        tree.tick()
        ticked.append(bed.ticks)
    assert ticked == [1, 1, 2, 2, 3]


@pytest.mark.parametrize(("speed", "ticks"), [(0.0, 4), (0.5, 6)])
def test_a_child_is_ticked_more_often_at_speed(bed: Bed, speed: float, ticks: int) -> None:
    rates = 'min_rate="1" max_rate="2" min_speed="0" max_speed="0.5"'
    tree = bed.load(decorated(f"SpeedController {rates}"))
    for _ in range(round(2.9 / (2 * TICK_S))):
        bed.drive(speed)
        tree.tick()
    assert bed.ticks == ticks, "at once, after 0.5 s, then every second, or every half"


def test_a_goal_is_replaced_by_a_newer_one(bed: Bed) -> None:
    text = 'GoalUpdater input_goal="{goal}" output_goal="{updated}"'
    tree = bed.load(decorated(text), goal=stamped(1.0, 5_000_000_000))

    def updated() -> float:
        assert tree.tick() is SUCCESS
        return pose2_from_pose(bed.blackboard.get("updated").pose).x

    assert updated() == 1.0
    bed.hear("goal_update", stamped(2.0, 4_000_000_000))
    assert updated() == 1.0, "that one is older"
    bed.hear("goal_update", stamped(3.0, 6_000_000_000))
    assert updated() == 3.0
    assert bed.ticks == 3


# Leaves


def test_the_end_of_a_path_is_cut_off(bed: Bed) -> None:
    text = 'TruncatePath input_path="{path}" output_path="{cut}" distance="0.45"'
    assert bed.load(text, path=straight(0.0, 2.0)).tick() is SUCCESS
    assert ends(bed.blackboard.get("cut")) == pytest.approx((0.0, 1.5))


def test_paths_are_joined(bed: Bed) -> None:
    text = 'ConcatenatePaths input_path1="{one}" input_path2="{two}" output_path="{both}"'
    tree = bed.load(text)
    assert tree.tick() is FAILURE, "neither is there"
    bed.blackboard.set("one", straight(0.0, 1.0))
    bed.blackboard.set("two", straight(1.0, 3.0))
    assert tree.tick() is SUCCESS
    assert ends(bed.blackboard.get("both")) == (0.0, 3.0)


@pytest.mark.parametrize(("index", "x"), [(0, 0.0), (3, 0.3), (-1, 2.0), (99, None)])
def test_a_pose_of_a_path(bed: Bed, index: int, x: float | None) -> None:
    tree = bed.load(
        f'GetPoseFromPath path="{{path}}" index="{index}" pose="{{pose}}"', path=straight(0.0, 2.0)
    )
    assert tree.tick() is (FAILURE if x is None else SUCCESS)
    if x is not None:
        assert pose2_from_pose(bed.blackboard.get("pose").pose).x == pytest.approx(x)


def test_where_the_robot_is(bed: Bed) -> None:
    tree = bed.load('GetCurrentPose current_pose="{here}"')
    bed.at(0.7)
    assert tree.tick() is SUCCESS
    here = bed.blackboard.get("here")
    assert (here.header.frame_id, pose2_from_pose(here.pose)) == ("map", Pose2(0.7, 0.0, 0.0))


GOALS = [
    ('AppendGoalPoseToGoals input_goals="{goals}" goal_pose="{last}"', [1.0, 2.0, 3.0, 4.0]),
    ('GetNextFewGoals input_goals="{goals}" num_goals="2"', [1.0, 2.0]),
    ('RemovePassedGoals input_goals="{goals}" radius="0.5"', [2.0, 3.0]),
    ('RemoveInCollisionGoals input_goals="{goals}"', [1.0, 3.0]),
]


@pytest.mark.parametrize(("text", "left"), GOALS)
def test_lists_of_goals(bed: Bed, text: str, left: list[float]) -> None:
    def cost(request: Any) -> Any:
        return new(GetCost.Response, cost=254.0 if request.x == 2.0 else 255.0 if request.x == 3.0 else 0.0)

    bed.bench.node.create_service(GetCost, "global_costmap/get_cost_global_costmap", cost)
    goals = [stamped(x) for x in (1.0, 2.0, 3.0)]
    tree = bed.load(f'{text} output_goals="{{goals}}"', goals=goals, last=stamped(4.0))
    bed.at(0.7)
    bed.bench.until(lambda: tree.tick() is not RUNNING, 1.0)
    assert tree.root.status is SUCCESS
    assert [pose2_from_pose(goal.pose).x for goal in bed.blackboard.get("goals")] == left


@pytest.mark.parametrize("name", CANCEL_NODES)
def test_cancelling_ends_what_somebody_else_began(bed: Bed, name: str) -> None:
    node: Any = CANCEL_NODES[name]

    def execute(handle: GoalHandle) -> Generator[None, None, Any]:
        while not handle.is_cancel_requested:
            yield
        handle.canceled()
        return new(node.ACTION.Result)

    ActionServer(bed.bench.node, node.ACTION, node.SERVER, execute)
    client = ActionClient(bed.bench.node, node.ACTION, node.SERVER)
    tree = bed.load(name)
    sent = client.send_goal(new(node.ACTION.Goal))
    bed.bench.until(lambda: sent.accepted, 1.0)
    bed.bench.until(lambda: tree.tick() is not RUNNING, 1.0)
    assert tree.root.status is SUCCESS
    bed.bench.until(lambda: sent.done, 1.0)
    assert sent.status == GoalStatus.STATUS_CANCELED
