"""The hall in which fleets are measured, and how their cost is drawn."""

from __future__ import annotations

import math
from itertools import combinations
from pathlib import Path
from xml.etree import ElementTree

from benchmarks.measures.fleet import fleet
from benchmarks.measures.fleet_cost import picture
from twin.scenario.missions import Behaviors
from twin.warehouse import arena as arenas


def test_robots_drive_around_racks_on_lanes_of_their_own(tmp_path: Path) -> None:
    scenario = fleet(tmp_path, 5, blocks=8, duration=10.0)
    ways = []
    for mission in scenario.missions:
        assert isinstance(mission, Behaviors)
        ways.append([(step.config.x, step.config.y) for step in mission.steps])  # type: ignore[attr-defined]
    assert len(ways) == len(scenario.robots) == 5
    for one, other in combinations(ways, 2):
        assert min(math.dist(a, b) for a in one for b in other) > 1.5
    hall = arenas.load(str(scenario.world.arena))
    corners = [corner for way in ways for corner in way]
    for rack in hall.racks.values():
        assert min(math.dist((rack.pose.x, rack.pose.y), corner) for corner in corners) > 1.5


def test_the_picture_tells_what_each_robot_costs() -> None:
    drawn = ElementTree.fromstring(picture("cost", {1: 0.1, 10: 0.9}))
    told = [text.text for text in drawn.iter("{http://www.w3.org/2000/svg}text")]
    assert {"100", "90", "1", "10"} <= set(told)
