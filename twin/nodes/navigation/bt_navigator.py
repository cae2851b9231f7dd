"""`/bt_navigator`: the `navigate_to_pose` action, run by a behaviour tree as in Nav2.

The tree is Nav2's `navigate_to_pose_w_replanning_and_recovery` in its variant that keeps the path while it is
valid (`navigate_w_replanning_only_if_path_becomes_invalid`): planning anew costs time and tells nothing new.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from twin.bridge.action_types import BackUp, ComputePathToPose, FollowPath, NavigateToPose, Spin, Wait
from twin.bridge.actions import ActionClient, ActionServer, GoalHandle
from twin.bridge.bus import Bus
from twin.bridge.conversions import pose2_from_pose
from twin.bridge.msgs import Path, Point, PoseStamped, duration, new
from twin.bridge.srvs import ClearEntireCostmap, IsPathValid
from twin.nodes.messages import pose_stamped
from twin.nodes.navigation.bt.control import (
    Fallback,
    PipelineSequence,
    RateController,
    RecoveryNode,
    RoundRobin,
    sequence,
)
from twin.nodes.navigation.bt.leaves import CallAction, CallService, Condition, Do
from twin.nodes.navigation.robot_pose import RobotPose


@dataclass(frozen=True, kw_only=True)
class BtNavigatorConfig:
    """Parameters of the navigator."""

    bt_loop_duration_ns: int = 100_000_000
    """Time between ticks of the tree."""
    replanning_period_ns: int = 1_000_000_000
    """Time between checks whether the path still holds."""
    keep_valid_path: bool = True
    """Whether a path is kept while it is free; otherwise it is planned anew each time."""
    number_of_retries: int = 6
    """Recoveries before the goal is given up."""
    spin_angle: float = 1.57
    """[rad]"""
    backup_distance: float = 0.30
    """[m]"""
    backup_speed: float = 0.15
    """[m/s]"""
    wait_s: float = 5.0
    """[s]"""


class BtNavigatorNode:
    """Serves `navigate_to_pose`; also takes goals from `goal_pose`, as RViz sends them."""

    def __init__(
        self, bus: Bus, robot_pose: RobotPose, config: BtNavigatorConfig | None = None, *, namespace: str = ""
    ) -> None:
        self.node = node = bus.create_node("bt_navigator", namespace)
        self.config = config or BtNavigatorConfig()
        self._robot_pose = robot_pose
        self._goal: PoseStamped | None = None
        self._path: Path | None = None
        self._path_changed = False
        self._failure = ""
        self.recoveries = 0
        """Recovery behaviours started since the beginning of the run."""
        self._plan = ActionClient(node, ComputePathToPose, "compute_path_to_pose")
        self._follow = ActionClient(node, FollowPath, "follow_path")
        self._spin = ActionClient(node, Spin, "spin")
        self._backup = ActionClient(node, BackUp, "backup")
        self._wait = ActionClient(node, Wait, "wait")
        self._clear_global = node.create_client(
            ClearEntireCostmap, "global_costmap/clear_entirely_global_costmap"
        )
        self._clear_local = node.create_client(
            ClearEntireCostmap, "local_costmap/clear_entirely_local_costmap"
        )
        self._is_path_valid = node.create_client(IsPathValid, "is_path_valid")
        self._server = ActionServer(node, NavigateToPose, "navigate_to_pose", self._execute)
        self._own_client = ActionClient(node, NavigateToPose, "navigate_to_pose")
        node.create_subscription(PoseStamped, "goal_pose", self._on_goal_pose, 10)

    def _on_goal_pose(self, message: PoseStamped) -> None:
        self._own_client.send_goal(new(NavigateToPose.Goal, pose=message))

    def _execute(self, handle: GoalHandle) -> Generator[None, None, Any]:
        self._goal, self._path, self._failure = handle.request.pose, None, ""
        started, recoveries = self.node.now_ns, self.recoveries
        target = pose2_from_pose(self._goal.pose)
        self.node.get_logger().info(f"navigating to ({target.x:.2f}, {target.y:.2f}, {target.yaw:.2f})")
        tree = self._build_tree()
        next_tick = started
        try:
            while True:
                if handle.is_cancel_requested:
                    handle.canceled()
                    return new(NavigateToPose.Result, error_msg="canceled")
                if self.node.now_ns >= next_tick:
                    next_tick += self.config.bt_loop_duration_ns
                    tree.tick_once()
                    if tree.status == Status.SUCCESS:
                        self.node.get_logger().info("goal reached")
                        return new(NavigateToPose.Result)
                    if tree.status == Status.FAILURE:
                        self.node.get_logger().error(f"navigation failed: {self._failure}")
                        handle.abort()
                        return new(NavigateToPose.Result, error_code=1, error_msg=self._failure)
                    handle.publish_feedback(self._feedback(started, self.recoveries - recoveries))
                yield
        finally:
            # Reached too when a new goal preempts this one: the running behaviours are cancelled.
            if tree.status == Status.RUNNING:
                tree.stop(Status.INVALID)

    def _feedback(self, started: int, recoveries: int) -> Any:
        pose = self._robot_pose.in_map()
        assert self._goal is not None
        goal = pose2_from_pose(self._goal.pose)
        now = self.node.now_ns
        return new(
            NavigateToPose.Feedback,
            current_pose=pose_stamped(pose or goal, self._robot_pose.frames.map, now),
            navigation_time=duration(now - started),
            number_of_recoveries=recoveries,
            distance_remaining=pose.distance(goal) if pose else float("inf"),
        )

    # The tree

    def _build_tree(self) -> Behaviour:
        navigate = PipelineSequence(
            "NavigateWithReplanning",
            [
                RateController(
                    "RateController",
                    self.config.replanning_period_ns,
                    lambda: self.node.now_ns,
                    self._planning(),
                ),
                RecoveryNode("FollowPath", 1, self._following(), self._clearing("local")),
            ],
        )
        return RecoveryNode("NavigateRecovery", self.config.number_of_retries, navigate, self._recovering())

    def _planning(self) -> Behaviour:
        compute = CallAction(
            "ComputePathToPose",
            self._plan,
            lambda: new(ComputePathToPose.Goal, goal=self._goal),
            on_result=self._take_path,
            on_failure=self._note_failure,
        )
        keep = sequence(
            "KeepValidPath",
            [
                Condition("HasPath", lambda: self._path is not None and self.config.keep_valid_path),
                CallService(
                    "IsPathValid",
                    self._is_path_valid,
                    lambda: new(IsPathValid.Request, path=self._path),
                    lambda response: bool(response.is_valid),
                ),
            ],
        )
        return Fallback(
            "PathValidOrReplan",
            [keep, RecoveryNode("ComputePath", 1, compute, self._clearing("global"))],
        )

    def _following(self) -> Behaviour:
        def goal() -> Any:
            self._path_changed = False
            return new(FollowPath.Goal, path=self._path)

        return CallAction(
            "FollowPath",
            self._follow,
            goal,
            updated=lambda: goal() if self._path_changed else None,
            on_failure=self._note_failure,
        )

    def _clearing(self, which: str) -> Behaviour:
        client = self._clear_local if which == "local" else self._clear_global
        return CallService(f"Clear{which.title()}Costmap", client, lambda: new(ClearEntireCostmap.Request))

    def _recovering(self) -> Behaviour:
        config = self.config
        allowance = duration(10_000_000_000)

        def count(name: str, leaf: Behaviour) -> Behaviour:
            def note() -> None:
                self.recoveries += 1
                self._path = None
                self.node.get_logger().warn(f"recovery {name} after: {self._failure}")

            return sequence(name, [Do(f"Note{name}", note), leaf])

        return RoundRobin(
            "RecoveryActions",
            [
                count(
                    "ClearCostmaps",
                    sequence("ClearBoth", [self._clearing("local"), self._clearing("global")]),
                ),
                count(
                    "BackUp",
                    CallAction(
                        "BackUp",
                        self._backup,
                        lambda: new(
                            BackUp.Goal,
                            target=Point(x=config.backup_distance, y=0.0, z=0.0),
                            speed=config.backup_speed,
                            time_allowance=allowance,
                        ),
                    ),
                ),
                count(
                    "Spin",
                    CallAction(
                        "Spin",
                        self._spin,
                        lambda: new(Spin.Goal, target_yaw=config.spin_angle, time_allowance=allowance),
                    ),
                ),
                count(
                    "Wait",
                    CallAction(
                        "Wait", self._wait, lambda: new(Wait.Goal, time=duration(int(config.wait_s * 1e9)))
                    ),
                ),
            ],
        )

    def _take_path(self, result: Any) -> str | None:
        self._path = result.path
        self._path_changed = True
        return None

    def _note_failure(self, reason: str) -> None:
        self._failure = reason
