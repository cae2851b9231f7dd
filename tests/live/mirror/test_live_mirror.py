"""A mirror beside a robot of another process, by the clock on the wall."""

from __future__ import annotations

import itertools
import subprocess
import sys
from collections.abc import Callable
from contextlib import ExitStack, closing
from pathlib import Path
from typing import Any

import pytest

from tests.cable import Cable
from tests.processes import free_endpoint, program, wait_for_listener
from twin.bridge.wire.session import SessionConfig
from twin.geometry import Pose2
from twin.live.mirror.live_source import LiveSource
from twin.live.mirror.mirror import Mirror
from twin.recording.read_back import read
from twin.scenario.schema import load

LONG_S = 100.0
TICK_S = 0.02


class Watched:
    """A mirror of the figure of eight, whose mission runs here, and what it was at each tick."""

    def __init__(self, endpoint: str, out: Path | None = None) -> None:
        source = LiveSource(SessionConfig(mode="client", connect=(endpoint,)))
        self.mirror = Mirror(load("diff_bot_figure8"), source, autonomy="all", out=out)
        (self.robot,) = self.mirror.robots
        self.world = self.mirror.run.run.world
        self.ticks: list[tuple[float, str, float | None, Pose2]] = []
        """Time [s], label, age of the data [s], pose of the virtual robot."""

    def until(self, condition: Callable[[], Any], seconds: float = LONG_S) -> bool:
        """Go on until a condition holds; False if it does not in so many simulated seconds."""
        end_s = self.world.time_ns * 1e-9 + seconds
        held = False

        def look() -> bool:
            nonlocal held
            (status,) = self.mirror.statuses()
            now_s = self.world.time_ns * 1e-9
            self.ticks.append((now_s, status.judgement.label, status.evidence.age_s, status.virtual))
            held = bool(condition())
            return held or now_s > end_s

        self.mirror.advance(look)
        return held

    @property
    def label(self) -> str:
        return self.ticks[-1][1]

    def close(self) -> None:
        self.mirror.close()


def test_a_cut_link_degrades_it_at_once_and_it_comes_back_without_a_jump(
    endpoint: str, tmp_path: Path
) -> None:
    with program("plant", "diff_bot_figure8", "--listen", endpoint):
        wait_for_listener(endpoint)
        with closing(Cable(endpoint)) as cable, closing(Watched(cable.endpoint, tmp_path)) as watched:
            assert watched.until(lambda: watched.label == "twin"), watched.mirror.statuses()
            cable.whole.clear()
            before = len(watched.ticks)
            assert watched.until(lambda: watched.label != "twin")
            assert watched.ticks[-1][2] <= 0.4 + 2 * TICK_S
            watched.until(lambda: False, 3.0)
            resets = watched.robot.follower.resets
            cable.whole.set()
            assert watched.until(lambda: watched.label == "twin")
            poses = [pose for _, _, _, pose in watched.ticks[before:]]
            assert max(a.distance(b) for a, b in itertools.pairwise(poses)) < TICK_S * (0.5 + 0.6)
            assert watched.robot.follower.resets == resets
    recording = read(tmp_path / "diff_bot_figure8.rrd")
    assert {"twin", "shadow"} <= set(recording.table("/mission/label")["state"].to_pylist())
    assert "/velocity/diff_bot/linear/measured" in recording.entities, "what came through the link is shown"


def test_a_robot_that_starts_again_is_followed_again_and_that_is_told(endpoint: str) -> None:
    robot = ["plant", "diff_bot_figure8", "--listen", endpoint, "--perturb"]
    with program(*robot, "clock_offset=0s"):
        wait_for_listener(endpoint)
        watched = Watched(endpoint)
        assert watched.until(lambda: watched.label == "twin"), watched.mirror.statuses()
    with closing(watched), program(*robot, "clock_offset=3600s"):
        assert watched.until(lambda: watched.label != "twin")
        assert watched.until(lambda: watched.label == "twin"), watched.mirror.statuses()
        clocks = [event for event in watched.robot.events if event.what == "clock"]
        assert len(clocks) == 1
        assert "set by +3" in clocks[0].text


TWO = """
name: two
duration: 20 s
robots:
  - {name: left, model: diff_bot, pose: {y: 1.5}}
  - {name: right, model: diff_bot, pose: {y: -1.5}}
missions:
  - {type: velocity_profile, robot: left, steps: [{duration: 100 s, linear: 0.2 m/s, angular: 20 deg/s}]}
  - {type: velocity_profile, robot: right, steps: [{duration: 100 s, linear: 0.2 m/s, angular: -20 deg/s}]}
checks: [{no_collision: }]
"""


def test_two_robots_in_processes_of_their_own_are_followed_each_by_its_clock(
    endpoint: str, tmp_path: Path
) -> None:
    file = tmp_path / "two.yaml"
    file.write_text(TWO, encoding="utf-8")
    other = free_endpoint()
    with ExitStack() as ending:
        for name, where, offset in (("left", endpoint, "7s"), ("right", other, "-7s")):
            robot = ("plant", str(file), "--robot", name, "--perturb", f"clock_offset={offset}")
            ending.enter_context(program(*robot, "--listen", where))
            wait_for_listener(where)
        source = LiveSource(SessionConfig(mode="peer", connect=(endpoint, other)))
        mirror = ending.enter_context(Mirror(load(file), source, autonomy="all"))
        mirror.advance(
            lambda: (
                all(status.judgement.label == "twin" for status in mirror.statuses())
                or mirror.run.run.world.time_ns > LONG_S * 1e9
            )
        )
        found = {status.robot: status for status in mirror.statuses()}
    assert {name: status.judgement.label for name, status in found.items()} == {
        "left": "twin",
        "right": "twin",
    }
    assert found["left"].clock_offset_s == pytest.approx(7.0, abs=0.2)
    assert found["right"].clock_offset_s == pytest.approx(-7.0, abs=0.2)


MUTE = """
import sys, time
from twin.bridge import live
from twin.bridge.msgs import Odometry, TFMessage, TransformStamped, header, new
from twin.bridge.node.options import BARE

with live.join((), listen=[sys.argv[1]]) as process:
    node = process.bus.create_node("driver", options=BARE)
    odometry, transforms = (
        node.create_publisher(*each) for each in ((Odometry, "/odom", 10), (TFMessage, "/tf", 100))
    )

    def tell():
        stamp = header(time.time_ns() + 3600_000_000_000, "odom")
        odometry.publish(new(Odometry, header=stamp, child_frame_id="base_footprint"))
        transforms.publish(
            TFMessage(transforms=[new(TransformStamped, header=stamp, child_frame_id="base_footprint")])
        )

    node.create_timer(20_000_000, tell)
    process.spin()
"""


def test_a_robot_that_answers_no_question_is_followed_by_what_it_says_and_that_is_told(
    endpoint: str,
) -> None:
    with subprocess.Popen([sys.executable, "-c", MUTE, endpoint]) as robot:
        try:
            wait_for_listener(endpoint)
            with closing(Watched(endpoint)) as watched:
                assert watched.until(lambda: watched.robot.difference is not None)
                (status,) = watched.mirror.statuses()
                assert status.judgement.label == "shadow"
                said = "the robot answers no question: its clock is known by its fastest messages alone"
                assert said in status.judgement.why
                assert status.clock_offset_s is not None
                assert 3600.0 - 0.5 < status.clock_offset_s < 3600.01, "too little by what a message takes"
                assert [event.what for event in watched.robot.events if event.what == "clock"] == []
        finally:
            robot.kill()
