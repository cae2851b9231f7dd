"""A table whose top only a camera sees: with a voxel layer the robot drives around it, without it is hit."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.drawing import needs_opengl
from twin.runtime.open_run import OpenRun
from twin.scenario.schema import load

SCENARIO = Path(__file__).parents[2] / "scenarios/cameras/warehouse_table.yaml"
COSTMAPS = ("global_costmap", "local_costmap")


@needs_opengl
@pytest.mark.parametrize("sees", [True, False])
def test_a_table_top_above_the_lidar(sees: bool) -> None:
    without = {f"robots.0.navigation.{name}.observation_sources": "[]" for name in COSTMAPS}
    run = OpenRun(load(SCENARIO, {} if sees else {**without, "duration": "8 s"}), record=False)
    run.advance()
    checks = {check.name: check for check in run.finish().checks}
    assert checks["no_collision"].passed == sees
    assert checks["mission_succeeded"].passed == sees
    if not sees:
        assert "hit table_top" in checks["no_collision"].reason
