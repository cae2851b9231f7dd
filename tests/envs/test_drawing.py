"""Pictures and the live view show what is simulated; wrappers of gymnasium go on top."""

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers import FrameStackObservation, RecordVideo
from gymnasium.wrappers.vector import NormalizeObservation, RecordEpisodeStatistics

from twin.envs.diff_drive_goal import DiffDriveGoalEnv, DiffDriveGoalVectorEnv
from twin.errors import SimulationError
from twin.recording import read_back
from twin.recording.stream import open_recording
from twin.recording.view import episode_view

ID = "twin.envs:twin/DiffDriveGoal-v0"
AT = {"start": (0.0, 0.0, 0.0), "goal": (3.0, 0.0)}


@pytest.fixture(scope="module")
def env():
    made = gym.make(ID, render_mode="rgb_array", max_episode_steps=5)
    made.reset(seed=0)
    try:
        made.render()
    except SimulationError as fault:
        pytest.skip(str(fault))
    yield made
    made.close()


def is_green(image):
    return (image[..., 1] > 1.5 * image[..., 0]) & (image[..., 1] > 1.5 * image[..., 2])


def is_blue(image):
    return (image[..., 2] > 1.5 * image[..., 0]) & (image[..., 2] > 1.3 * image[..., 1])


def test_a_picture_shows_goal_and_robot(env):
    env.reset(seed=0, options=AT)
    image = env.render()
    assert image.shape == (480, 640, 3)
    assert image.dtype == np.uint8
    (_, goal_x), (_, robot_x) = (
        np.argwhere(is_green(image)).mean(axis=0),
        np.argwhere(is_blue(image)).mean(axis=0),
    )
    assert 300 < robot_x < 340  # the middle of the room
    assert 430 < goal_x < 560  # 3 m to the east
    env.reset(seed=0, options={**AT, "start": (-2.0, 0.0, 0.0)})
    assert 150 < np.argwhere(is_blue(env.render())).mean(axis=0)[1] < 260


def test_each_environment_of_a_vector_has_its_picture(env):
    made = DiffDriveGoalVectorEnv(2, render_mode="rgb_array")
    made.reset(seed=0)
    images = made.render()
    assert len(images) == 2
    assert (images[0] != images[1]).any()
    env.reset(seed=1)
    np.testing.assert_array_equal(images[1], env.render())
    made.close()


def test_videos_are_recorded(env, tmp_path):
    recorder = RecordVideo(env, str(tmp_path / "videos"), episode_trigger=lambda _: True, disable_logger=True)
    recorder.reset(seed=0)
    for _ in range(5):
        *_, truncated, _ = recorder.step(np.array([0.5, 0.0]))
    assert truncated
    recorder.stop_recording()
    (video,) = tmp_path.glob("videos/*.mp4")
    assert video.stat().st_size > 1000


def test_frames_are_stacked(env):
    stacked = FrameStackObservation(env, 3)
    first, _ = stacked.reset(seed=0)
    assert first.shape == (3, 43)
    then, *_ = stacked.step(np.array([0.5, 0.0]))
    np.testing.assert_array_equal(then[1], first[2])
    assert stacked.observation_space.contains(then)


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_wrappers_of_vectors_go_on_top(mode):
    made = RecordEpisodeStatistics(gym.make_vec(ID, num_envs=3, max_episode_steps=4, autoreset_mode=mode))
    if mode == AutoresetMode.NEXT_STEP:  # NormalizeObservation wants it
        made = NormalizeObservation(made)
    made.reset(seed=0)
    rewards = np.zeros(3)
    for step in range(4):
        observation, reward, _, truncated, info = made.step(np.full((3, 2), 0.1))
        rewards += reward
        assert truncated.all() == (step == 3)
    assert np.abs(observation).max() < 13.0
    np.testing.assert_allclose(info["episode"]["r"], rewards, rtol=1e-5)
    assert list(info["episode"]["l"]) == [4, 4, 4]
    made.close()


def test_the_live_view_shows_each_step_where_it_happened(monkeypatch, tmp_path):
    class Unseen:
        page_url = None

        def __init__(self, tell):
            pass

        def put(self, act, *, lasting=False):
            pass

        def finish(self):
            pass

        def close(self):
            pass

    files = iter([tmp_path / "a.rrd", tmp_path / "b.rrd"])
    monkeypatch.setattr(episode_view, "LiveScreen", Unseen)
    monkeypatch.setattr(
        episode_view,
        "open_recording",
        lambda _, app, name, layout, screen: open_recording(next(files), app, name, layout),
    )
    env = DiffDriveGoalEnv(render_mode="human")
    env.reset(seed=0, options=AT)
    places = [env.navigation.simulations.root[0, :3].copy()]
    for _ in range(3):
        env.step(np.array([1.0, 0.0]))
        places.append(env.navigation.simulations.root[0, :3].copy())
    env.reset()
    env.close()
    recording = read_back.read(tmp_path / "a.rrd")
    assert "/world/goal" in recording.entities
    children = recording.column("/tf", "Transform3D:child_frame")
    moved = recording.column("/tf", "Transform3D:translation")
    at = [i for i, name in enumerate(children.values) if name == ["robot/base_footprint"]]
    np.testing.assert_allclose([moved.values[i][0] for i in at], places, atol=1e-6)
    assert [int(children.times_ns[i]) for i in at] == [0, 100_000_000, 200_000_000, 300_000_000]
    assert (tmp_path / "b.rrd").exists()
