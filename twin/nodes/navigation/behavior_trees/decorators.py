"""Nav2's decorators that look at the robot, its goal or its path (plugins/decorator)."""

from __future__ import annotations

from typing import Any

from twin.bridge.msgs import Path, PoseStamped, new, ns
from twin.bridge.types import get
from twin.geometry import Pose2
from twin.navigation.behavior_trees import paths
from twin.navigation.behavior_trees.node import DecoratorNode, NodeSetup, Status
from twin.navigation.behavior_trees.ports import inputs, outputs
from twin.nodes.messages import path_array
from twin.nodes.navigation.behavior_trees.context import NavigatorContext

Goals: Any = get("nav_msgs/msg/Goals")
_GOAL = inputs(goal="message", goals="message")


class NavigatorDecorator(DecoratorNode):
    """A decorator that needs what the navigator has."""

    context: NavigatorContext

    def goal(self) -> tuple[Any, Any]:
        """Return the goal and the goals that are on the blackboard."""
        return self.get_or_entry("goal"), self.get_or_entry("goals")


class DistanceController(NavigatorDecorator):
    """Ticks its child at once, then whenever the robot has gone so far; runs in between."""

    PORTS = inputs(distance=("double", 1.0), global_frame="string", robot_base_frame="string")
    _start: Pose2 | None = None
    _is_first = False

    def tick(self) -> Status:
        """Tick the child if the robot has gone far enough, or if it is running."""
        pose = self.context.pose(self.get("global_frame"), self.get("robot_base_frame"))
        if pose is None:
            return Status.FAILURE
        if not self.status.is_active or self._start is None:
            self._start, self._is_first = pose, True
        self.set_status(Status.RUNNING)
        is_far = self._start.distance(pose) >= self.get("distance")
        if not (self._is_first or is_far or self.child.status is Status.RUNNING):
            return Status.RUNNING
        self._is_first = False
        status = self.child.execute_tick()
        if status is Status.SUCCESS:
            self._start = pose
        return status


class SpeedController(NavigatorDecorator):
    """Ticks its child at once and after a new goal, then at a rate that grows with the robot's speed."""

    PORTS = (
        *inputs(min_rate=("double", 0.1), max_rate=("double", 1.0)),
        *inputs(min_speed=("double", 0.0), max_speed=("double", 0.5)),
        *_GOAL,
    )
    _goal: Any = None
    _start = 0
    _is_first = False

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._odometer = self.context.odometer

    def tick(self) -> Status:
        """Tick the child if it is due or running."""
        now, goal = self.context.now_ns(), self.goal()
        if not self.status.is_active or goal != self._goal:
            self._period_ns = 1e9 / self.get("max_rate")
            self._start, self._is_first, self._goal = now, True, goal
        self.set_status(Status.RUNNING)
        is_due = now - self._start >= self._period_ns
        if not (self._is_first or is_due or self.child.status is Status.RUNNING):
            return Status.RUNNING
        self._is_first = False
        if is_due:
            self._period_ns, self._start = 1e9 / self._rate(), now
        return self.child.execute_tick()

    def _rate(self) -> float:
        lowest, highest = self.get("min_rate"), self.get("max_rate")
        slow, fast = self.get("min_speed"), self.get("max_speed")
        share = (self._odometer.speed - slow) / (fast - slow) if fast > slow else 1.0
        return float(min(max(lowest + share * (highest - lowest), lowest), highest))


class GoalUpdatedController(NavigatorDecorator):
    """Ticks its child at once, then whenever the goal has changed; runs in between."""

    PORTS = _GOAL
    _goal: Any = None
    _was_updated = False

    def tick(self) -> Status:
        """Tick the child if the goal is new, or if it is running."""
        goal = self.goal()
        if not self.status.is_active or goal != self._goal:
            self._goal, self._was_updated = goal, True
        self.set_status(Status.RUNNING)
        if not (self._was_updated or self.child.status is Status.RUNNING):
            return Status.RUNNING
        self._was_updated = False
        return self.child.execute_tick()


class GoalUpdater(NavigatorDecorator):
    """Gives its child the goal of `goal_update` (`goals_update`), if that is newer than its own."""

    PORTS = (
        *inputs(input_goal="message", input_goals="message"),
        *outputs(output_goal="message", output_goals="message"),
    )

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._goal = self.context.latest(PoseStamped, "goal_update")
        self._goals = self.context.latest(Goals, "goals_update")

    def tick(self) -> Status:
        """Write the newer goal, and tick the child."""
        goal, newer = self.get("input_goal"), self._goal.message
        if newer is not None and ns(newer.header.stamp) and (goal is None or _age(newer) >= _age(goal)):
            goal = newer
        self.put("output_goal", goal)
        goals, newest = self.get("input_goals"), self._goals.message
        if newest is not None and newest.goals and ns(newest.header.stamp):
            goals = list(newest.goals)
        self.put("output_goals", goals)
        return self.child.execute_tick()


def _age(message: Any) -> int:
    return ns(message.header.stamp)


class PathLongerOnApproach(NavigatorDecorator):
    """Ticks its child when near the goal a new path is much longer than the old one; else succeeds."""

    PORTS = inputs(path="message", prox_len=("double", 3.0), length_factor=("double", 2.0))
    _old: Any = None
    _is_first = True

    def tick(self) -> Status:
        """Compare the paths."""
        path = self.get("path") or new(Path)
        old = self._old if self._old is not None else new(Path)
        if not old.poses or not path.poses or old.poses[-1].pose != path.poses[-1].pose:
            self._is_first = True
        self.set_status(Status.RUNNING)
        if not self._is_first and path is not old and self._is_much_longer(path, old):
            status = self.child.execute_tick()
            if status.is_completed:
                self._old = path
            return status
        self._old, self._is_first = path, False
        return Status.SUCCESS

    def _is_much_longer(self, path: Any, old: Any) -> bool:
        before = paths.length(path_array(old))
        now = paths.length(path_array(path))
        return bool(before < self.get("prox_len") and now > self.get("length_factor") * before)
