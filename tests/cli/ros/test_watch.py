"""`twin watch`: what a graph publishes is drawn where it is, and whoever is watched does not notice."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.cli.ros.conftest import Twin
from tests.processes import free_endpoint, wait_for, wait_for_listener
from twin.recording.read_back import Recording, read

GRAPH = "watch_graph.py"


@pytest.fixture(scope="module")
def seen(endpoint: str, tmp_path_factory: pytest.TempPathFactory) -> tuple[Recording, str]:
    """What a watcher has drawn of the graph, and said."""
    file = tmp_path_factory.mktemp("watch") / "new" / "seen.rrd"
    words = ["watch", "--save", str(file), "--for", "6", "--connect", endpoint]
    done = subprocess.run(
        [sys.executable, "-m", "twin.cli", *words], capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == ""
    return read(file), done.stderr


def poses(recording: Recording, entity: str) -> dict[tuple[str, str], list[float]]:
    """The last x, y, z of each child in its parent."""
    columns = [
        recording.column(entity, f"Transform3D:{name}").values
        for name in ("parent_frame", "child_frame", "translation")
    ]
    return {(parent, child): list(xyz) for (parent,), (child,), (xyz,) in zip(*columns, strict=True)}


def test_frames_of_the_graph_are_those_of_the_screen(seen: tuple[Recording, str]) -> None:
    found = poses(seen[0], "/tf")
    assert found["world", "map"] == [0.0, 0.0, 0.0]
    assert found["map", "odom"] == [0.0, 0.5, 0.0]
    assert found["odom", "base_link"] == [1.0, 0.0, 0.0]
    assert found["base_link", "laser"] == pytest.approx([0.2, 0.0, 0.1])
    assert found["base_link", "mast"] == [0.0, 0.0, 0.25]  # nobody publishes it: by description and joints
    assert [parent for parent, _ in found].count("world") == 1


def test_a_scan_stays_where_the_lidar_was(seen: tuple[Recording, str]) -> None:
    recording = seen[0]
    assert recording.column("/ros/scan", "Points3D:positions").values[-1][0] == pytest.approx([2.0, 0.0, 0.0])
    ((_, xyz),) = poses(recording, "/tf_topics/scan").items()
    assert xyz == pytest.approx([1.0, 0.7, 0.1])  # map -> odom -> base_link, turned -> laser
    times_ns = recording.column("/ros/scan", "Points3D:positions").times_ns
    assert 0 <= times_ns[0] <= times_ns[-1] < 60e9  # wall time counts from the first look


def test_what_is_published_is_drawn_as_it_is(seen: tuple[Recording, str]) -> None:
    recording, told = seen
    assert recording.column("/ros/map", "GridMap:data").values
    assert recording.column("/world/robot/base_link", "Boxes3D:half_sizes").values[0][0] == pytest.approx(
        [0.2, 0.1, 0.05]
    )
    assert "not drawn: 1 meshes of /robot_description, whose files are not here" in told
    assert recording.column("/ros/marks/goals/3", "Ellipsoids3D:half_sizes").values
    assert "/cameras/depth/image_raw" in recording.entities
    assert recording.scalars("/joints/robot/to_mast")[1][-1] == 0.25


def test_what_is_not_drawn_is_told(seen: tuple[Recording, str]) -> None:
    told = seen[1]
    assert "watching /camera/image_raw/compressed, /depth/image_raw" in told
    assert "not drawn: /camera/image_raw, /imu; --topics shows" in told
    assert "Traceback" not in told


def test_only_what_is_named_is_heard(twin: Twin, tmp_path: Path) -> None:
    done = twin("watch", "--save", str(tmp_path / "seen.rrd"), "--for", "5", "--topics", "im?")
    assert done.returncode == 0, done.stderr
    recording = read(tmp_path / "seen.rrd")
    assert "/ros/scan" not in recording.entities
    (text,) = recording.column("/messages/imu", "TextDocument:text").values[0]
    assert "angular_velocity_covariance" in text


def test_nobody_is_there(twin: Twin) -> None:
    """What cannot be written is a sentence, not a trace."""
    done = twin("watch", "--save", "/proc/no/seen.rrd", "--for", "3")
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1].startswith("error: /proc/no/seen.rrd: cannot write the recording")


@pytest.mark.long
def test_a_run_is_the_same_whoever_watches_it(tmp_path: Path) -> None:
    """One comes and goes by Ctrl-C; one comes and stops reading."""

    def run(*others: str) -> subprocess.Popen[str]:
        words = ["run", "diff_bot_figure8", "--no-record", *others]
        command = [sys.executable, "-m", "twin.cli", *words, "--out", str(tmp_path / str(len(others)))]
        return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)

    def watch(file: Path, endpoint: str) -> subprocess.Popen[str]:
        words = ["watch", "--save", str(file), "--connect", endpoint]
        command = [sys.executable, "-m", "twin.cli", *words]
        return subprocess.Popen(command, stderr=subprocess.PIPE, text=True)

    def digest(process: subprocess.Popen[str]) -> str:
        words = process.communicate(timeout=200)[0].split()
        return words[words.index("digest") + 1]

    endpoint = free_endpoint()
    watched = run("--pace", "1", "--listen", endpoint)
    wait_for_listener(endpoint)
    guests = [watch(tmp_path / f"{name}.rrd", endpoint) for name in "ab"]
    files = [tmp_path / f"{name}.rrd" for name in "ab"]
    wait_for(lambda: all(file.exists() and file.stat().st_size > 100_000 for file in files))
    os.kill(guests[1].pid, signal.SIGSTOP)
    guests[0].send_signal(signal.SIGINT)
    _, told = guests[0].communicate(timeout=60)
    assert guests[0].returncode == 0
    assert "Traceback" not in told
    assert digest(watched) == digest(run())
    os.kill(guests[1].pid, signal.SIGCONT)
    guests[1].send_signal(signal.SIGINT)
    guests[1].communicate(timeout=60)
    assert guests[1].returncode == 0
    recording = read(tmp_path / "a.rrd")
    assert {"/ros/scan", "/ros/odom", "/tf", "/velocity/robot/linear/measured"} <= {*recording.entities}
    moved = [
        np.array(xyz) for (_, child), xyz in poses(recording, "/tf").items() if child == "base_footprint"
    ]
    assert np.linalg.norm(moved[-1]) > 0.01
