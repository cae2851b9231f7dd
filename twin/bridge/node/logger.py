"""A node's log: to /rosout as rcl_interfaces/Log, and to Python's logging as `twin.<node>`.

Also the severities from which on its loggers log, and the services that show and set them.
"""

from __future__ import annotations

import logging
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from twin.bridge import types
from twin.bridge.msgs import Log, stamp
from twin.bridge.qos import QoS
from twin.bridge.topics import Publisher
from twin.bridge.types import ServiceType
from twin.errors import BridgeError

if TYPE_CHECKING:
    from twin.bridge.node import Node

UNSET = 0
DEFAULT_LEVEL: int = Log.INFO
LEVELS: dict[str, int] = {"UNSET": UNSET}
LEVELS |= {word: getattr(Log, word) for word in ("DEBUG", "INFO", "WARN", "ERROR", "FATAL")}

_GetLoggerLevels = ServiceType("rcl_interfaces/srv/GetLoggerLevels")
_SetLoggerLevels = ServiceType("rcl_interfaces/srv/SetLoggerLevels")


class LoggerLevels:
    """Levels by logger name; what has none has its parent's, in the end INFO.

    They are the node's; in ROS they are the process's.
    """

    def __init__(self) -> None:
        self._levels: dict[str, int] = {}
        self._effective: dict[str, int] = {}

    @property
    def offered(self) -> dict[str, tuple[ServiceType, Callable[[Any], Any]]]:
        """The two services: name below the node -> type and callback."""
        return {
            "get_logger_levels": (_GetLoggerLevels, self._on_get),
            "set_logger_levels": (_SetLoggerLevels, self._on_set),
        }

    def start(self, name: str, levels: Iterable[tuple[str, int]]) -> None:
        """Set what a command line says; an empty name is the logger `name`."""
        for logger, level in levels:
            self.set(logger or name, level)

    def set(self, name: str, level: int) -> None:
        """Set a level; zero unsets it.

        Raises:
            BridgeError: no such level.
        """
        if level not in LEVELS.values():
            valid = ", ".join(f"{number} ({word})" for word, number in LEVELS.items())
            raise BridgeError(f"{level!r} is not a log level; valid: {valid}")
        self._levels[name] = level
        self._effective.clear()

    def get(self, name: str) -> int:
        """Return the level that a name was given, or zero."""
        return self._levels.get(name, UNSET)

    def effective(self, name: str) -> int:
        """Return the level that holds for a name."""
        if name not in self._effective:
            inherited = self.effective(name.rpartition(".")[0]) if name else DEFAULT_LEVEL
            self._effective[name] = self.get(name) or inherited
        return self._effective[name]

    def _on_get(self, request: Any) -> Any:
        entry = types.get("rcl_interfaces/msg/LoggerLevel")
        return _GetLoggerLevels.Response([entry(name, self.get(name)) for name in request.names])

    def _on_set(self, request: Any) -> Any:
        result = types.get("rcl_interfaces/msg/SetLoggerLevelsResult")
        results = []
        for entry in request.levels:
            try:
                self.set(entry.name, int(entry.level))
            except BridgeError:
                results.append(result(False, "Failed reason: Invalid logger level."))
            else:
                results.append(result(True, ""))
        return _SetLoggerLevels.Response(results)


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
