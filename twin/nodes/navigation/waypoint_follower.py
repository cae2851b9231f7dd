"""`/waypoint_follower`: the action `follow_waypoints`, as in Nav2 with its plugin WaitAtWaypoint."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, field, replace
from itertools import chain
from typing import Annotated, Any

from twin.bridge import types
from twin.bridge.action_types import FollowWaypoints, NavigateToPose
from twin.bridge.actions import ActionClient, ActionServer, ClientGoal, GoalHandle
from twin.bridge.bus import Bus
from twin.bridge.msgs import header, new
from twin.bridge.node.tasks import Steps
from twin.bridge.node.timers import Beat
from twin.nodes.node_parameters import declare_config
from twin.parameters import Interval

MissedWaypoint: Any = types.get("nav2_msgs/msg/MissedWaypoint")
_MS = 1_000_000
_NO_VALID_WAYPOINTS, _STOP_ON_MISSED_WAYPOINT = 602, 603
"""Of Nav2 since Kilted; nav2_msgs of Jazzy has no names for them."""


@dataclass(frozen=True, kw_only=True)
class WaitAtWaypointConfig:
    """Parameters of nav2_waypoint_follower::WaitAtWaypoint."""

    enabled: bool = True
    """Whether it does."""
    waypoint_pause_duration: Annotated[int, Interval(ge=0, le=1_000_000_000)] = 0
    """How long to stand at each waypoint [ms]."""


@dataclass(frozen=True, kw_only=True)
class WaypointFollowerConfig:
    """Parameters; names and defaults are those of nav2_waypoint_follower."""

    stop_on_failure: bool = True
    """Whether the first waypoint that is missed ends the action."""
    loop_rate: Annotated[int, Interval(ge=1, le=1000)] = 20
    """How often the follower looks and tells its feedback [Hz]."""
    wait_at_waypoint: WaitAtWaypointConfig = field(default_factory=WaitAtWaypointConfig)
    """What is done at each waypoint."""


class WaypointFollowerNode:
    """Sends waypoint after waypoint to `navigate_to_pose`."""

    def __init__(
        self, bus: Bus, config: WaypointFollowerConfig | None = None, *, namespace: str = ""
    ) -> None:
        self.node = bus.create_node("waypoint_follower", namespace)
        self.config = config or WaypointFollowerConfig()
        declare_config(self.node, self.config, self._reconfigure)
        self._navigate = ActionClient(self.node, NavigateToPose, "navigate_to_pose")
        ActionServer(self.node, FollowWaypoints, "follow_waypoints", self._execute)

    def _reconfigure(self, config: WaypointFollowerConfig) -> None:
        self.config = config

    def _execute(self, handle: GoalHandle) -> Steps:
        goal = handle.request
        first, loops = int(goal.goal_index), int(goal.number_of_loops)
        if first >= len(goal.poses):
            handle.abort()
            what = (
                f"waypoint {first} of {len(goal.poses)} is asked for first" if goal.poses else "no waypoints"
            )
            return new(FollowWaypoints.Result, error_code=_NO_VALID_WAYPOINTS, error_msg=what)
        missed: list[Any] = []
        count = len(goal.poses)
        # One by one: whoever wants to go round for ever asks for four thousand million loops.
        again = (index for _ in range(loops) for index in range(count))
        for index in chain(range(first, count), again):
            sent = yield from self._visit(handle, goal.poses[index], index)
            if sent is None:
                handle.canceled()
                return new(FollowWaypoints.Result, missed_waypoints=missed, error_msg="canceled")
            if sent.succeeded:
                continue
            code = int(getattr(sent.result, "error_code", 0))
            missed.append(MissedWaypoint(index=index, goal=goal.poses[index], error_code=code))
            reason = getattr(sent.result, "error_msg", "") or sent.error or "aborted"
            self.node.get_logger().warn(f"waypoint {index} missed: {reason}")
            if self.config.stop_on_failure:
                handle.abort()
                return new(
                    FollowWaypoints.Result,
                    missed_waypoints=missed,
                    error_code=_STOP_ON_MISSED_WAYPOINT,
                    error_msg=f"waypoint {index} missed: {reason}",
                )
        return new(FollowWaypoints.Result, missed_waypoints=missed)

    def _visit(self, handle: GoalHandle, pose: Any, index: int) -> Generator[int, None, ClientGoal | None]:
        """Go to a waypoint and stay there for the pause; None if the follower is to stop."""
        frame = pose.header.frame_id
        stamped = replace(pose, header=header(self.node.now_ns, frame))
        sent = self._navigate.send_goal(new(NavigateToPose.Goal, pose=stamped))
        try:
            beat = Beat(self.node.get_clock())
            while not sent.done:
                if handle.is_cancel_requested:
                    return None
                if beat.late_ns >= 0:
                    beat.put_off(round(1e9 / self.config.loop_rate))
                    handle.publish_feedback(new(FollowWaypoints.Feedback, current_waypoint=index))
                yield beat.due_ns
        finally:
            if not sent.done:
                sent.cancel()
        wait = self.config.wait_at_waypoint
        if sent.succeeded and wait.enabled:
            pause = Beat(self.node.get_clock())
            pause.put_off(wait.waypoint_pause_duration * _MS)
            while pause.late_ns < 0:
                if handle.is_cancel_requested:
                    return None
                yield pause.due_ns
        return sent
