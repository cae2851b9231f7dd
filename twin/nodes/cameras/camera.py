"""A camera's driver: images, JPEG pictures, depths and points, each made only while somebody wants it."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from typing import Any, Literal, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from twin.bridge.bus import Bus
from twin.bridge.msgs import CameraInfo, CompressedImage, Header, Image, PointCloud2, stamp
from twin.bridge.qos import SENSOR_DATA
from twin.bridge.tf import StaticTransformBroadcaster, transform_stamped
from twin.bridge.topics import Publisher
from twin.errors import SimulationError
from twin.models.description import RobotDescription
from twin.models.optical_frames import T_CAMERA_OPTICAL, optical_frame
from twin.models.specs import CameraSpec
from twin.nodes.cameras import messages

T = TypeVar("T")
_LOG = logging.getLogger("twin.camera")


class Seen(Protocol):
    """What a camera sees; what was not asked for is None."""

    @property
    def colours(self) -> NDArray[np.uint8] | None:
        """In its encoding, shape (height, width, 3), or (height, width) of `mono8`."""

    @property
    def depth(self) -> NDArray[np.float32] | None:
        """Z along the optical axis [m], shape (height, width); nan where there is none."""


class CameraDevice(Protocol):
    """A camera; simulated by `twin.sim`, or a physical one's driver."""

    @property
    def spec(self) -> CameraSpec:
        """What it is."""

    def look(self, time_ns: int, *, colours: bool, depth: bool) -> Seen:
        """Return what it sees at `time_ns`."""

    def open(self) -> None:
        """See that it can look.

        Raises:
            SimulationError: It cannot.
        """


class CameraPublisher:
    """Publishes what one camera sees; the runtime calls it when the camera is due.

    All messages of one time have one header. They are in an optical frame of REP-103: that of the file, or a
    link that is one, or `<name>_optical_frame`, which is then published on `tf_static`.
    """

    def __init__(
        self,
        bus: Bus,
        camera: CameraDevice,
        description: RobotDescription,
        *,
        namespace: str = "",
        need: Literal["optional", "required"] | None = None,
    ) -> None:
        """Offer the topics.

        Args:
            bus: Where.
            camera: What looks.
            description: The robot that it is on.
            namespace: Of its node.
            need: Whether a computer that draws nothing is put up with; None: as long as nobody who takes part
                in the run wants an image.

        Raises:
            SimulationError: It cannot look, and is required to.
        """
        self.sensor, self.spec = camera, camera.spec
        self.node = bus.create_node(f"{self.spec.name}_driver", namespace)
        self._need, self._is_blind = need, False
        self._lens = self.spec.lens
        self._publishers: Mapping[str, Publisher[Any]] = {
            what: self.node.create_publisher(kind, topic, SENSOR_DATA, on_demand=True)
            for what, (kind, topic) in self._offered().items()
        }
        self._frame, is_link = optical_frame(description, self.spec)
        self.T_link_optical = self.spec.T_link_sensor @ T_CAMERA_OPTICAL
        """Its optical frame in that of its link."""
        if not is_link:
            placed = self.T_link_optical
            self._static = StaticTransformBroadcaster(self.node)
            self._static.send_transform(
                transform_stamped(self.spec.link, self._frame, self.node.now_ns, placed)
            )
        if need == "required":
            camera.open()

    @property
    def pictures(self) -> str:
        """Absolute name of the topic of its JPEG pictures; empty if it makes none."""
        return self._publishers["jpeg"].name if "jpeg" in self._publishers else ""

    @property
    def depths(self) -> str:
        """Absolute name of the topic of its depth images; empty if it makes none."""
        return self._publishers["depth"].name if "depth" in self._publishers else ""

    @property
    def truths(self) -> list[str]:
        """Absolute names of topics of ground truth that eyes can see: labels in colours, boxes."""
        return [self._publishers[what].name for what in ("colored", "boxes") if what in self._publishers]

    def publish(self, time_ns: int) -> None:
        """Look at `time_ns`, if anybody wants to see, and publish, stamped with it.

        Raises:
            SimulationError: Who takes part in the run wants an image, and this computer can draw none.
        """
        wanted = {what for what, publisher in self._publishers.items() if publisher.is_wanted}
        if not wanted:
            return
        said = self._said(wanted, time_ns, Header(stamp(self.node.now_ns), self._frame))
        for what, publisher in self._publishers.items():
            if what in said:
                publisher.publish(said[what], frozen=True)

    def _offered(self) -> dict[str, tuple[type, str]]:
        """Return types and topics of what it publishes."""
        spec, topics = self.spec, self.spec.topics
        offered: dict[str, tuple[type, str]] = {}
        if spec.colour:
            offered["image"] = Image, topics.image
            offered["info"] = CameraInfo, topics.info
            offered["jpeg"] = CompressedImage, f"{topics.image}/compressed"
        if spec.depth:
            offered["depth"] = Image, topics.depth
            offered["png"] = CompressedImage, f"{topics.depth}/compressedDepth"
            offered["depth_info"] = CameraInfo, topics.depth_info
            offered["points"] = PointCloud2, topics.points
        return offered

    def _said(self, wanted: set[str], time_ns: int, header: Header) -> dict[str, Any]:
        """Return the messages that are wanted, as far as it can look."""
        colours = bool(wanted & {"image", "jpeg"}) or ("points" in wanted and self.spec.colour)
        depth = bool(wanted & {"depth", "png", "points"})
        look, spec = self.sensor.look, self.spec
        seen = self._seen(lambda: look(time_ns, colours=colours, depth=depth)) if colours or depth else None
        said: dict[str, Any] = {}
        for what in sorted(wanted & {"info", "depth_info"}):
            said[what] = messages.camera_info(header, self._lens, spec.baseline)
        if seen is not None and seen.colours is not None:
            if "image" in wanted:
                said["image"] = messages.image(header, seen.colours, spec.encoding)
            if "jpeg" in wanted:
                said["jpeg"] = messages.jpeg(header, seen.colours, spec.encoding)
        if seen is not None and seen.depth is not None:
            if wanted & {"depth", "png"}:
                depths = messages.depth_image(header, seen.depth, spec.depth_encoding)
                if "depth" in wanted:
                    said["depth"] = depths
                if "png" in wanted:
                    said["png"] = messages.compressed_depth(header, depths)
            if "points" in wanted:
                rgb = None if seen.colours is None else messages.rgb(seen.colours, spec.encoding)
                said["points"] = messages.cloud(header, self._lens, seen.depth, rgb)
        return said

    def _seen(self, look: Callable[[], T]) -> T | None:
        """Return what it sees; None: nothing can be drawn here, which is told once."""
        if self._is_blind:
            return None
        try:
            return look()
        except SimulationError as error:
            if self._need == "required" or (self._need is None and self._is_needed):
                raise
            # Not to /rosout: whether a computer can draw is no part of what the run is.
            _LOG.warning("camera '%s' makes no images: %s", self.spec.name, error)
            self._is_blind = True
            return None

    @property
    def _is_needed(self) -> bool:
        return any(publisher.is_needed for publisher in self._publishers.values())
