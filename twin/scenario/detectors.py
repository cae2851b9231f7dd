"""What finds the boxes that a robot's gripper is to take."""

from __future__ import annotations

from collections.abc import Sequence

from twin.geometry import Array, Pose2
from twin.navigation.docking.faces import Detector
from twin.plugins import Kind, Plugin, require_finite
from twin.scenario.plugins import OneOfKind, with_shipped

DETECTORS: Kind[Detector] = Kind(
    "detector", base="twin.navigation.docking.faces:Detector", group="twin.detectors"
)
DETECTORS.register("box_faces", "twin.navigation.docking.faces:BoxFaces")


@with_shipped
class DetectorEntry(OneOfKind):
    """One detector: exactly one of these keys, or the name of a detector of a user."""

    of = DETECTORS

    def build(self) -> Detector:
        """Return the detector; runs the file of a user's."""
        plugin, config = self.resolved()
        made: Detector = plugin.create(config)
        return made if plugin.ships else _GuardedDetector(plugin, made)


class _GuardedDetector(Detector):
    """Hands scans on to a user's detector."""

    def __init__(self, plugin: Plugin[Detector], detector: Detector) -> None:
        super().__init__(getattr(detector, "config", None))
        self._plugin, self._detector = plugin, detector

    def detect(self, points: Array) -> Sequence[Pose2]:
        """Return what it finds; raises PluginError if that is no list of finite poses."""
        with self._plugin.guard:
            found = self._detector.detect(points)
        if not isinstance(found, Sequence) or not all(isinstance(pose, Pose2) for pose in found):
            raise self._plugin.error("must return a list of Pose2 from detect(points)")
        require_finite(self._plugin, "a pose", [value for p in found for value in (p.x, p.y, p.yaw)])
        return found
