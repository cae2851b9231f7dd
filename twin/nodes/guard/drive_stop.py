"""`/guard` of a simulated robot: the emergency stop at its wheels, in the words of `twin guard`."""

from __future__ import annotations

from twin.bridge.bus import Bus
from twin.bridge.msgs import new
from twin.bridge.services import Client, Service
from twin.bridge.srvs import CancelGoal
from twin.controllers.diff_drive import DiffDriveController
from twin.controllers.emergency_stop import EmergencyStop
from twin.nodes.guard.status import GuardStatus
from twin.nodes.guard.stop_topics import STATUS_PERIOD_NS, StopTopics

_MOVING = ("nav2_msgs::action::", "control_msgs::action::dds_::FollowJointTrajectory_")
"""Types of the actions that move a robot. A gripper's is none of them: it keeps what it holds."""
_SENT = "/_action/send_goal"


class DriveStopNode:
    """Brakes a drive past everything that commands it, and cancels what moves its robot, until a release.

    A release moves nothing by itself: a goal that is sent while the robot is stopped is cancelled, too.
    """

    def __init__(
        self, bus: Bus, drive: DiffDriveController, *, deceleration: float, namespace: str = ""
    ) -> None:
        """Let the robot move.

        Args:
            bus: Of its process.
            drive: What brakes.
            deceleration: Of the base along its path [m/s²].
            namespace: Of the robot.
        """
        self.node = node = bus.create_node("guard", namespace)
        self.latch = EmergencyStop()
        self._bus, self._drive, self._deceleration = bus, drive, deceleration
        self._clients: dict[str, Client] = {}
        """By the name of the action."""
        self._topics = StopTopics(
            node,
            self.latch,
            state=self._state,
            on_change=self._on_change,
            now=lambda: node.now_ns,
            on_demand=True,
        )
        node.create_timer(STATUS_PERIOD_NS, self._update)
        self._topics.tell()

    def _state(self) -> GuardStatus:
        return GuardStatus(
            stamp_ns=self.node.now_ns,
            stopped_by=self.latch.stopped_by,
            stops=self.latch.stops,
            in_charge="",
            warnings=(),
            verdicts={},
        )

    def _on_change(self) -> None:
        if self.latch.stopped_by is None:
            self._drive.release()
        else:
            self._drive.stop(self._deceleration)
            self._cancel_goals()

    def _update(self) -> None:
        if self._bus.networked:  # who looks from outside takes three missing ones for a guard that has gone
            self._topics.tell()
        if self.latch.stopped_by is not None:
            self._cancel_goals()

    def _cancel_goals(self) -> None:
        """Cancel all goals of the robot's own servers; what others send is refused by the drive."""
        prefix = f"{self.node.namespace.rstrip('/')}/"
        served = [each for node in self._bus.nodes for each in node.endpoints if isinstance(each, Service)]
        for each in served:
            action = each.name.removesuffix(_SENT)
            is_served = each.name.startswith(prefix) and action != each.name
            if is_served and each.interface.dds_name.startswith(_MOVING):
                if action not in self._clients:
                    asked = f"{action}/_action/cancel_goal"
                    self._clients[action] = self.node.create_client(CancelGoal, asked)
                self._clients[action].call_async(new(CancelGoal.Request))
