"""The checks of a scenario: `CHECKS` are all kinds, `CheckEntry` is one item of the file's list."""

from __future__ import annotations

from twin.plugins import Kind
from twin.scenario.checks.check import Check as Check
from twin.scenario.checks.check import CheckResult as CheckResult
from twin.scenario.checks.check import GuardedCheck
from twin.scenario.observation import CheckContext
from twin.scenario.plugins import OneOfKind, PluginUse, with_shipped

CHECKS: Kind[Check] = Kind("check", base="twin.scenario.checks:Check", group="twin.checks")

CHECKS.register("mission_succeeded", "twin.scenario.checks.mission:MissionSucceeded")
CHECKS.register("mission_failed", "twin.scenario.checks.mission:MissionFailed")
CHECKS.register("delivered", "twin.scenario.checks.goods:Delivered")
CHECKS.register("time_limit", "twin.scenario.checks.mission:TimeLimit")
CHECKS.register("no_collision", "twin.scenario.checks.no_collision:NoCollision")
CHECKS.register("tote_slip", "twin.scenario.checks.goods:ToteSlip")
CHECKS.register("localisation_error", "twin.scenario.checks.localisation:LocalisationError")
CHECKS.register("odometry_drift", "twin.scenario.checks.localisation:OdometryDrift")
CHECKS.register("driven_distance", "twin.scenario.checks.totals:DrivenDistance")
CHECKS.register("recoveries", "twin.scenario.checks.mission:Recoveries")
CHECKS.register("map_accuracy", "twin.scenario.checks.map_quality:MapAccuracy")
CHECKS.register("map_coverage", "twin.scenario.checks.map_quality:MapCoverage")
CHECKS.register("energy", "twin.scenario.checks.totals:Energy")
CHECKS.register("final_pose", "twin.scenario.checks.path:FinalPose")
CHECKS.register("path_on_circle", "twin.scenario.checks.path:PathOnCircle")
CHECKS.register("closed_loop", "twin.scenario.checks.path:ClosedLoop")
for _kind in ("always", "never", "eventually", "finally", "until", "within", "reaches", "formula"):
    CHECKS.register(_kind, f"twin.scenario.checks.temporal:{_kind.capitalize()}Check")


@with_shipped
class CheckEntry(OneOfKind):
    """One check: exactly one of these keys, or the name of a check of a user."""

    of = CHECKS

    def subjects(self) -> dict[str, str | None]:
        """Return the names that the check refers to, by field: `robot`, `tote`, `zone`."""
        given = self.config.params if isinstance(self.config, PluginUse) else vars(self.config)
        return {field: given[field] for field in ("robot", "tote", "zone") if field in given}

    def build(self, context: CheckContext) -> Check:
        """Return a fresh fold; runs the file of a user's check."""
        plugin, config = self.resolved()
        subject = getattr(config, "subject", None) or getattr(config, "tote", None)
        subject = subject or getattr(config, "robot", None)
        name = plugin.name if subject is None else f"{plugin.name}({subject})"
        check = plugin.create(name, config, context)
        return check if plugin.ships else GuardedCheck(plugin, check)
