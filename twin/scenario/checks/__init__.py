"""The checks of a scenario: `CheckEntry` is one item of its list, `Check` the fold that it builds."""

from __future__ import annotations

from twin.scenario.checks.check import Check as Check
from twin.scenario.checks.check import CheckConfig
from twin.scenario.checks.check import CheckResult as CheckResult
from twin.scenario.checks.delivered import DeliveredConfig
from twin.scenario.checks.localisation import LocalisationErrorConfig, OdometryDriftConfig
from twin.scenario.checks.map_quality import MapAccuracyConfig, MapCoverageConfig
from twin.scenario.checks.mission import MissionFailedConfig, MissionSucceededConfig, TimeLimitConfig
from twin.scenario.checks.no_collision import NoCollisionConfig
from twin.scenario.checks.path import ClosedLoopConfig, FinalPoseConfig, PathOnCircleConfig
from twin.scenario.checks.recoveries import RecoveriesConfig
from twin.scenario.checks.totals import DrivenDistanceConfig, EnergyConfig
from twin.scenario.checks.tote_slip import ToteSlipConfig
from twin.scenario.fields import OneOf
from twin.scenario.observation import CheckContext


class CheckEntry(OneOf):
    """One check: exactly one of these keys."""

    mission_succeeded: MissionSucceededConfig | None = None
    """The mission ends and succeeded."""
    mission_failed: MissionFailedConfig | None = None
    """The mission gives up, and says why: for scenarios in which it must."""
    delivered: DeliveredConfig | None = None
    """A tote stands in a zone, upright, released and at rest."""
    time_limit: TimeLimitConfig | None = None
    """The mission is done in time."""
    no_collision: NoCollisionConfig | None = None
    """Robots touch only what they may."""
    tote_slip: ToteSlipConfig | None = None
    """Carried totes do not slip in the gripper."""
    localisation_error: LocalisationErrorConfig | None = None
    """The estimated pose stays near the true one."""
    odometry_drift: OdometryDriftConfig | None = None
    """Dead reckoning is off by no more than this at the end."""
    driven_distance: DrivenDistanceConfig | None = None
    """The length of the path lies between two bounds."""
    recoveries: RecoveriesConfig | None = None
    """The navigator recovers as often as expected."""
    map_accuracy: MapAccuracyConfig | None = None
    """The walls of the map that the robot made are where the true ones are."""
    map_coverage: MapCoverageConfig | None = None
    """What the robot can get to is on its map."""
    energy: EnergyConfig | None = None
    """The actuators use no more than this."""
    final_pose: FinalPoseConfig | None = None
    """The run ends with the robot at a pose."""
    path_on_circle: PathOnCircleConfig | None = None
    """The robot stays on a circle."""
    closed_loop: ClosedLoopConfig | None = None
    """The robot comes back to its start."""

    def build(self, context: CheckContext) -> Check:
        """Return a fresh fold."""
        config = self.config
        assert isinstance(config, CheckConfig)
        return config.build(self.kind, context)
