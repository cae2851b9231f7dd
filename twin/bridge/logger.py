"""A node's log: to /rosout as rcl_interfaces/Log, and to Python's logging as `twin.<node>`."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

from twin.bridge.msgs import Log, stamp
from twin.bridge.qos import QoS
from twin.bridge.topics import Publisher

if TYPE_CHECKING:
    from twin.bridge.node import Node

ROSOUT_QOS = QoS(depth=1000, durability="transient_local")
"""rmw_qos_profile_rosout_default."""


class Logger:
    """Speaks for one node. A record names no file or line: with them, runs differ between machines."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._python = logging.getLogger(f"twin.{node.name}")
        self._publisher: Publisher[Log] | None = None
        self._last_ns: dict[str, int] = {}

    def debug(self, message: str) -> None:
        """Log what helps a developer; not sent to /rosout."""
        self._python.debug(message)

    def info(self, message: str, *, throttle_ns: int = 0) -> None:
        """Log what happened; the same text at most once in `throttle_ns` [ns] of simulated time."""
        self._log(Log.INFO, logging.INFO, message, throttle_ns)

    def warn(self, message: str, *, throttle_ns: int = 0) -> None:
        """Log what may go wrong; the same text at most once in `throttle_ns` [ns] of simulated time."""
        self._log(Log.WARN, logging.WARNING, message, throttle_ns)

    def error(self, message: str, *, throttle_ns: int = 0) -> None:
        """Log what went wrong; the same text at most once in `throttle_ns` [ns] of simulated time."""
        self._log(Log.ERROR, logging.ERROR, message, throttle_ns)

    def _log(self, level: int, python_level: int, message: str, throttle_ns: int) -> None:
        now_ns = self._node.bus.clock.now_ns
        if throttle_ns:
            last_ns = self._last_ns.get(message)
            if last_ns is not None and now_ns - last_ns < throttle_ns:
                return
            self._last_ns[message] = now_ns
        self._python.log(python_level, message)
        if self._publisher is None:
            self._publisher = self._node.create_publisher(Log, "/rosout", ROSOUT_QOS)
        name = self._node.fully_qualified_name.strip("/").replace("/", ".")
        self._publisher.publish(Log(stamp(now_ns), level, name, message, "", "", 0))
