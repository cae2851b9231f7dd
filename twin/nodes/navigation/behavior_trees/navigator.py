"""One action of the navigator: runs its tree, lets a new goal take the tree over (BtActionServer)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path as FilePath
from typing import Any

from twin.bridge.actions import ActionServer, GoalHandle
from twin.bridge.conversions import pose2_from_pose
from twin.bridge.msgs import Path, duration, new
from twin.bridge.node.tasks import Steps
from twin.bridge.node.timers import Beat
from twin.bridge.types import ActionType
from twin.errors import NavigationError, nearest
from twin.navigation.behavior_trees.blackboard import Blackboard
from twin.navigation.behavior_trees.factory import Tree, TreeBuilder
from twin.navigation.behavior_trees.node import Status
from twin.nodes.messages import pose_stamped
from twin.nodes.navigation.behavior_trees.context import NavigatorContext, fill
from twin.nodes.navigation.behavior_trees.progress import Progress

SHIPPED = FilePath(__file__).parent / "trees"

_UNKNOWN, _FAILED_TO_LOAD, _TF_ERROR = 0, 1, 2
"""Added to 9000 for navigate_to_pose, to 9100 for navigate_through_poses."""
_POSE_PATIENCE_NS = 2_000_000_000
"""How long a goal waits for a robot that is not localised yet [ns]."""


def tree_file(name: str) -> FilePath:
    """Return the file of a tree: that of a shipped one by its name, or a path.

    Raises:
        NavigationError: neither.
    """
    path = FilePath(name)
    if path.suffix == ".xml" and path.exists():
        return path
    shipped = {file.stem: file for file in sorted(SHIPPED.glob("*.xml"))}
    found = shipped.get(name.removesuffix(".xml"))
    if found is None:
        why = "trees are files that end in .xml" if path.exists() else "no such file"
        raise NavigationError(f"there is no behaviour tree {name!r}: {why}; {nearest(name, shipped)}")
    return found


@dataclass(frozen=True, kw_only=True)
class NavigatorSetup:
    """What distinguishes the navigator's actions."""

    action: ActionType
    name: str
    default_tree: str
    codes: int
    """The first of the action's error codes."""
    poses: Callable[[Any], list[Any]]
    """Goal message -> poses to go to."""
    entry: Callable[[list[Any]], tuple[str, Any]]
    """These poses, in the map -> the blackboard's entry and its value."""
    error_code_name_prefixes: tuple[str, ...]
    tick_ns: int


class Navigator:
    """Serves one action; keeps its trees and its blackboard from goal to goal, as Nav2 does."""

    def __init__(
        self, context: NavigatorContext, setup: NavigatorSetup, is_busy: Callable[[Navigator], bool]
    ) -> None:
        """Make the server and its default tree.

        Args:
            context: Of the navigator's node.
            setup: What to serve.
            is_busy: Whether another action of the node is being executed: then goals are rejected.

        Raises:
            NavigationError: the default tree cannot be used.
        """
        self.setup, self._context = setup, context
        self.after_tick: Callable[[], None] = lambda: None
        self.blackboard = Blackboard()
        self.goals = 0
        """Goals taken since the beginning."""
        self._trees: dict[str, Tree] = {}
        self._active: GoalHandle | None = None
        self._name = ""
        self._tree = self._load(setup.default_tree)
        self._started = 0
        self._beat = Beat(context.node.get_clock())
        self._unplanned: Path | None = None
        self._progress = Progress(context.filter_duration_ns)
        self._server = ActionServer(
            context.node,
            setup.action,
            setup.name,
            self._execute,
            lambda goal: not is_busy(self),
            policy="parallel",
        )

    @property
    def under_way(self) -> tuple[GoalHandle, ...]:
        """The goals that were accepted and have not ended, be it that one waits for the robot's pose."""
        return self._server.goals

    @property
    def is_active(self) -> bool:
        """Whether there is one."""
        return bool(self.under_way)

    def failure(self) -> tuple[int, str]:
        """Return the lowest error code on the blackboard with its message; (0, '') if there is none."""
        found = []
        for prefix in self.setup.error_code_name_prefixes:
            code = int(self.blackboard.get(f"{prefix}_error_code", 0))
            if code:
                found.append((code, str(self.blackboard.get(f"{prefix}_error_msg", ""))))
        return min(found, default=(0, ""))

    def _load(self, name: str) -> Tree:
        if name not in self._trees:
            builder = TreeBuilder(tree_file(name), self._context.tree_nodes)
            self._trees[name] = builder.build(self._context, self.blackboard)
        return self._trees[name]

    # Execution

    def _execute(self, handle: GoalHandle) -> Steps:
        patience = self._context.now_ns() + _POSE_PATIENCE_NS
        while self._context.pose() is None and self._context.now_ns() < patience:
            yield None  # the first scan may be on its way
        refused = self._begin(handle)
        if refused is not None:
            handle.abort()
            return refused
        try:
            while self._active is handle:
                if handle.is_cancel_requested:
                    handle.canceled()
                    return self._result(0, "canceled")
                if self._beat.late_ns >= 0:
                    self._beat.put_off(self.setup.tick_ns)
                    status = self._tree.tick()
                    self.after_tick()
                    if status is not Status.RUNNING and not self._was_for_an_older_goal(status):
                        return self._end(handle, status)
                    self._publish_feedback(handle)
                yield self._beat.due_ns
            handle.abort()
            return self._result(0, "preempted by another goal")
        except NavigationError as error:
            handle.abort()
            return self._failed(_UNKNOWN, f"the behaviour tree {self._tree.name!r} cannot go on: {error}")
        finally:
            if self._active is handle:
                self._active = None
                self._tree.halt()
                self.after_tick()
                self._forget_errors()

    def _begin(self, handle: GoalHandle) -> Any | None:
        """Take a goal over, with the running tree if there is one; return a result if that is impossible."""
        name = handle.request.behavior_tree or self.setup.default_tree
        if self._active is not None and name != self._name:
            return self._failed(
                _UNKNOWN, f"the tree {self._name!r} is running; cancel its goal for another tree"
            )
        try:
            tree = self._load(name)
        except NavigationError as error:
            return self._failed(_FAILED_TO_LOAD, str(error))
        if self._context.pose() is None:
            return self._failed(_TF_ERROR, "the robot is not localised")
        poses = []
        for pose in self.setup.poses(handle.request):
            in_map = self._context.in_map(pose)
            if in_map is None:
                frame = pose.header.frame_id
                return self._failed(_TF_ERROR, f"the goal's frame {frame!r} is not connected to the map's")
            poses.append(in_map)
        board, now = self.blackboard, self._context.now_ns()
        self._unplanned = new(Path) if self._active is not None else None
        board.set("path", self._unplanned or new(Path))
        board.set(*self.setup.entry(poses))
        board.set("number_recoveries", 0)
        if self._active is None:
            self._beat = Beat(self._context.node.get_clock())
        self._tree, self._name, self._active, self._started = tree, name, handle, now
        self.goals += 1
        self._context.goal = pose2_from_pose(poses[-1].pose) if poses else None
        return None

    def _was_for_an_older_goal(self, status: Status) -> bool:
        """Whether the tree ended before it had planned to the goal that took it over; then it begins anew."""
        stale = self._unplanned is not None and self.blackboard.get("path") is self._unplanned
        self._unplanned = None
        if stale and status is Status.SUCCESS:
            self._tree.halt()
            return True
        return False

    def _end(self, handle: GoalHandle, status: Status) -> Any:
        logger = self._context.node.get_logger()
        if status is Status.SUCCESS:
            logger.info("goal reached")
            return self._result(0, "")
        code, message = self.failure()
        if not code:
            code, message = self.setup.codes + _UNKNOWN, f"the behaviour tree {self._tree.name!r} failed"
        logger.error(f"navigation failed: {message} (error code {code})")
        handle.abort()
        return self._result(code, message)

    def _failed(self, code: int, message: str) -> Any:
        self._context.node.get_logger().error(f"navigation failed: {message}")
        return self._result(self.setup.codes + code, message)

    def _result(self, code: int, message: str) -> Any:
        return new(self.setup.action.Result, error_code=code, error_msg=message)

    def _forget_errors(self) -> None:
        for prefix in self.setup.error_code_name_prefixes:
            self.blackboard.set(f"{prefix}_error_code", 0)
            self.blackboard.set(f"{prefix}_error_msg", "")

    def _publish_feedback(self, handle: GoalHandle) -> None:
        pose = self._context.pose()
        if pose is None:
            return
        board, now = self.blackboard, self._context.now_ns()
        distance, to_go_ns = self._progress.update(board.get("path"), pose, now)
        feedback = fill(
            self.setup.action.Feedback,
            current_pose=pose_stamped(pose, self._context.robot_pose.frames.map, self._context.node.now_ns),
            navigation_time=duration(now - self._started),
            estimated_time_remaining=duration(to_go_ns),
            number_of_recoveries=board.get("number_recoveries", 0),
            distance_remaining=distance,
            number_of_poses_remaining=len(board.get("goals") or []),
        )
        handle.publish_feedback(feedback)
