"""Whether the robot still gets anywhere: nav2_controller's SimpleProgressChecker."""

from __future__ import annotations

from dataclasses import dataclass, field

from twin.geometry import Pose2


@dataclass(frozen=True, kw_only=True)
class ProgressCheckerConfig:
    """Parameters; names and defaults are Nav2's."""

    required_movement_radius: float = 0.5
    """[m]"""
    movement_time_allowance: float = 10.0
    """[s]"""


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
        """Return False when the robot has not left the circle within the allowance.

        Args:
            pose: Of the base, in a fixed frame.
            time_ns: Now [ns].
        """
        config = self.config
        if self._baseline is None or self._baseline[0].distance(pose) > config.required_movement_radius:
            self._baseline = (pose, time_ns)
            return True
        return (time_ns - self._baseline[1]) * 1e-9 <= config.movement_time_allowance
