"""The truth about what a camera sees, for training and for checks: labels, and boxes around things."""

from __future__ import annotations

import colorsys
from typing import Any, Protocol, cast

import numpy as np
from numpy.typing import NDArray

from twin.bridge.msgs import (
    CameraInfo,
    Detection2D,
    Detection2DArray,
    Header,
    Image,
    LabelInfo,
    ObjectHypothesisWithPose,
    VisionClass,
    new,
)
from twin.nodes.cameras import messages
from twin.nodes.cameras.camera import CameraDevice, CameraPublisher

_GROUND = "floor"
_GOLDEN = 0.618034
"""Steps of it around the circle of hues come nowhere near each other."""


class Labelling(Protocol):
    """Things by number, and their kinds; 0 is the background."""

    things: tuple[str, ...]
    kinds: tuple[str, ...]
    kind_of: NDArray[np.uint16]


class TrueCameraDevice(CameraDevice, Protocol):
    """A camera that knows what it sees: a simulated one."""

    @property
    def labels(self) -> Labelling:
        """What the numbers of `things` mean."""

    def things(self) -> NDArray[np.uint16]:
        """Return the number of the thing that each pixel shows, shape (height, width)."""


class TruthPublisher(CameraPublisher):
    """Publishes what things one camera sees. It is ground truth, and no robot has it."""

    def _offered(self) -> dict[str, tuple[type, str]]:
        topics = self.spec.topics
        offered: dict[str, tuple[type, str]] = {"info": (CameraInfo, topics.info)}
        if self.spec.truth == "boxes":
            return {**offered, "boxes": (Detection2DArray, topics.boxes)}
        return {
            **offered,
            "labels": (Image, topics.labels_map),
            "colored": (Image, topics.colored_map),
            "label_info": (LabelInfo, topics.label_info),
        }

    def _said(self, wanted: set[str], time_ns: int, header: Header) -> dict[str, Any]:
        device = cast(TrueCameraDevice, self.sensor)
        said: dict[str, Any] = {}
        if "info" in wanted:
            said["info"] = messages.camera_info(header, self._lens)
        labels = self._seen(lambda: device.labels) if wanted - {"info"} else None
        if labels is None:
            return said
        is_semantic = self.spec.truth == "semantic"
        if "label_info" in wanted:
            said["label_info"] = label_info(header, labels.kinds if is_semantic else labels.things)
        if wanted & {"labels", "colored", "boxes"}:
            things = device.things()
            shown = labels.kind_of[things] if is_semantic else things
            if "labels" in wanted:
                said["labels"] = messages.image(header, shown, "16UC1")
            if "colored" in wanted:
                said["colored"] = messages.image(header, coloured(shown), "rgb8")
            if "boxes" in wanted:
                said["boxes"] = boxes(header, things, labels)
        return said


def label_info(header: Header, names: tuple[str, ...]) -> LabelInfo:
    """Return what the numbers of an image of labels mean."""
    classes = [VisionClass(number, name) for number, name in enumerate(names)]
    return LabelInfo(header=header, class_map=classes, threshold=0.0)


def coloured(numbers: NDArray[np.uint16]) -> NDArray[np.uint8]:
    """Return a colour for each number, the same always, shape (height, width, 3); 0 is black."""
    hues = (np.arange(int(numbers.max(initial=0)) + 1) * _GOLDEN) % 1.0
    palette = np.array([colorsys.hsv_to_rgb(hue, 0.65, 0.95) for hue in hues])
    palette[0] = 0.0
    return np.rint(255.0 * palette).astype(np.uint8)[numbers]


def boxes(header: Header, things: NDArray[np.uint16], labels: Labelling) -> Detection2DArray:
    """Return the smallest box around what is visible of each thing, ordered by number; none of the floor.

    Edges are those of the pixels, half a pixel from their centres.
    """
    detections = []
    for number in np.unique(things):
        name = labels.things[number]
        if number == 0 or name == _GROUND:
            continue
        v, u = np.nonzero(things == number)
        found, kind = new(Detection2D), new(ObjectHypothesisWithPose)
        kind.hypothesis.class_id, kind.hypothesis.score = labels.kinds[labels.kind_of[number]], 1.0
        found.header, found.id, found.results = header, name, [kind]
        found.bbox.center.position.x = float(u.min() + u.max()) / 2.0
        found.bbox.center.position.y = float(v.min() + v.max()) / 2.0
        found.bbox.size_x, found.bbox.size_y = float(np.ptp(u) + 1), float(np.ptp(v) + 1)
        detections.append(found)
    return Detection2DArray(header=header, detections=detections)
