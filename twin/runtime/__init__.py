"""Builds a run from a Scenario and steps it; the only place where step order and rates are written."""

from twin.runtime.open_run import OpenRun, Progress, run

__all__ = ["OpenRun", "Progress", "run"]
