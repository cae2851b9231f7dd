"""The mission of an agent that picks: over when the gripper holds the tote up."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from twin.nodes.missions.mission_node import PERIOD_NS
from twin.parameters import Metres, Positive, Seconds
from twin.warehouse.skills import MobileManipulationNode

if TYPE_CHECKING:
    from twin.runtime.stacks.missions import MissionContext


@dataclass(frozen=True, kw_only=True)
class HoldToteConfig:
    """Which tote, and what counts."""

    tote: str
    """Its name in the arena."""
    by: Annotated[Metres, Positive] = 0.05
    """How far the lift has to come up since the fingers closed on it."""
    time: Annotated[Seconds, Positive] = 0.5
    """For how long it has to be held there."""


class HoldTote(MobileManipulationNode):
    """Commands nothing: somebody else does. It knows what encoders and drives of the joints tell."""

    Config = HoldToteConfig

    def __init__(self, context: MissionContext, config: HoldToteConfig) -> None:
        stack, arena = context.robot, context.arena
        assert stack.manipulator is not None  # the robot and the arena are those of the scenario beside
        assert arena is not None
        super().__init__(
            context.bus,
            stack.manipulator.arm,
            gripper_joint=stack.manipulator.gripper_joint,
            gripper_open=stack.manipulator.gripper_open,
            robot_pose=stack.robot_pose,
            namespace=context.namespace,
        )
        self.tote = arena.tote(config.tote)
        self._config = config
        self._grip_effort = self.skills.gripper_effort
        self._height: float | None = None
        """Of the lift when the fingers closed [m]."""
        self._up_ns = 0
        self.node.create_timer(PERIOD_NS, self._look)

    def _look(self) -> None:
        lift = self._measured("position").get(self._arm.config.lift_joint)
        if self.done or lift is None:
            return
        if self._grip_fault(self.tote.size[1]) is not None:
            self._height, self._up_ns = None, 0
            self._tell("pick")
            return
        self._height = lift if self._height is None else self._height
        self._up_ns = self._up_ns + PERIOD_NS if lift >= self._height + self._config.by else 0
        self._tell("hold")
        if self._up_ns >= self._config.time * 1e9:
            self.finish(succeeded=True)

    def _tell(self, doing: str) -> None:
        if self.state != (state := f"{doing} {self.tote.name}"):
            self.enter(state)
