"""Sweeps for tests: a robot alone on the floor, for moments."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from twin.errors import RecordingError
from twin.experiments.sweep.axes import parse_axis
from twin.experiments.sweep.one_run import Job, perform
from twin.experiments.sweep.plan import Plan, make_plan

SCENARIO = """
name: moment
seed: 3
duration: 0.6 s
robots: [{model: diff_bot}]
mission:
  type: velocity_profile
  robot: diff_bot
  steps: [{duration: 0.5 s, linear: 0.2}]
checks:
  - final_pose: {x: 0, y: 0, tolerance: 1 m}
"""
SPEED, LIMIT = "mission.steps.0.linear", "checks.0.final_pose.tolerance"


class InTurn:
    """Makes runs in this process, one after the other; it can be interrupted after some."""

    def __init__(self, most: int | None = None) -> None:
        self.made: list[str] = []
        self._most = most
        self._jobs: list[Job] = []

    @property
    def busy(self) -> int:
        return len(self._jobs)

    @property
    def free(self) -> int:
        return 1 - self.busy

    def start(self, job: Job) -> None:
        self._jobs.append(job)

    def wait(self, timeout_s: float) -> list[tuple[Job, Any]]:
        if len(self.made) == self._most:
            raise KeyboardInterrupt
        job = self._jobs.pop()
        self.made.append(job.folder.name)
        return [(job, perform(job))]

    def close(self) -> None:
        pass


class FullDisk(InTurn):
    """Whose disk is full after some runs."""

    def wait(self, timeout_s: float) -> list[tuple[Job, Any]]:
        if len(self.made) == self._most:
            raise RecordingError("runs: cannot be written: No space left on device")
        return super().wait(timeout_s)


@pytest.fixture
def scenario(tmp_path: Path) -> Path:
    file = tmp_path / "moment.yaml"
    file.write_text(SCENARIO, encoding="utf-8")
    return file


MakePlan = Callable[..., Plan]


@pytest.fixture
def plan(scenario: Path) -> MakePlan:
    """Return a function that plans a sweep of the scenario over words of `--set`."""
    return lambda *words, **options: make_plan(scenario, [parse_axis(word) for word in words], **options)
