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


RMW_DEFAULT_DEPTH = 42
"""rmw_zenoh's, which tokens leave out."""
SENSOR_DATA = QoS(depth=5, reliability="best_effort")
"""rclpy's qos_profile_sensor_data."""
LATCHED = QoS(depth=1, durability="transient_local")
"""Maps, descriptions, static transforms, action status."""


def as_qos(qos: QoS | int) -> QoS:
    """Return a QoS; a number is the depth of a reliable, volatile one, as in rclpy."""
    return QoS(depth=qos) if isinstance(qos, int) else qos


def parse_qos(text: str) -> QoS:
    """Return the QoS that a token spells; what it leaves out or spells otherwise is rmw_zenoh's default."""
    reliability, durability, history, *_ = (*text.split(":"), "", "", "")
    depth = history.rpartition(",")[2]
    return QoS(
        depth=int(depth) if depth.isdecimal() and int(depth) > 0 else RMW_DEFAULT_DEPTH,
        reliability="best_effort" if reliability == "2" else "reliable",
        durability="transient_local" if durability == "1" else "volatile",
    )
