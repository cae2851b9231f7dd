"""What a recording reads: the parts of the world and of a bus sample it looks at, as structural types."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

from twin.geometry import Array, Pose3
from twin.models.shapes import Geometry


class Sample(Protocol):
    """One published message, as `Bus.tap` hands it out."""

    @property
    def topic(self) -> str:
        """Fully qualified ROS name, such as `/scan`."""

    @property
    def msgtype(self) -> str:
        """ROS type name, such as `sensor_msgs/msg/LaserScan`."""

    @property
    def time_ns(self) -> int:
        """Simulated time of publication [ns]."""

    @property
    def payload(self) -> bytes:
        """The CDR bytes."""

    @property
    def message(self) -> Any:
        """The rosbags dataclass."""


class BodyShape(Protocol):
    """One shape to draw."""

    @property
    def body(self) -> str:
        """Name of its body, `robot/link` for a robot."""

    @property
    def geometry(self) -> Geometry:
        """Primitive or mesh."""

    @property
    def T_body_geometry(self) -> Pose3:
        """Pose of the shape in its body's frame."""

    @property
    def rgba(self) -> Sequence[float]:
        """Colour, each component in [0, 1]."""

    @property
    def static(self) -> bool:
        """Whether its body never moves."""


class World(Protocol):
    """The simulated world, as far as a recording reads it."""

    @property
    def time_ns(self) -> int:
        """Simulated time [ns]."""

    @property
    def body_names(self) -> tuple[str, ...]:
        """Names in the order of `body_poses`."""

    def shapes(self) -> Sequence[BodyShape]:
        """Every shape to draw."""

    def body_poses(self) -> tuple[Array, Array]:
        """Return xyz (n, 3) [m] and quat_wxyz (n, 4) in `world` of the bodies that can move."""

    def pose(self, body: str) -> Pose3:
        """Return the pose of any body, static ones too, in `world`."""
