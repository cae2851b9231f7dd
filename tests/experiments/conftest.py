"""Small scenarios for experiments."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest

from twin.experiments.trials import Trial, Trials

ARCS = """\
name: arcs
seed: 1
duration: 2 s
robots: [{model: diff_bot}]
mission:
  type: velocity_profile
  robot: diff_bot
  steps:
    - {duration: 1.2 s, linear: 0.2 m/s, angular: 0.4 rad/s}
    - {duration: 5 s, linear: 0.2 m/s, angular: -0.4 rad/s}
checks: [{driven_distance: {min: 0.2 m}}]
"""


class Here(Trials):
    """Makes runs in this process, where all is imported."""

    def verdicts(self, trials: Sequence[Trial]) -> list[Mapping[str, Any]]:
        """Return the verdict of each; what was run before is not run again."""
        for trial in trials:
            if trial.key not in self._results:
                self._results[trial.key] = trial.perform()
        return [self._results[trial.key] for trial in trials]


@pytest.fixture
def arcs(tmp_path: Path) -> Path:
    """Return the file of a robot that drives two arcs in 2 s."""
    file = tmp_path / "arcs.yaml"
    file.write_text(ARCS, encoding="utf-8")
    return file
