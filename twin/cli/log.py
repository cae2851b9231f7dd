"""The nodes' warnings and errors on stderr, as ROS prints them."""

from __future__ import annotations

import logging
import sys

_LEVELS = {logging.WARNING: "WARN", logging.ERROR: "ERROR", logging.CRITICAL: "FATAL"}


class _RosHandler(logging.Handler):
    """Writes `[WARN] [node]: text`; looks stderr up each time, as a progress bar takes its place."""

    def emit(self, record: logging.LogRecord) -> None:
        name = record.name.removeprefix("twin.")
        sys.stderr.write(
            f"[{_LEVELS.get(record.levelno, record.levelname)}] [{name}]: {record.getMessage()}\n"
        )


def show_warnings() -> None:
    """Print what nodes warn of from now on."""
    logger = logging.getLogger("twin")
    if not any(isinstance(handler, _RosHandler) for handler in logger.handlers):
        handler = _RosHandler()
        handler.setLevel(logging.WARNING)
        logger.addHandler(handler)
    logger.propagate = False
