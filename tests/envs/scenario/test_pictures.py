"""Pictures of a run; changes nothing in it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.envs.scenario.conftest import MakeEnv
from twin.errors import GymError, SimulationError
from twin.recording.player import listens


def picture(make: MakeEnv, small: Path, **options: object) -> tuple[np.ndarray, list[float]]:
    env = make(small, render_mode="rgb_array", width=160, height=120, **options)
    env.reset(seed=1)
    try:
        drawn = env.render()
    except SimulationError as error:
        pytest.skip(str(error))
    env.step(np.array([0.5, 0.5]))
    return drawn, env.step(np.array([0.5, 0.5]))[0]["scan"].tolist()


def test_it_shows_robot_and_goal_and_changes_nothing(make: MakeEnv, small: Path) -> None:
    drawn, scan = picture(make, small)
    assert drawn.shape == (120, 160, 3)
    assert drawn.dtype == np.uint8
    red, green, blue = drawn.astype(int).transpose(2, 0, 1)
    assert (green - np.maximum(red, blue) > 60).sum() > 10, "the goal is a green disc"
    middle = (slice(50, 70), slice(65, 95))
    assert (blue - np.maximum(red, green))[middle].max() > 60, "the robot is blue, and in the middle"
    env = make(small)
    env.reset(seed=1)
    env.step(np.array([0.5, 0.5]))
    assert env.step(np.array([0.5, 0.5]))[0]["scan"].tolist() == scan


def test_without_a_mode_there_is_no_picture(make: MakeEnv, small: Path) -> None:
    env = make(small)
    env.reset()
    assert env.render() is None


def test_a_size_that_is_none(make: MakeEnv, small: Path) -> None:
    env = make(small, render_mode="rgb_array", width=0)
    env.reset()
    with pytest.raises(GymError, match="a picture of 0 x 480 pixels"):
        env.render()


@pytest.mark.slow
def test_a_viewer_shows_it_while_it_goes_on_and_ends_with_it(make: MakeEnv, small: Path) -> None:
    scans = []
    for mode in (None, "human"):
        env = make(small, render_mode=mode)
        env.reset(seed=1)
        scans.append([env.step(np.array([0.5, 0.5]))[0]["scan"].tolist() for _ in range(5)][-1])
    assert scans[0] == scans[1]
    assert env.render() is None
    address = env._screen.address
    assert address is not None
    port = int(address.split(":")[2].split("/")[0])
    assert listens(port)
    env.close()
    assert not listens(port)
