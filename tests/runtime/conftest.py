"""Runs for tests: scenarios as text, ticked in this process."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from twin.runtime.build import build
from twin.runtime.run import Run
from twin.scenario.schema import Scenario, load

SCENARIOS = Path(__file__).parents[2] / "scenarios"

MakeRun = Callable[..., Run]


@pytest.fixture
def scenario(tmp_path: Path) -> Callable[[str], Scenario]:
    """Return a function that loads a scenario from its text."""

    def make(text: str) -> Scenario:
        path = tmp_path / "scenario.yaml"
        path.write_text(text, encoding="utf-8")
        return load(path)

    return make


@pytest.fixture
def make_run() -> Iterator[MakeRun]:
    """Return a function that builds a run; every bus is closed at the end."""
    runs: list[Run] = []

    def make(scenario: Scenario, **options: object) -> Run:
        runs.append(Run(scenario, build(scenario, **options)))  # type: ignore[arg-type]
        return runs[-1]

    yield make
    for run in runs:
        run.bus.close()
