"""`twin watch`: what a graph publishes is drawn where it is, and whoever is watched does not notice."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from urllib.parse import unquote

import numpy as np
import pytest
from rerun.experimental import ViewerClient

from tests.cli.ros.conftest import Twin
from tests.processes import free_endpoint, wait_for, wait_for_listener
from twin.recording import player
from twin.recording.player import has_vulkan, headless_viewer
from twin.recording.read_back import Recording, read

GRAPH = "watch_graph.py"


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What a watcher saves, if there is one."""
    return tmp_path_factory.mktemp("watch") / "new" / "seen.rrd"


@pytest.fixture(scope="module")
def seen(endpoint: str, file: Path) -> tuple[Recording, str]:
    """What a watcher has drawn of the graph, and said."""
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


def test_a_picture_hangs_before_its_camera_and_depths_do_not(seen: tuple[Recording, str]) -> None:
    """In the frame of `camera_info`, so that it travels with the camera; once, as it never changes."""
    entity = "/cameras/camera/image_raw/compressed"
    told = seen[0].columns[entity]
    assert told["Pinhole:parent_frame"].values == [["laser"]]
    assert told["Pinhole:resolution"].values == [[[32.0, 24.0]]]
    k = np.array(told["Pinhole:image_from_camera"].values[0][0]).reshape(3, 3).T
    assert k.tolist() == [[40.0, 0.0, 15.5], [0.0, 40.0, 11.5], [0.0, 0.0, 1.0]]
    assert told["CoordinateFrame:frame"].values == told["Pinhole:child_frame"].values
    assert "Pinhole:resolution" not in seen[0].columns["/cameras/depth/image_raw"]


@pytest.mark.skipif(not has_vulkan(), reason="no Vulkan driver: apt-get install mesa-vulkan-drivers")
@pytest.mark.usefixtures("seen")
def test_no_view_of_a_graph_has_a_fault(file: Path) -> None:
    with headless_viewer(file, time_s=3.0) as client:
        views = client.get_state().views
    assert {"World", "Map", "camera", "depth"} <= {view.name for view in views}
    assert [(view.name, report) for view in views for report in view.reports] == []


def test_what_is_not_drawn_is_told(seen: tuple[Recording, str]) -> None:
    told = seen[1]
    assert "watching /camera/camera_info, /camera/image_raw/compressed, /depth/image_raw" in told
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


_LOST = """
import os, signal, sys
from twin.cli import main
from twin.recording.watch.watcher import Watcher

def update(self, update=Watcher.update):
    try:
        os.kill(os.getpid(), signal.SIGINT)
        update(self)
    except KeyboardInterrupt:
        pass

Watcher.update = update
main()
"""


def test_ctrl_c_that_is_lost_while_something_is_drawn_ends_the_watch(endpoint: str, tmp_path: Path) -> None:
    """C of Rerun and Arrow may make something else of it."""
    words = ["watch", "--connect", endpoint, "--save", str(tmp_path / "seen.rrd")]
    done = subprocess.run(
        [sys.executable, "-c", _LOST, *words], capture_output=True, text=True, timeout=60, check=False
    )
    assert (done.returncode, "Traceback" in done.stderr) == (0, False), done.stderr


Start = Callable[..., subprocess.Popen[str]]


@pytest.fixture
def twins() -> Iterator[Start]:
    """Start commands of `twin`, none of which outlives the test."""
    with ExitStack() as stack:

        def start(*words: str) -> subprocess.Popen[str]:
            command = [sys.executable, "-m", "twin.cli", *words]
            pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
            process = stack.enter_context(subprocess.Popen(command, text=True, **pipes))
            stack.callback(process.kill)
            return process

        yield start


def run(start: Start, folder: Path, *others: str) -> subprocess.Popen[str]:
    return start("run", "diff_bot_figure8", "--no-record", *others, "--out", str(folder))


@pytest.mark.long
def test_a_run_is_the_same_whoever_watches_it(twins: Start, tmp_path: Path) -> None:
    """One was there before it and sees it end, one comes and goes by Ctrl-C, one comes and stops reading."""
    endpoint = free_endpoint()
    words = "watch", "--connect", endpoint
    early = twins(*words, "--save", str(tmp_path / "early.rrd"))
    watched = run(twins, tmp_path / "watched", "--pace", "1", "--listen", endpoint)
    wait_for_listener(endpoint)
    guests = [twins(*words, "--save", str(tmp_path / f"{name}.rrd")) for name in "ab"]
    files = [tmp_path / f"{name}.rrd" for name in ("a", "b", "early")]
    # Half of that are layouts of the screen.
    wait_for(lambda: all(file.exists() and file.stat().st_size > 250_000 for file in files))
    os.kill(guests[1].pid, signal.SIGSTOP)
    assert "Traceback" not in ended(guests[0])
    assert digest(watched) == digest(run(twins, tmp_path / "alone"))
    os.kill(guests[1].pid, signal.SIGCONT)
    ended(guests[1])
    recording = read(tmp_path / "a.rrd")
    assert {"/ros/scan", "/ros/odom", "/tf", "/velocity/robot/linear/measured"} <= {*recording.entities}
    moved = [
        np.array(xyz) for (_, child), xyz in poses(recording, "/tf").items() if child == "base_footprint"
    ]
    assert np.linalg.norm(moved[-1]) > 0.01
    told = ended(early)
    assert "nobody publishes" in told
    assert read(tmp_path / "early.rrd").column("/ros/odom", "Arrows3D:origins").times_ns[-1] > 33e9


@pytest.mark.long
@pytest.mark.skipif(not has_vulkan(), reason="no Vulkan driver: apt-get install mesa-vulkan-drivers")
def test_a_run_is_the_same_whatever_becomes_of_its_viewers(twins: Start, tmp_path: Path) -> None:
    """The viewer of one page stops reading; the server of another is ended, and so is its watch."""
    endpoint = free_endpoint()
    watched = run(twins, tmp_path / "watched", "--pace", "1", "--listen", endpoint)
    wait_for_listener(endpoint)
    pages = [twins("watch", "--connect", endpoint, "--web") for _ in range(2)]
    shown = [next(filter(None, map(re.compile(r"http://\S+").search, page.stderr or ()))) for page in pages]
    url = unquote(shown[0].group().partition("?url=")[2])
    port = player.free_port()
    command = [player.viewer_binary(), "--bind", player.LOCALHOST, "--headless", "--port", str(port), url]
    viewer = subprocess.Popen(
        command, env=player.viewer_environment(), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    try:
        wait_for(lambda: player.listens(port))
        client = ViewerClient(f"rerun+http://{player.LOCALHOST}:{port}/proxy")
        wait_for(lambda: "World" in {view.name for view in client.get_state().views})
        viewer.send_signal(signal.SIGSTOP)
        for server in children(pages[1].pid):
            os.kill(server, signal.SIGTERM)
        _, told = pages[1].communicate(timeout=60)
        assert pages[1].returncode == 0
        assert "nothing is shown any more" in told
        assert watched.poll() is None
        assert digest(watched) == digest(run(twins, tmp_path / "alone"))
    finally:
        viewer.kill()
        viewer.wait()
    assert "Traceback" not in ended(pages[0])


def ended(process: subprocess.Popen[str]) -> str:
    """End a command by Ctrl-C, and return what it has said."""
    process.send_signal(signal.SIGINT)
    _, told = process.communicate(timeout=60)
    assert process.returncode == 0, told
    return told


def digest(process: subprocess.Popen[str]) -> str:
    words = process.communicate(timeout=200)[0].split()
    return words[words.index("digest") + 1]


def children(pid: int) -> list[int]:
    """Return the processes that a process of this computer has started."""
    return [
        int(child)
        for file in Path(f"/proc/{pid}/task").glob("*/children")
        for child in file.read_text().split()
    ]
