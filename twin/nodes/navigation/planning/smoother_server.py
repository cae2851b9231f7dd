"""`/smoother_server`: the `smooth_path` action, over the global costmap."""

from __future__ import annotations

from collections.abc import Generator, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np

from twin.bridge.action_types import SmoothPath
from twin.bridge.actions import ActionServer, GoalHandle
from twin.bridge.bus import Bus
from twin.bridge.msgs import duration, new
from twin.geometry import Array
from twin.navigation.costmaps.costmap import INSCRIBED_INFLATED_OBSTACLE, NO_INFORMATION, Costmap
from twin.navigation.planning.config import SavitzkyGolayConfig, SmootherConfig
from twin.navigation.plugins import SMOOTHERS, create
from twin.nodes.messages import path_array, path_msg
from twin.nodes.navigation.costmaps.costmap import CostmapNode
from twin.nodes.node_parameters import declare_config
from twin.parameters import Flat

_INVALID_SMOOTHER, _IN_COLLISION, _INVALID_PATH = 501, 503, 505
"""Codes of nav2_msgs/action/SmoothPath."""


@dataclass(frozen=True, kw_only=True)
class SmootherServerConfig:
    """Parameters of the server's plugins by name; the first one is used unless a request names another."""

    smoothers: Annotated[Mapping[str, Any], Flat] = field(
        default_factory=lambda: {"simple_smoother": SmootherConfig(), "savitzky_golay": SavitzkyGolayConfig()}
    )


class SmootherServerNode:
    """Smooths paths on request."""

    def __init__(
        self,
        bus: Bus,
        costmap: CostmapNode,
        config: SmootherServerConfig | None = None,
        *,
        namespace: str = "",
    ) -> None:
        self.node = bus.create_node("smoother_server", namespace)
        self._costmap = costmap
        self._apply(config or SmootherServerConfig())
        declare_config(self.node, config or SmootherServerConfig(), self._apply)
        ActionServer(self.node, SmoothPath, "smooth_path", self._execute)

    def _apply(self, config: SmootherServerConfig) -> None:
        self._smoothers = {name: create(SMOOTHERS, plugin) for name, plugin in config.smoothers.items()}

    def _execute(self, handle: GoalHandle) -> Generator[None, None, Any]:
        yield
        request, costmap = handle.request, self._costmap.costmap
        smoother = self._smoothers.get(request.smoother_id or next(iter(self._smoothers)))
        path = path_array(request.path)
        if smoother is None:
            valid = ", ".join(self._smoothers)
            return self._failed(handle, _INVALID_SMOOTHER, f"{request.smoother_id!r} is none; valid: {valid}")
        if len(path) < 2:
            return self._failed(handle, _INVALID_PATH, "the path has no two poses")
        if not np.isfinite(path).all():
            row = int(np.argmin(np.isfinite(path).all(axis=1)))
            return self._failed(handle, _INVALID_PATH, f"pose {row} of the path is not finite")
        smooth = smoother.smooth(path, costmap)
        if request.check_for_collisions and costmap is not None and _collides(smooth, costmap):
            return self._failed(handle, _IN_COLLISION, "the smoothed path collides")
        message = path_msg(smooth, request.path.header.frame_id, self.node.now_ns)
        return new(SmoothPath.Result, path=message, smoothing_duration=duration(0), was_completed=True)

    def _failed(self, handle: GoalHandle, code: int, message: str) -> Any:
        handle.abort()
        return new(SmoothPath.Result, error_code=code, error_msg=message)


def _collides(path: Array, costmap: Costmap) -> bool:
    costs = [costmap.cost_at(x, y) for x, y in path[:, :2].tolist()]
    return any(cost >= INSCRIBED_INFLATED_OBSTACLE and cost != NO_INFORMATION for cost in costs)
