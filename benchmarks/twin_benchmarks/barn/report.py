"""All trials of a benchmark run in numbers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from twin_benchmarks.barn.referee import Trial
from twin_benchmarks.barn.scenarios import BarnOptions

BAR = 0.45
"""Mean score that passes, if nothing was touched."""


@dataclass(frozen=True)
class BarnReport:
    """Totals over trials, which are in order of world and seed."""

    trials: Sequence[Trial]
    options: BarnOptions

    @property
    def score(self) -> float:
        """Mean score; 0.5 is the maximum."""
        return sum(trial.score for trial in self.trials) / max(1, len(self.trials))

    def count(self, outcome: str) -> int:
        """Return how many trials ended like this."""
        return sum(trial.outcome == outcome for trial in self.trials)

    @cached_property
    def mean_time(self) -> float | None:
        """Of the successful trials [s]."""
        times = [trial.time_s for trial in self.trials if trial.outcome == "success"]
        return sum(times) / len(times) if times else None

    @cached_property
    def min_clearance(self) -> float | None:
        """Least distance to a cylinder in any trial [m]."""
        gaps = [trial.min_clearance for trial in self.trials if math.isfinite(trial.min_clearance)]
        return min(gaps) if gaps else None

    @property
    def passed(self) -> bool:
        """Whether the bar was kept."""
        return bool(self.trials) and self.score >= BAR and self.count("collision") == 0

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        options = self.options
        return {
            "benchmark": "barn",
            "passed": self.passed,
            "bar": BAR,
            "score": self.score,
            "trials": len(self.trials),
            "successes": self.count("success"),
            "collisions": self.count("collision"),
            "timeouts": self.count("timeout"),
            "mean_time_s": self.mean_time,
            "min_clearance_m": self.min_clearance,
            "recoveries": sum(trial.recoveries for trial in self.trials),
            "max_speed": options.max_speed,
            "noise": options.noise,
            "command_latency_s": options.command_latency,
            "worlds": [trial.to_dict() for trial in self.trials],
        }
