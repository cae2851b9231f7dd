"""Kernels are there before the first tick of a run that keeps time with others, and make no difference."""

from __future__ import annotations

from pathlib import Path

import pytest

from twin.navigation import warm_up
from twin.runtime.open_run import OpenRun
from twin.scenario.schema import Scenario, load

SCENARIOS = Path(__file__).parents[2] / "scenarios"


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    mppi = {"robots.0.navigation": "{controller: {plugin: mppi}}"}
    return load(SCENARIOS / "warehouse.yaml", {"duration": "3 s", **mppi})


def test_a_paced_run_has_its_kernels_before_and_says_the_same(
    scenario: Scenario, monkeypatch: pytest.MonkeyPatch
) -> None:
    digests, rooms = [], []
    room = warm_up._room
    monkeypatch.setattr(warm_up, "_room", lambda: rooms.append(1) or room())
    for name, function in vars(warm_up).items():
        if name.startswith("warm_up_") and hasattr(function.__wrapped__, "cache_clear"):
            function.__wrapped__.cache_clear()
    for pace in (None, 100.0):
        run = OpenRun(scenario, record=False, pace=pace)
        assert bool(rooms) is (pace is not None)
        run.advance()
        digests.append(run.finish().digest)
    assert digests[0] == digests[1]
