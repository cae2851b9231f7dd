"""Asks localisation to look for a robot that is not where it is thought to be, as Nav2's recoveries do."""

from __future__ import annotations

from twin.bridge.node import Node
from twin.bridge.srvs import Empty
from twin.live.divergence.evidence import Lost

_LOOK_S, _LOOK_NS = 1.0, 500_000_000
"""After it has been lost for so long [s] it takes in a scan each time [ns], though the robot stands."""
_EVERYWHERE_S, _EVERYWHERE_NS = 10.0, 20_000_000_000
"""After that it begins from no idea, and again when it has not helped for so long."""


class Relocalising:
    """Calls `request_nomotion_update`, then `reinitialize_global_localization`; SLAM has neither."""

    def __init__(self, node: Node, namespace: str) -> None:
        """Find the services of localisation in the namespace of a robot."""
        self._look = node.create_client(Empty, f"{namespace}/request_nomotion_update")
        self._everywhere = node.create_client(Empty, f"{namespace}/reinitialize_global_localization")
        self._looked_ns: int | None = None
        self._everywhere_ns: int | None = None

    def update(self, now_ns: int, lost: Lost | None) -> str:
        """Ask for what is due at a time [ns]; return in words what it was, if it is worth telling."""
        if lost is None:
            self._everywhere_ns = None
            return ""
        if lost.for_s < _LOOK_S or not self._look.service_is_ready:
            return ""
        if self._looked_ns is None or not 0 <= now_ns - self._looked_ns < _LOOK_NS:
            self._looked_ns = now_ns
            self._look.call_async(Empty.Request())
        if lost.for_s < _EVERYWHERE_S or not self._everywhere.service_is_ready:
            return ""
        if self._everywhere_ns is not None and 0 <= now_ns - self._everywhere_ns < _EVERYWHERE_NS:
            return ""
        self._everywhere_ns = now_ns
        self._everywhere.call_async(Empty.Request())
        return f"lost for {lost.for_s:.0f} s: it is asked to look for the robot everywhere"
