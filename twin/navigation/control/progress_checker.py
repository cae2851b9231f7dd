"""Whether the robot still gets anywhere: nav2_controller's progress checkers."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Protocol

from twin.geometry import Pose2, wrap_angle
from twin.parameters import Metres, Positive, Radians, Seconds


class ProgressChecker(Protocol):
    """Asked once per control period."""

    def reset(self) -> None:
        """Start on a new path."""

    def check(self, pose: Pose2, time_ns: int) -> bool:
        """Return False when the robot has not moved enough within the allowance.

        Args:
            pose: Of the base, in a fixed frame.
            time_ns: Now [ns].
        """


@dataclass(frozen=True, kw_only=True)
class ProgressCheckerConfig:
    """Parameters; names and defaults are Nav2's."""

    required_movement_radius: Annotated[Metres, Positive] = 0.5
    """Movement that counts as progress."""
    movement_time_allowance: Annotated[Seconds, Positive] = 10.0
    """Time allowed for it."""


@dataclass(frozen=True, kw_only=True)
class PoseProgressCheckerConfig(ProgressCheckerConfig):
    """Parameters of PoseProgressChecker; names and defaults are Nav2's."""

    required_movement_angle: Annotated[Radians, Positive] = 0.5
    """Turning by this is progress too."""


@dataclass(kw_only=True)
class SimpleProgressChecker:
    """Asks for a movement out of a circle within a time."""

    config: ProgressCheckerConfig = field(default_factory=ProgressCheckerConfig)

    def __post_init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Start on a new path."""
        self._baseline: tuple[Pose2, int] | None = None

    def check(self, pose: Pose2, time_ns: int) -> bool:
        """Return False when the robot has not moved enough; see `ProgressChecker.check`."""
        if self._baseline is None or self._moved(self._baseline[0], pose):
            self._baseline = (pose, time_ns)
            return True
        return (time_ns - self._baseline[1]) * 1e-9 <= self.config.movement_time_allowance

    def _moved(self, before: Pose2, now: Pose2) -> bool:
        return before.distance(now) > self.config.required_movement_radius


@dataclass(kw_only=True)
class PoseProgressChecker(SimpleProgressChecker):
    """Lets a turn count as a movement, too."""

    config: PoseProgressCheckerConfig = field(default_factory=PoseProgressCheckerConfig)

    def _moved(self, before: Pose2, now: Pose2) -> bool:
        turned = abs(wrap_angle(now.yaw - before.yaw))
        return super()._moved(before, now) or turned > self.config.required_movement_angle
