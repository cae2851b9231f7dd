"""Kernels are there before the first tick of a run that keeps time with others, and make no difference."""

from __future__ import annotations

import subprocess
import sys
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


_LATE = """
import gc, sys
from numba.core.registry import CPUDispatcher
from twin.runtime.open_run import OpenRun
from twin.scenario.schema import load

def kernels():
    found = (each for each in gc.get_objects() if isinstance(each, CPUDispatcher))
    return {f"{each.py_func.__name__}{types}" for each in found for types in each.overloads}

run = OpenRun(load(sys.argv[1], {"duration": "30 s"}), record=False, pace=1000.0)
before = kernels()
run.advance()
assert run.run.world.time_ns >= 29e9
print(*sorted(kernels() - before), sep="\\n")
"""


def test_a_paced_run_stops_for_no_compiler() -> None:
    done = subprocess.run(
        [sys.executable, "-c", _LATE, SCENARIOS / "warehouse_patrol.yaml"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.split("\n") == ["", ""]
