"""A mirror of the whole job: what the physical robot carries, the virtual one carries too."""

from __future__ import annotations

from pathlib import Path

import pytest

from twin.bridge.wire.session import SessionConfig
from twin.live.mirror.bag_source import BagSource
from twin.live.mirror.mirror import Mirror
from twin.live.perturbations import perturbed
from twin.live.plant import Plant
from twin.scenario.schema import load


@pytest.mark.long
def test_the_virtual_tote_is_set_down_where_the_physical_one_is(tmp_path: Path) -> None:
    scenario = load("warehouse")
    changed, error = perturbed(scenario, "wheel_radius=0.97,track=1.02,latency=80ms,loss=2%")
    bag = tmp_path / "bag"
    with Plant(changed, error=error, network=SessionConfig(), autonomy=True, pace=None, bag=bag) as robots:
        run = robots.run.run
        robots.advance(lambda: run.parts.mission.done)
        assert run.parts.mission.succeeded
        physical = run.world.pose("tote_a")
    with Mirror(scenario, BagSource(bag)) as mirror:
        before = mirror.run.run.world.pose("tote_a")
        mirror.advance()
        virtual = mirror.run.run.world.pose("tote_a")
        told = [f"{event.what}: {event.text}" for robot in mirror.robots for event in robot.events]
    assert physical.to_pose2().distance(before.to_pose2()) > 5.0
    assert physical.to_pose2().distance(virtual.to_pose2()) < 0.03
    assert abs(float(physical.xyz[2] - virtual.xyz[2])) < 0.01
    assert [text.partition("%")[0].partition(".")[0] for text in told] == [
        "alarm: wheel radius: wheels roll 97",
        "alarm: track: wheels are 102",
    ], "what is otherwise is told, and nothing else"
