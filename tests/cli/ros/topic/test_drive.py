"""The course's `topic pub -r 10 /cmd_vel …` drives a robot of `twin run`, seen by `topic echo /odom`."""

from __future__ import annotations

import math
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.processes import free_endpoint, wait_for_listener

SCENARIO = """
name: open_floor
duration: 120 s
robots:
  - model: diff_bot
mission: {type: idle}
checks:
  - driven_distance: {max: 100 m}
"""
TWIST = "{linear: {x: 0.1}, angular: {z: 0.5}}"
RADIUS = 0.1 / 0.5


@contextmanager
def twin(*arguments: str) -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, "-m", "twin.cli", *arguments]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            yield process
        finally:
            process.send_signal(signal.SIGINT)
            process.communicate(timeout=120)


def positions(echo: subprocess.Popen[str]) -> Iterator[tuple[float, float]]:
    assert echo.stdout is not None
    for line in echo.stdout:
        x, y, _ = line.split(",")
        yield float(x), float(y)


@pytest.mark.slow
@pytest.mark.timeout(120)
def test_pub_drives_the_robot_of_a_run_on_a_circle(tmp_path: Path) -> None:
    endpoint = free_endpoint()
    (tmp_path / "open_floor.yaml").write_text(SCENARIO)
    run = ("run", str(tmp_path / "open_floor.yaml"), "--listen", endpoint, "--pace", "1", "--no-record")
    with twin(*run, "--out", str(tmp_path / "out")):
        wait_for_listener(endpoint)
        connect = ("--connect", endpoint)
        watch = ("topic", "echo", "/odom", "--field", "pose.pose.position", "--csv")
        pub = ("topic", "pub", "-p", "0", "-r", "10", "/cmd_vel", "geometry_msgs/msg/Twist", TWIST)
        with twin(*watch, *connect) as echo, twin(*pub, *connect):
            track = []
            for x, y in positions(echo):
                track.append((x, y))
                if x < -0.05:  # more than half of the circle
                    break
    off = [abs(math.hypot(x, y - RADIUS) - RADIUS) for x, y in track]
    assert max(off) < 0.1 * RADIUS
    assert max(y for _, y in track) > 1.9 * RADIUS
