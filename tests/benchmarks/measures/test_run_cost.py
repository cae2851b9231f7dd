"""The limit of a run is the run's own work; its layers add up to the run."""

from __future__ import annotations

import math
import time
import xml.etree.ElementTree as ElementTree

import pytest

from benchmarks.measures import run_cost
from benchmarks.measures.layers import LAYERS, picture
from benchmarks.measures.replay import Replay
from benchmarks.measures.run_cost import SCENARIOS
from twin.scenario.schema import Scenario, load


@pytest.fixture(scope="module")
def replay() -> Replay:
    """One of a second in which a cart passes and the robot is carried elsewhere."""
    return run_cost.replay(second())


def second() -> Scenario:
    """A second of a drive."""
    overrides = {
        "duration": "1 s",
        "faults": "[{kidnapping: {at: 0.5 s, to: {x: 1 m, yaw: 90 deg}}}]",
        "world.obstacles": "[{name: cart, pose: {x: 1.5, y: 1}, size: [1, 1, 1], route: [[3, 2]]}]",
    }
    return load(SCENARIOS / "diff_bot_figure8.yaml", overrides)


def test_a_replay_ends_as_the_run_did_and_can_be_done_again(replay: Replay) -> None:
    assert replay.simulated_s == pytest.approx(1.0)
    replay.rewind()
    replay.advance(0.7)
    replay.advance(math.inf)
    replay.rewind()
    replay.advance(math.inf)


def test_runs_and_their_limit_take_turns_to_the_end(replay: Replay) -> None:
    taken = run_cost.costs(second(), replay, record=True)
    assert list(taken) == ["limit", "run", "recorded"]
    assert {len(blocks) for blocks in taken.values()} == {math.ceil(1.0 / run_cost.BLOCK_S)}
    assert all(sum(blocks) > 0.0 for blocks in taken.values())


def test_a_replay_that_leaves_something_out_is_no_limit(replay: Replay) -> None:
    written, steps, casters = replay._steps[-1]
    replay._steps[-1] = written, steps - 1, casters
    replay.rewind()
    with pytest.raises(RuntimeError, match="does not end as the run did"):
        replay.advance(math.inf)


def test_layers_add_up_to_the_run() -> None:
    scenario = load(SCENARIOS / "diff_bot_figure8.yaml", {"duration": "1 s"})
    began = time.process_time()
    layers = run_cost.by_layer(scenario)
    assert tuple(layers) == LAYERS
    assert min(layers[name] for name in ("physics", "rays", "nodes", "messages", "recording")) > 0.0
    assert 0.0 < sum(layers.values()) < time.process_time() - began


def test_the_picture_has_a_bar_for_each_layer() -> None:
    root = ElementTree.fromstring(picture("warehouse", {"physics": 1.0, "rays": 0.25}))
    bars = [float(rect.get("width", "")) for rect in root if rect.tag.endswith("rect")][1:]
    assert bars[0] == pytest.approx(4.0 * bars[1])
