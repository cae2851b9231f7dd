"""Nav2's leaves that are services: clearing costmaps, validating paths (plugins/action)."""

from __future__ import annotations

from typing import Any, ClassVar

from twin.bridge import srvs
from twin.bridge.services import Future
from twin.bridge.types import ServiceType
from twin.navigation.behavior_trees.node import NodeSetup, Status
from twin.navigation.behavior_trees.ports import Port, inputs, outputs
from twin.nodes.navigation.behavior_trees.action_node import NavigatorNode

SERVICE_PORTS = inputs(service_name="string", server_timeout="unsigned")


class _Service(NavigatorNode):
    """Calls a service and waits for the answer (Nav2's BtServiceNode)."""

    SERVICE: ClassVar[ServiceType]
    NAME: ClassVar[str] = ""
    """Of the service, unless `service_name` gives another."""
    _asked: Future | None = None
    _asked_ns = 0

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._client = self.context.service_client(self.SERVICE, self.get("service_name") or self.NAME)

    def make_request(self) -> Any | None:
        """Return the request; None if there is nothing to ask, and the node fails."""
        return self.filled(self.SERVICE.Request)

    def on_completion(self, response: Any) -> Status:
        """Judge the answer."""
        return Status.SUCCESS if getattr(response, "success", True) else Status.FAILURE

    def tick(self) -> Status:
        """Ask, or look whether the answer is there."""
        if self._asked is None:
            request = self.make_request()
            if request is None:
                return Status.FAILURE
            self._asked = self._client.call_async(request)
            self._asked_ns = self.context.now_ns()
        if not self._asked.done:
            if not self.is_late(self._asked_ns):
                return Status.RUNNING
            self._asked.cancel()
        asked, self._asked = self._asked, None
        if asked.error is not None:
            self.context.node.get_logger().warn(f"{self.name}: {asked.error}")
            return Status.FAILURE
        return self.on_completion(asked.result)

    def halt(self) -> None:
        """Wait no more."""
        self._asked = None


class _Clear(_Service):
    """Counts as a recovery."""

    PORTS = (*SERVICE_PORTS, *inputs(plugins="strings", reset_distance=("double", 1.0), pose="message"))

    def make_request(self) -> Any | None:
        """Return the request with what this service knows of the ports."""
        self.count_recovery()
        return super().make_request()


class ClearEntireCostmap(_Clear):
    """Forgets every obstacle."""

    SERVICE = srvs.ClearEntireCostmap
    PORTS = (*SERVICE_PORTS, *inputs(plugins="strings"))


class ClearCostmapExceptRegion(_Clear):
    """Forgets obstacles outside of a square around the robot."""

    SERVICE = ServiceType("nav2_msgs/srv/ClearCostmapExceptRegion")
    PORTS = (*SERVICE_PORTS, *inputs(plugins="strings", reset_distance=("double", 1.0)))


class ClearCostmapAroundRobot(_Clear):
    """Forgets obstacles inside of a square around the robot."""

    SERVICE = srvs.ClearCostmapAroundRobot
    PORTS = (*SERVICE_PORTS, *inputs(plugins="strings", reset_distance=("double", 1.0)))


class ClearCostmapAroundPose(_Clear):
    """Forgets obstacles inside of a square around a pose."""

    SERVICE = ServiceType("nav2_msgs/srv/ClearCostmapAroundPose")


class IsPathValid(_Service):
    """Succeeds while the rest of a path is free; `ValidatePath` since Nav2 Lyrical."""

    SERVICE, NAME = srvs.IsPathValid, "is_path_valid"
    PORTS = (
        *SERVICE_PORTS,
        *inputs(path="message", max_cost=("unsigned", 254), consider_unknown_as_obstacle=("bool", False)),
        *inputs(layer_name=("string", ""), footprint=("string", "")),
        *inputs(stop_at_first_collision=("bool", True), max_lookahead_distance=("double", -1.0)),
        *outputs(collision_poses="message"),
    )

    def make_request(self) -> Any | None:
        """Return the request, without those ports that this version of the service does not have."""
        self._path = self.get("path")
        return super().make_request()

    def on_completion(self, response: Any) -> Status:
        """Write the poses in collision, as far as the answer names them."""
        if response.is_valid:
            self.put("collision_poses", [])
            return Status.SUCCESS
        poses = self._path.poses if self._path is not None else []
        self.put("collision_poses", [poses[i] for i in response.invalid_pose_indices if 0 <= i < len(poses)])
        return Status.FAILURE


class ReinitializeGlobalLocalization(_Service):
    """Lets localisation look everywhere."""

    SERVICE, NAME = srvs.Empty, "reinitialize_global_localization"
    PORTS: ClassVar[tuple[Port, ...]] = SERVICE_PORTS


class ToggleCollisionMonitor(_Service):
    """Switches the collision monitor."""

    SERVICE, NAME = srvs.Toggle, "collision_monitor/toggle"
    PORTS: ClassVar[tuple[Port, ...]] = (*SERVICE_PORTS, *inputs(enable=("bool", True)))
