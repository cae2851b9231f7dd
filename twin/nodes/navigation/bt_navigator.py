"""`/bt_navigator`: the actions `navigate_to_pose` and `navigate_through_poses`, run by behaviour trees.

The trees are files in BehaviorTree.CPP's XML with Nav2's nodes: those in `behavior_trees/trees`, or
Nav2's own, a user's. A goal may name one in its field `behavior_tree`.
"""

from __future__ import annotations

from functools import partial

from twin.bridge.action_types import NavigateThroughPoses, NavigateToPose
from twin.bridge.actions import ActionClient, GoalHandle
from twin.bridge.bus import Bus
from twin.bridge.msgs import PoseStamped, new
from twin.geometry import Pose2
from twin.navigation.behavior_trees.factory import Registry
from twin.nodes.navigation.behavior_trees.context import NavigatorContext
from twin.nodes.navigation.behavior_trees.navigator import Navigator, NavigatorSetup
from twin.nodes.navigation.behavior_trees.progress import TreeLog
from twin.nodes.navigation.behavior_trees.registry import NAVIGATOR_NODES
from twin.nodes.navigation.bt_navigator_config import BtNavigatorConfig
from twin.nodes.navigation.robot_pose import RobotPose
from twin.nodes.node_parameters import declare_config

_MS = 1_000_000


class BtNavigatorNode:
    """Serves both actions, one goal at a time; also takes goals from `goal_pose`, as RViz sends them."""

    def __init__(
        self,
        bus: Bus,
        robot_pose: RobotPose,
        config: BtNavigatorConfig | None = None,
        *,
        tree_nodes: Registry = NAVIGATOR_NODES,
        namespace: str = "",
    ) -> None:
        """Make the node with its default trees.

        Args:
            bus: Whose node.
            robot_pose: What the robot believes about its pose.
            config: Its parameters.
            tree_nodes: What trees may be made of.
            namespace: Of the robot.

        Raises:
            NavigationError: a default tree that cannot be used.
        """
        self.node = node = bus.create_node("bt_navigator", namespace)
        self.config = config = config or BtNavigatorConfig()
        declare_config(node, config)
        self.recoveries = 0
        """Recovery behaviours started since the beginning of the run: children of a `RoundRobin`."""
        self._context = context = NavigatorContext(
            node,
            robot_pose,
            odom_topic=config.odom_topic,
            filter_duration_ns=round(config.filter_duration * 1e9),
            server_timeout_ns=config.default_server_timeout * _MS,
            goal_reached_tol=config.goal_reached_tol,
            tree_nodes=tree_nodes,
        )
        log = TreeLog(node)
        context.on_transition = log.take
        context.on_recovery = self._on_recovery
        self._navigators: list[Navigator] = []
        for setup in self._setups(config):
            navigator = Navigator(context, setup, self._is_another_busy)
            navigator.after_tick = log.flush
            self._navigators.append(navigator)
        self._own_client = ActionClient(node, NavigateToPose, "navigate_to_pose")
        node.create_subscription(PoseStamped, "goal_pose", self._on_goal_pose, 10)

    @property
    def goals(self) -> int:
        """Goals taken since the beginning of the run."""
        return sum(navigator.goals for navigator in self._navigators)

    @property
    def goal(self) -> Pose2 | None:
        """The last goal that was taken, of several poses the last one, in the map frame; None before that."""
        return self._context.goal

    @property
    def under_way(self) -> tuple[GoalHandle, ...]:
        """The goals that were accepted and have not ended, in the order of acceptance."""
        return tuple(goal for navigator in self._navigators for goal in navigator.under_way)

    @property
    def frame(self) -> str:
        """The frame of its map."""
        return self._context.robot_pose.frames.map

    @property
    def recovering(self) -> bool:
        """Whether a recovery behaviour is under way."""
        return self._context.recovering

    @staticmethod
    def _setups(config: BtNavigatorConfig) -> tuple[NavigatorSetup, NavigatorSetup]:
        setup = partial(
            NavigatorSetup,
            error_code_name_prefixes=config.error_code_name_prefixes,
            tick_ns=config.bt_loop_duration * _MS,
        )
        return (
            setup(
                action=NavigateToPose,
                name="navigate_to_pose",
                default_tree=config.default_nav_to_pose_bt_xml,
                codes=9000,
                poses=lambda goal: [goal.pose],
                entry=lambda poses: ("goal", poses[0]),
            ),
            setup(
                action=NavigateThroughPoses,
                name="navigate_through_poses",
                default_tree=config.default_nav_through_poses_bt_xml,
                codes=9100,
                poses=lambda goal: list(goal.poses),
                entry=lambda poses: ("goals", poses),
            ),
        )

    def _on_goal_pose(self, message: PoseStamped) -> None:
        self._own_client.send_goal(new(NavigateToPose.Goal, pose=message))

    def _is_another_busy(self, navigator: Navigator) -> bool:
        return any(other.is_active for other in self._navigators if other is not navigator)

    def _on_recovery(self, name: str) -> None:
        self.recoveries += 1
        failures = (navigator.failure()[1] for navigator in self._navigators if navigator.is_active)
        self.node.get_logger().warn(f"recovery {name} after: {next(failures, '')}")
