"""The severities from which on a node's loggers log, and the services that show and set them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from twin.bridge import types
from twin.bridge.msgs import Log
from twin.bridge.types import ServiceType
from twin.errors import BridgeError

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
