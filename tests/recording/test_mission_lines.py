"""The mission's line of states: short labels, and colours that can be told apart."""

from __future__ import annotations

from itertools import combinations, pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from twin.recording.palette import COLOURS, Palette
from twin.recording.read_back import Recording, read
from twin.recording.sink import RerunSink

STATES = (
    "tote_a: drive to rack_a/1/7",
    "tote_a: grasp",
    "tote_b: drive to rack_b/0/2",
    "tote_b: drive to rack_b/0/3",
    "tote_b: grasp",
    "done",
)


@pytest.fixture
def mission(make_run: Any, make_message: Any, tmp_path: Path) -> Recording:
    run = make_run(duration_s=0.0)
    sink = RerunSink(tmp_path / "mission.rrd")
    sink.declare(run.world)
    for i, state in enumerate(STATES):
        run.world.time_ns = i * 500_000_000
        sink.on_sample(run.publish("/mission/state", make_message("std_msgs/String", data=state)))
        sink.on_tick(run.world)
    sink.close()
    return read(tmp_path / "mission.rrd")


def lab(colour: Any) -> np.ndarray:
    """Return a colour in CIELAB, in which a distance of 2 can just be seen."""
    rgb = np.array(colour[:3]) / 255.0
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]) @ linear
    x, y, z = np.cbrt(np.maximum(xyz / (0.9505, 1.0, 1.089), 0.0089))
    return np.array((116 * y - 16, 500 * (x - y), 200 * (y - z)))


def test_labels_tell_what_is_done_and_a_second_line_for_what(mission: Recording) -> None:
    assert [row[0] for row in mission.column("/mission/state", "StateChange:state").values] == list(STATES)
    assert mission.column("/mission/state", "StateConfiguration:values").values[0] == list(STATES)
    assert mission.column("/mission/state", "StateConfiguration:labels").values[0] == [
        "drive to rack_a/1/7",
        "grasp",
        "drive to rack_b/0/2",
        "drive to rack_b/0/3",
        "grasp",
        "done",
    ]
    task = mission.column("/mission/task", "StateChange:state")
    assert task.values == [["tote_a"], ["tote_b"], [""]]
    assert task.times_ns.tolist() == [0, 1_000_000_000, 2_500_000_000]


def test_each_action_has_a_colour_and_neighbours_differ(mission: Recording) -> None:
    colours = mission.column("/mission/state", "StateConfiguration:colors").values[0]
    assert len(set(colours)) == 4  # the third drive looks like the first
    assert colours[0] == colours[3]
    assert colours[1] == colours[4]  # the same words
    assert all(one != next_one for one, next_one in pairwise(colours))


def test_colours_can_be_told_apart() -> None:
    palette = Palette()
    given = [palette.colour(i, variant) for i in range(len(COLOURS)) for variant in (0, 1)]
    assert min(np.linalg.norm(lab(one) - lab(other)) for one, other in combinations(given, 2)) > 20.0
    assert min(np.linalg.norm(lab(one) - lab(other)) for one, other in combinations(COLOURS, 2)) > 25.0
    assert palette.colour(0) == COLOURS[0]
