"""What finds the boxes that a robot's gripper is to take in images, instead of the palm's lidar."""

from __future__ import annotations

from collections.abc import Sequence

from twin.perception.boxes.detector import Box, PictureDetector
from twin.perception.boxes.picture import Picture
from twin.plugins import Kind, Plugin, require_finite
from twin.scenario.plugins import OneOfKind, with_shipped

PICTURE_DETECTORS: Kind[PictureDetector] = Kind(
    "picture detector", base="twin.perception.boxes.detector:PictureDetector", group="twin.picture_detectors"
)
PICTURE_DETECTORS.register("depth_boxes", "twin.perception.boxes.detector:DepthBoxes")
PICTURE_DETECTORS.register("rgbd_boxes", "twin.perception.boxes.detector:ColourDepthBoxes")


@with_shipped
class PictureDetectorEntry(OneOfKind):
    """One detector: exactly one of these keys, or the name of a detector of a user."""

    of = PICTURE_DETECTORS

    def build(self) -> PictureDetector:
        """Return the detector; runs the file of a user's."""
        plugin, config = self.resolved()
        made: PictureDetector = plugin.create(config)
        return made if plugin.ships else _GuardedDetector(plugin, made)


class _GuardedDetector(PictureDetector):
    """Hands pictures on to a user's detector."""

    def __init__(self, plugin: Plugin[PictureDetector], detector: PictureDetector) -> None:
        super().__init__(getattr(detector, "config", None))
        self._plugin, self._detector = plugin, detector
        self.wants_colours = detector.wants_colours  # type: ignore[misc]

    def detect(self, picture: Picture) -> Sequence[Box]:
        """Return what it finds; raises PluginError if that is no list of boxes whose numbers are finite."""
        with self._plugin.guard:
            found = self._detector.detect(picture)
        if not isinstance(found, Sequence) or not all(isinstance(box, Box) for box in found):
            raise self._plugin.error("must return a list of Box from detect(picture)")
        values = [(*box.front.xyz, *box.front.quat_wxyz, box.width, box.height, box.score) for box in found]
        require_finite(self._plugin, "a box", [float(value) for box in values for value in box])
        return found
