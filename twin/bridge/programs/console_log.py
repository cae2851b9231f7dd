"""The log of nodes on stderr, in the form of ROS: `[INFO] [1763737200.123456789] [talker]: text`."""

from __future__ import annotations

import logging
import sys

_LEVELS = {logging.WARNING: "WARN", logging.CRITICAL: "FATAL"}


class ConsoleLog(logging.Handler):
    """Writes what nodes log; looks stderr up each time, as a test may take its place."""

    def emit(self, record: logging.LogRecord) -> None:
        """Write one line. Source of its form: rcutils' RCUTILS_CONSOLE_OUTPUT_FORMAT."""
        level = _LEVELS.get(record.levelno, record.levelname)
        name = getattr(record, "ros_name", record.name.removeprefix("twin."))
        sys.stderr.write(f"[{level}] [{record.created:.9f}] [{name}]: {record.getMessage()}\n")


def show_log() -> None:
    """Print what nodes log from now on, debug messages left out."""
    logger = logging.getLogger("twin")
    if not any(isinstance(handler, ConsoleLog) for handler in logger.handlers):
        logger.addHandler(ConsoleLog())
    logger.setLevel(logging.INFO)
    logger.propagate = False
