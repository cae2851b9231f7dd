"""A node's log: to /rosout as rcl_interfaces/Log, and to Python's logging as `twin.<node>`."""

from __future__ import annotations

import logging
import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from twin.bridge.msgs import Log, stamp
from twin.bridge.node.logger_levels import DEFAULT_LEVEL, LoggerLevels
from twin.bridge.qos import QoS
from twin.bridge.topics import Publisher

if TYPE_CHECKING:
    from twin.bridge.node import Node

ROSOUT_QOS = QoS(depth=1000, durability="transient_local")
"""rmw_qos_profile_rosout_default."""

_PYTHON_LEVELS = {
    Log.DEBUG: logging.DEBUG,
    Log.INFO: logging.INFO,
    Log.WARN: logging.WARNING,
    Log.ERROR: logging.ERROR,
    Log.FATAL: logging.CRITICAL,
}


class Rosout:
    """What the loggers of one node share: the publisher and the levels."""

    def __init__(self, node: Node) -> None:
        self.node = node
        self.levels = LoggerLevels()
        self._publisher: Publisher[Log] | None = None

    def advertise(self) -> Publisher[Log]:
        """Return the publisher of /rosout."""
        if self._publisher is None:
            self._publisher = self.node.create_publisher(Log, "/rosout", ROSOUT_QOS)
        return self._publisher

    def publish(self, level: int, name: str, message: str) -> None:
        """Publish at the clock's time; a node that is destroyed says nothing."""
        if self.node.is_destroyed:
            return
        self.advertise().publish(Log(stamp(self.node.now_ns), level, name, message, "", "", 0))


@dataclass(slots=True)
class _Place:
    """What the filters know of one place in the program."""

    last_ns: int | None = None
    skipped: bool = False
    logged: bool = False


class Logger:
    """Speaks for one node. A record names no file, function or line: with them, runs differ between machines.

    Every method takes the filters of rclpy, which count per place in the program: `once`, `skip_first`, and
    `throttle_duration_sec` in simulated time. Each returns whether the message was logged.
    """

    def __init__(self, rosout: Rosout, name: str) -> None:
        self.name = name
        """'robot.amcl', and '.child' for children."""
        self._rosout = rosout
        self._python = logging.getLogger(f"twin.{name.removeprefix(_prefix(rosout.node))}")
        self._shown = {"ros_name": name}
        self._places: dict[tuple[Any, int], _Place] = {}

    @property
    def levels(self) -> LoggerLevels:
        """The levels of this node's loggers."""
        return self._rosout.levels

    def advertise(self) -> None:
        """Be on /rosout before the first message."""
        self._rosout.advertise()

    def get_child(self, name: str) -> Logger:
        """Return a logger below this one, as `/rosout` shows it: '<name>.<child>'."""
        return Logger(self._rosout, f"{self.name}.{name}")

    def set_level(self, level: int) -> None:
        """Log from this severity on, a constant of `Log`; 0 goes back to the parent's."""
        self.levels.set(self.name, level)

    def get_effective_level(self) -> int:
        """Return the severity from which on it logs."""
        return self.levels.effective(self.name)

    def is_enabled_for(self, level: int) -> bool:
        """Return whether a message of this severity is logged."""
        return level >= self.levels.effective(self.name)

    def debug(self, message: str, **filters: Any) -> bool:
        """Log what helps a developer; by default to Python's logging only."""
        return self._log(Log.DEBUG, message, **filters)

    def info(self, message: str, **filters: Any) -> bool:
        """Log what happened."""
        return self._log(Log.INFO, message, **filters)

    def warn(self, message: str, **filters: Any) -> bool:
        """Log what may go wrong."""
        return self._log(Log.WARN, message, **filters)

    warning = warn

    def error(self, message: str, **filters: Any) -> bool:
        """Log what went wrong."""
        return self._log(Log.ERROR, message, **filters)

    def fatal(self, message: str, **filters: Any) -> bool:
        """Log what the program cannot go on after."""
        return self._log(Log.FATAL, message, **filters)

    def _log(
        self,
        level: int,
        message: str,
        *,
        once: bool = False,
        skip_first: bool = False,
        throttle_duration_sec: float = 0.0,
    ) -> bool:
        if level < self.levels.effective(self.name):
            if level == Log.DEBUG < DEFAULT_LEVEL:
                self._python.debug(message)
            return False
        if (once or skip_first or throttle_duration_sec) and not self._passes(
            once, skip_first, round(throttle_duration_sec * 1e9)
        ):
            return False
        self._python.log(_PYTHON_LEVELS[level], message, extra=self._shown)
        self._rosout.publish(level, self.name, message)
        return True

    def _passes(self, once: bool, skip_first: bool, throttle_ns: int) -> bool:
        """Apply the filters, in rclpy's order, to the place that called `info` or one of its siblings."""
        frame = sys._getframe(3)
        place = self._places.setdefault((frame.f_code, frame.f_lasti), _Place())
        now_ns = self._rosout.node.now_ns
        if throttle_ns:
            if place.last_ns is not None and 0 <= now_ns - place.last_ns < throttle_ns:
                return False
            place.last_ns = now_ns
        if skip_first and not place.skipped:
            place.skipped = True
            return False
        if once and place.logged:
            return False
        place.logged = True
        return True


def logger_name(node: Node) -> str:
    """Return the name of a node's logger, as rcl makes it: '/robot/amcl' is 'robot.amcl'."""
    return node.fully_qualified_name.strip("/").replace("/", ".")


def _prefix(node: Node) -> str:
    """Return what Python's logging leaves out: the namespace."""
    return logger_name(node).removesuffix(node.name)
