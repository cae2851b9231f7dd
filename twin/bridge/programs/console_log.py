"""The log of nodes on stderr, in the form of ROS: `[INFO] [1763737200.123456789] [talker]: text`."""

from __future__ import annotations

import logging
import sys

_CAMERA = "twin.camera"
_LEVELS = {logging.WARNING: "WARN", logging.CRITICAL: "FATAL"}


class ConsoleLog(logging.Handler):
    """Writes what nodes log; looks stderr up each time, as a test or a progress bar may take its place."""

    def __init__(self, level: int, *, times: bool) -> None:
        super().__init__(level)
        self._times = times

    def emit(self, record: logging.LogRecord) -> None:
        """Write one line. Source of its form: rcutils' RCUTILS_CONSOLE_OUTPUT_FORMAT."""
        level = _LEVELS.get(record.levelno, record.levelname)
        time = f"[{record.created:.9f}] " if self._times else ""
        name = getattr(record, "ros_name", record.name.removeprefix("twin."))
        sys.stderr.write(f"[{level}] {time}[{name}]: {record.getMessage()}\n")


def show_log() -> None:
    """Print what nodes log from now on, debug messages left out: for a program of nodes."""
    logging.getLogger("twin").setLevel(logging.INFO)
    _show(ConsoleLog(logging.INFO, times=True))


def show_warnings() -> None:
    """Print what nodes warn of, and who draws for cameras; without wall times, as a run has its own."""
    handler = ConsoleLog(logging.INFO, times=False)
    handler.addFilter(lambda record: record.levelno >= logging.WARNING or record.name == _CAMERA)
    logging.getLogger(_CAMERA).setLevel(logging.INFO)
    _show(handler)


def _show(handler: ConsoleLog) -> None:
    logger = logging.getLogger("twin")
    if not any(isinstance(other, ConsoleLog) for other in logger.handlers):
        logger.addHandler(handler)
    logger.propagate = False
