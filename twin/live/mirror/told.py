"""What the physical robot tells of itself beside its pose, and how late it is told."""

from __future__ import annotations

import math
from collections import deque

import numpy as np

from twin.bridge.msgs import BatteryState, String
from twin.bridge.node import Node
from twin.bridge.qos import LATCHED

_KEPT = 200


class Told:
    """Hears `mission/state` and `battery_state` of a robot's namespace."""

    def __init__(self, node: Node, namespace: str) -> None:
        """Begin to listen."""
        self.words: dict[str, str] = {}
        """By name: `mission`, `battery`."""
        self._late_s: deque[float] = deque(maxlen=_KEPT)
        node.create_subscription(String, f"{namespace}/mission/state", self._on_mission, LATCHED, frozen=True)
        node.create_subscription(BatteryState, f"{namespace}/battery_state", self._on_battery, 1, frozen=True)

    def late(self, seconds: float) -> None:
        """Note how long after its stamp a message came, by the robot's clock [s]."""
        self._late_s.append(seconds)

    @property
    def delay_s(self) -> tuple[float, float] | None:
        """Median of how late the last messages came, and by how much 90 of 100 stay around it [s]."""
        if not self._late_s:
            return None
        low, median, high = np.percentile(self._late_s, (5.0, 50.0, 95.0))
        return float(median), float(max(high - median, median - low))

    def _on_mission(self, message: String) -> None:
        self.words["mission"] = message.data

    def _on_battery(self, message: BatteryState) -> None:
        if math.isfinite(message.percentage):
            self.words["battery"] = f"{message.percentage:.0%}"
