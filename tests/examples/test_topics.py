from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np

from twin.clouds.files import read_cloud

from .conftest import ROOT, Start
from .test_ros_args import Command


def test_the_listener_hears_the_talker_and_both_end_with_ctrl_c(start: Start) -> None:
    listener = start("listener")
    talker = start("talker", "--period", "0.02")
    listener.wait_for('[INFO] [listener]: I heard: "Hello World: 3"')
    talker.wait_for('[INFO] [talker]: Publishing: "Hello World: 3"\n')  # it logs after it has published
    assert talker.interrupt() == 0
    assert listener.interrupt() == 0


def test_clouds_of_arrays_are_heard_with_their_fields(start: Start, command: Command, tmp_path: Path) -> None:
    start("cloud_publisher", "--period", "0.05", "--frame", "hall")
    code, width, _ = command("topic", "echo", "/wave", "--once", "--field", "width")
    assert (code, width.split()[0]) == (0, "1681")
    kept = tmp_path / "wave.pcd"
    assert command("cloud", "save", "/coloured_wave", str(kept))[0] == 0
    cloud = read_cloud(kept)
    assert (cloud.shape, cloud.dtype.names) == ((41, 41), ("x", "y", "z", "rgb"))
    assert np.abs(cloud["z"]).max() < 0.201
    highest = np.unravel_index(cloud["z"].argmax(), cloud.shape)
    assert cloud["rgb"][highest] >> 16 == (cloud["rgb"] >> 16).max()


def test_a_program_without_a_graph_says_so_in_one_line(endpoint: str) -> None:
    command = [sys.executable, "examples/talker.py", "--connect", endpoint]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 2
    assert done.stderr.startswith(f"error: nobody answers at {endpoint}; start ")
    assert done.stderr.count("\n") == 1


def test_a_program_explains_its_arguments() -> None:
    command = [sys.executable, "examples/talker.py", "--help"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert "Say Hello World on /chatter, once in a period [s]." in done.stdout
    assert "--period FLOAT" in done.stdout
