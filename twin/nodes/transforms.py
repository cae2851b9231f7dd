"""`/transform_listener`: one transform buffer for all nodes of a robot in this process."""

from __future__ import annotations

from twin.bridge.bus import Bus
from twin.bridge.tf import TransformBuffer, TransformListener


class TransformListenerNode:
    """Fills `buffer` from `tf` and `tf_static`."""

    def __init__(self, bus: Bus, *, namespace: str = "") -> None:
        self.node = bus.create_node("transform_listener", namespace)
        self.buffer = TransformBuffer()
        self.listener = TransformListener(self.buffer, self.node)
