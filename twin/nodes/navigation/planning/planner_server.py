"""`/planner_server`: `compute_path_to_pose`, `compute_path_through_poses` and `is_path_valid`."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from twin.bridge.action_types import ComputePathThroughPoses, ComputePathToPose
from twin.bridge.actions import ActionServer, GoalHandle
from twin.bridge.bus import Bus
from twin.bridge.conversions import pose2_from_pose
from twin.bridge.msgs import Path, duration, new
from twin.bridge.srvs import IsPathValid
from twin.geometry import Array, Pose2
from twin.navigation.costmaps.costmap import Costmap
from twin.navigation.failures import InvalidPlanner, NoPose, NoViapoints, PlanningFailure
from twin.navigation.planning.config import (
    CommitmentConfig,
    GoalAccessConfig,
    SmootherConfig,
    ThetaStarConfig,
)
from twin.navigation.planning.earlier_paths import avoiding, committed
from twin.navigation.planning.goal_access import GoalAccess
from twin.navigation.planning.path_validity import blocked_poses
from twin.navigation.planning.planner import GlobalPlanner
from twin.navigation.plugins import PLANNERS, SMOOTHERS, config_of, create, plugin_of
from twin.navigation.warm_up import warm_up_planning
from twin.nodes.messages import path_msg
from twin.nodes.navigation.costmaps.costmap import CostmapNode
from twin.nodes.navigation.planning.config import PlannerServerConfig
from twin.nodes.navigation.robot_pose import RobotPose
from twin.nodes.node_parameters import declare_config
from twin.parameters import Flat, Name, ReadOnly
from twin.parameters.declaration import names_of

DEFAULT_ID = "GridBased"
"""Nav2's name for the planner that is used unless a request names another one."""


@dataclass(frozen=True, kw_only=True)
class PlannerParameters:
    """Parameters of the server and its plugins."""

    planner_plugins: Annotated[tuple[str, ...], ReadOnly]
    """Names of the planners."""
    server: Annotated[PlannerServerConfig, Flat]
    """Of the server itself."""
    planner: Annotated[Any, Name(DEFAULT_ID)]
    """Of the planner that is used unless a request names another one."""
    commitment: Annotated[CommitmentConfig, Name(DEFAULT_ID)]
    """How strongly it stays with the last path."""
    goal_access: Annotated[GoalAccessConfig, Flat]
    """What becomes of goals that somebody stands on."""
    smoother: Annotated[Any, Name("smoother")]
    """How paths are smoothed."""


_SHARED = (names_of(ThetaStarConfig).tolerance, names_of(ThetaStarConfig).allow_unknown)


def _by_id(chosen: Any) -> dict[str, Any]:
    """Return the configs of all planners: the chosen one under its own name, too, the others like it."""
    own = plugin_of(PLANNERS, chosen).name
    shared = {name: getattr(chosen, name) for name in _SHARED if hasattr(chosen, name)}
    configs = {DEFAULT_ID: chosen}
    for name in PLANNERS.shipped:
        configs[name] = chosen if name == own else config_of(PLANNERS.find(name))(**shared)
    return {**configs, own: chosen}


class PlannerServerNode:
    """Plans on request; publishes `plan`.

    `planner_id` is `GridBased`, the configured planner, or a plugin's name: that one with its own
    defaults, but the tolerance and the unknown cells of the configured one.
    """

    def __init__(
        self,
        bus: Bus,
        robot_pose: RobotPose,
        costmap: CostmapNode,
        *,
        config: Any = None,
        server: PlannerServerConfig | None = None,
        smoother: Any = None,
        commitment: CommitmentConfig | None = None,
        goal_access: GoalAccessConfig | None = None,
        namespace: str = "",
    ) -> None:
        self.node = bus.create_node("planner_server", namespace)
        self._robot_pose = robot_pose
        self._costmap = costmap
        self._configs = _by_id(config or ThetaStarConfig())
        self._planners = {name: self._made(plugin) for name, plugin in self._configs.items()}
        self._tried: list[Array] = []
        self._last: tuple[Pose2, Array] | None = None
        """The goal of the last leg, and its path."""
        self._asked: tuple[Pose2, Pose2] | None = None
        warm_up_planning()
        parameters = PlannerParameters(
            planner_plugins=tuple(self._configs),
            server=server or PlannerServerConfig(),
            planner=self._configs[DEFAULT_ID],
            commitment=commitment or CommitmentConfig(),
            goal_access=goal_access or GoalAccessConfig(),
            smoother=smoother or SmootherConfig(),
        )
        self._polygon = np.array(costmap.config.layers.polygon, order="C")
        self._access = GoalAccess(footprint=self._polygon)
        self._apply(parameters)
        declare_config(self.node, parameters, self._apply)
        self._publisher = self.node.create_publisher(Path, "plan", 1)
        self.node.create_service(IsPathValid, "is_path_valid", self._on_is_path_valid)
        ActionServer(self.node, ComputePathToPose, "compute_path_to_pose", self._to_pose)
        ActionServer(self.node, ComputePathThroughPoses, "compute_path_through_poses", self._through_poses)

    def _made(self, config: Any) -> GlobalPlanner:
        layers = self._costmap.config.layers
        return create(PLANNERS, config, footprint=layers.polygon, inflation_radius=layers.inflation_radius)

    def _apply(self, parameters: PlannerParameters) -> None:
        """Plan the next path with these parameters."""
        self._server = parameters.server
        self._commitment = parameters.commitment
        self._access.config = parameters.goal_access
        self._smoother = create(SMOOTHERS, parameters.smoother)
        if parameters.planner != self._configs[DEFAULT_ID]:
            self._configs[DEFAULT_ID] = parameters.planner
            self._planners[DEFAULT_ID] = self._made(parameters.planner)

    def _to_pose(self, handle: GoalHandle) -> Generator[None, None, Any]:
        return (yield from self._compute(handle, ComputePathToPose.Result, [handle.request.goal], 0))

    def _through_poses(self, handle: GoalHandle) -> Generator[None, None, Any]:
        # The codes of this action are those of the other one, a hundred higher.
        goals = list(handle.request.goals)
        return (yield from self._compute(handle, ComputePathThroughPoses.Result, goals, 100))

    def _compute(
        self, handle: GoalHandle, result: Any, goals: list[Any], code_offset: int
    ) -> Generator[None, None, Any]:
        """Plan leg by leg; between legs other nodes run, and a request to cancel is heeded."""
        request = handle.request
        try:
            if not goals:
                raise NoViapoints("no goals are given; valid is one at least")
            here = self._start(request)
            name = request.planner_id or DEFAULT_ID
            if name not in self._planners:
                raise InvalidPlanner(f"{name!r} is no planner; valid: {', '.join(self._planners)}")
            legs = []
            for goal in goals:
                yield
                if handle.is_cancel_requested:
                    handle.canceled()
                    return new(result)
                there = self._in_map(goal)
                legs.append(self._leg(name, here, there))
                here = Pose2(*map(float, legs[-1][-1]))
        except PlanningFailure as failure:
            handle.abort()
            return new(result, error_code=failure.error_code + code_offset, error_msg=str(failure))
        whole = np.concatenate([legs[0], *(leg[1:] for leg in legs[1:])])
        path = path_msg(whole, self._robot_pose.frames.map, self.node.now_ns)
        self._publisher.publish(path)
        return new(result, path=path, planning_time=duration(0))

    def _leg(self, name: str, start: Pose2, goal: Pose2) -> Array:
        costmap, planner = self._open_costmap(start, goal), self._planners[name]
        if self._commitment.commitment_cost and self._last is not None and self._last[0] == goal:
            costmap = committed(costmap, self._last[1], self._commitment)
        tried = self._tried_before(start, goal)
        path = planner.create_plan(avoiding(costmap, tried) if tried else costmap, start, goal)
        self._tried.append(path)
        self._last = (goal, path)
        if planner.drivable:
            return path
        smooth = self._smoother.smooth(path, costmap)
        # A smooth path needs no point per cell; the message costs by the point.
        return np.concatenate([smooth[:-1:2], smooth[-1:]])

    def _tried_before(self, start: Pose2, goal: Pose2) -> list[Array]:
        """Return the paths that this goal got from this place; begin anew if it is another goal or place."""
        asked, self._asked = self._asked, (start, goal)
        again = asked is not None and asked[1] == goal and asked[0].distance(start) < self._server.same_place
        if not again or len(self._tried) > self._server.compute_alternatives:
            self._tried = []
        return self._tried

    def _open_costmap(self, start: Pose2, goal: Pose2) -> Costmap:
        costmap, known = self._costmap.costmap, self._costmap.known
        if costmap is None:
            raise NoPose("no plan without map")
        if known is None:
            return costmap
        robot = self._robot_pose.in_map() or start
        return self._access.open_to(goal, robot, costmap, known, self.node.now_ns)

    def _start(self, request: Any) -> Pose2:
        if request.use_start:
            return self._in_map(request.start)
        pose = self._robot_pose.in_map()
        if pose is None:
            raise NoPose("no plan without localisation")
        return pose

    def _in_map(self, stamped: Any) -> Pose2:
        """Return a stamped pose in the map frame."""
        pose, frame = pose2_from_pose(stamped.pose), stamped.header.frame_id
        map_frame = self._robot_pose.frames.map
        if frame in ("", map_frame):
            return pose
        T_map_frame = self._robot_pose.relative(map_frame, frame)
        if T_map_frame is None:
            raise NoPose(f"frame {frame!r} has no transform to {map_frame!r}")
        return T_map_frame @ pose

    def _on_is_path_valid(self, request: Any) -> Any:
        """Answer whether the rest of a path, from the pose nearest to the robot on, is free."""
        path, robot = self._robot_pose.path_in_map(request.path), self._robot_pose.in_map()
        costmap, known = self._costmap.costmap, self._costmap.known
        if path is None or not len(path) or costmap is None or robot is None:
            return new(IsPathValid.Response, is_valid=False)
        away = float(np.hypot(path[:, 0] - robot.x, path[:, 1] - robot.y).min())
        end = Pose2(*path[-1].tolist())
        lost = known is not None and self._access.is_lost(end, robot, costmap, known)
        if lost or away > self._server.path_distance:
            return new(IsPathValid.Response, is_valid=False)
        indices = blocked_poses(path, robot, costmap, known, self._polygon)
        return new(IsPathValid.Response, is_valid=not indices.size, invalid_pose_indices=indices)
