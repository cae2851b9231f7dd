"""Runs that are under way."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.cli.conftest import invoke as invoke
from twin.bridge.wire.session import SessionConfig
from twin.runtime.open_run import OpenRun
from twin.scenario.schema import load

Begin = Callable[..., OpenRun]

SCENARIO = """
name: there_and_back
seed: 1
duration: {duration}
robots: [{{model: diff_bot}}]
world: {{obstacles: [{{name: post, pose: {{x: 0.8, y: 0.6}}, size: [0.1, 0.1, 1.0]}}]}}
mission:
  type: velocity_profile
  robot: diff_bot
  steps: [{{duration: {drive}, linear: 0.3 m/s, angular: 0.2 rad/s}}]
checks: {checks}
"""
CHECKS = "[{mission_succeeded: }, {no_collision: }]"


@pytest.fixture
def begin(tmp_path: Path) -> Iterator[Begin]:
    """Return a function that makes a run and goes on to a time [s]; all are closed at the end."""
    runs: list[OpenRun] = []

    def make(
        until_s: float = 1.0,
        *,
        checks: str = CHECKS,
        duration: str = "6 s",
        drive: str = "2 s",
        **options: object,
    ) -> OpenRun:
        file = tmp_path / "there_and_back.yaml"
        file.write_text(SCENARIO.format(checks=checks, duration=duration, drive=drive), encoding="utf-8")
        run = OpenRun(load(file), record=False, **options)  # type: ignore[arg-type]
        runs.append(run)
        go_on(run, until_s)
        return run

    yield make
    for run in runs:
        run.close()


def go_on(run: OpenRun, until_s: float) -> None:
    """Go on to a time of the run [s]."""
    world = run.run.world
    if world.time_ns < round(until_s * 1e9):
        run.advance(lambda: world.time_ns >= round(until_s * 1e9))


def digest(run: OpenRun) -> str:
    """Return that of the run up to now."""
    return run.digest.finish(run.run.world.state_digest())


def listening(endpoint: str) -> SessionConfig:
    """Return a network in which others can join."""
    return SessionConfig(listen=(endpoint,))
