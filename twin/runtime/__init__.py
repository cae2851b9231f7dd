"""Builds a run from a Scenario and steps it; the only place where step order and rates are written."""

from twin.runtime.open_run import OpenRun, Progress, run
from twin.runtime.threads import end_threads

__all__ = ["OpenRun", "Progress", "end_threads", "run"]
