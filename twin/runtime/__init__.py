"""Builds a run from a Scenario and steps it; the only place where step order and rates are written."""

from twin.runtime.run import Progress, run

__all__ = ["Progress", "run"]
