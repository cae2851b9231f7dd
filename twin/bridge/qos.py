"""Quality of service, as far as it changes what travels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True, kw_only=True)
class QoS:
    """A topic's quality of service; history is always keep_last."""

    depth: int = 10
    """Samples kept: by a transient_local publisher for late subscribers, by a subscription between spins."""
    reliability: Literal["reliable", "best_effort"] = "reliable"
    durability: Literal["volatile", "transient_local"] = "volatile"
    """transient_local: a subscription that comes later gets the last `depth` samples ("latched")."""

    def __post_init__(self) -> None:
        """Refuse a depth below one."""
        if self.depth < 1:
            raise ValueError(f"a QoS depth of {self.depth}; valid is 1 or more")


SENSOR_DATA = QoS(depth=5, reliability="best_effort")
"""rclpy's qos_profile_sensor_data."""
LATCHED = QoS(depth=1, durability="transient_local")
"""Maps, descriptions, static transforms, action status."""


def as_qos(qos: QoS | int) -> QoS:
    """Return a QoS; a number is the depth of a reliable, volatile one, as in rclpy."""
    return QoS(depth=qos) if isinstance(qos, int) else qos
