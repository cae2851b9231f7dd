"""What a recording reads of a sample of the bus."""

from __future__ import annotations

from typing import Any, Protocol


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
