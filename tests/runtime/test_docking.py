"""Picking in other halls than the shipped one: racks elsewhere, neighbours on both sides, a narrow aisle."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from tests.runtime.conftest import MakeRun
from twin.geometry import wrap_angle
from twin.scenario.schema import load

pytestmark = pytest.mark.slow

ARENA = """
name: hall
hall: {{x: [-5, 5], y: [-4, 4]}}
partitions:
  corner: {{start: [-5, 1.5], end: [-3.5, 1.5]}}
pillars:
  pillar: {{pose: [2.5, -3, 0]}}
racks:
  rack: {{pose: {rack}, length: 3.0, depth: 0.6, levels: [0.4, 0.8]}}
{more}
totes:
  tote: {{rack: rack, level: {level}, slot: {slot}}}
stock: {{fill: {fill}}}
zones:
  unloading:
    pose: [3.0, 0.5, 0]
    size: [2.5, 2.5]
    table: {{pose: [4.6, {table_y}, 180 deg]}}
poses:
  start: [-3, -2, 0]
"""
BY_THE_WALL = {"rack": "[0, 3.6, -90 deg]", "more": "", "fill": 0.5, "table_y": 0.5}
AISLE = {
    "rack": "[0, 3.2, -90 deg]",
    "more": "  other: {pose: [0, 0.4, 90 deg], length: 3.0, depth: 0.6, levels: [0.4]}",
    "fill": 1.0,
    "table_y": -1.0,
}
SCENARIO = """
name: hall
seed: {seed}
duration: 120 s
world: {{arena: hall.yaml}}
robots:
  - {{model: warehouse_bot, start: start, localisation: {{type: amcl}}, navigation: {{}}}}
mission:
  type: pick_and_place
  robot: warehouse_bot
  tasks: [{{tote: tote, to: unloading}}]
checks:
  - mission_succeeded:
  - delivered: {{tote: tote, zone: unloading}}
  - no_collision: {{allowed: [{{other: tote, body: "*finger*"}}]}}
"""


@pytest.mark.parametrize(
    ("arena", "level", "slot", "seed"),
    [
        pytest.param(BY_THE_WALL, 0, 2, 2, id="neighbour on the left"),
        pytest.param(BY_THE_WALL, 1, 2, 5, id="upper level"),
        pytest.param(AISLE, 1, 3, 3, id="aisle of 2.2 m"),
    ],
)
def test_the_robot_docks_squarely_at_the_tote_it_was_sent_for(
    make_run: MakeRun, tmp_path: Path, arena: dict[str, object], level: int, slot: int, seed: int
) -> None:
    (tmp_path / "hall.yaml").write_text(ARENA.format(**arena, level=level, slot=slot), encoding="utf-8")
    (tmp_path / "run.yaml").write_text(SCENARIO.format(seed=seed), encoding="utf-8")
    run = make_run(load(tmp_path / "run.yaml"))
    states, turned, docked_at = [""], [0.0], None
    while not run.over:
        run.tick()
        base = run.world.pose("warehouse_bot/base_footprint").to_pose2()
        state = run.parts.mission.state
        off = wrap_angle(base.yaw - math.pi / 2.0)
        if state.startswith("tote: dock at rack"):
            turned.append(abs(off))
        if state != states[-1]:
            states.append(state)
            docked_at = base if state == "tote: look" else docked_at
    failed = [
        f"{check.name}: {check.reason}" for check in (c.result() for c in run.checks) if not check.passed
    ]
    assert not failed
    assert docked_at is not None
    lateral = run.parts.world.scene.goods[0].T_world_body.xyz[0] - docked_at.x
    assert abs(lateral) < 0.015
    assert abs(wrap_angle(docked_at.yaw - math.pi / 2.0)) < math.radians(1.5)
    assert max(turned) < math.radians(20.0), "it came calmly"
    assert sum(state.startswith("tote: dock at rack") for state in states) == 1, "at the first attempt"
