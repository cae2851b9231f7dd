"""A tote that is taken away while it is carried."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from tests.runtime.conftest import MakeRun
from twin.scenario.schema import load

HALL = """
name: hall
hall: {x: [-2.5, 2.5], y: [-2.5, 2.5]}
racks:
  rack: {pose: [0, 1.7, -90 deg], length: 1.6, depth: 0.5, levels: [0.4]}
totes:
  tote: {rack: rack, level: 0, slot: 1}
zones:
  unloading: {pose: [1.5, -1.5, 0], size: [1.5, 1.5], table: {pose: [2, -1.5, 180 deg]}}
poses:
  start: [0.2, 0.15, 90 deg]
"""
SCENARIO = """
name: lost
seed: 1
duration: 60 s
world: {arena: hall.yaml}
robots:
  - {model: warehouse_bot, start: start, localisation: {type: amcl}, navigation: {}}
mission:
  type: pick_and_place
  robot: warehouse_bot
  tasks: [{tote: tote, to: unloading}]
checks: [mission_succeeded: ]
"""


@pytest.mark.slow
def test_a_tote_that_is_taken_away_ends_the_mission_within_a_second(
    make_run: MakeRun, tmp_path: Path
) -> None:
    (tmp_path / "hall.yaml").write_text(HALL, encoding="utf-8")
    (tmp_path / "run.yaml").write_text(SCENARIO, encoding="utf-8")
    run = make_run(load(tmp_path / "run.yaml"))
    mission = run.parts.mission
    while not mission.state.startswith("tote: carry"):
        assert not run.over, mission.reason
        run.tick()
    for _ in range(50):
        run.tick()
    taken = run.world.time_ns
    run.world.data.joint("tote").qpos[:3] = (-2.0, -2.0, 0.1)
    while not mission.done:
        run.tick()
    assert run.world.time_ns < taken + 1_000_000_000
    assert mission.succeeded is False
    assert "carry to unloading/0/0: lost tote at" in mission.reason
    for _ in range(25):
        run.tick()
    before = run.world.pose("warehouse_bot/base_footprint").xyz
    for _ in range(25):
        run.tick()
    assert math.dist(run.world.pose("warehouse_bot/base_footprint").xyz, before) < 0.3, "it stops"


@pytest.mark.slow
def test_a_gripper_that_lets_go_drops_what_it_has_grasped(make_run: MakeRun, tmp_path: Path) -> None:
    (tmp_path / "hall.yaml").write_text(HALL, encoding="utf-8")
    fault = 'faults: [dropped_good: {when: {grasped: "t?te"}, after: 3 s}]\n'
    (tmp_path / "run.yaml").write_text(SCENARIO + fault, encoding="utf-8")
    run = make_run(load(tmp_path / "run.yaml"))
    assert run.faults is not None
    (report,) = run.faults.reports()
    assert report.outcome == "not_reached"
    while report.end_s is None:
        assert not run.over
        run.tick()
        (report,) = run.faults.reports()
    assert (report.outcome, report.effect) == ("landed", "tote was dropped")
    assert report.at_s == pytest.approx(report.end_s - 1.0)
