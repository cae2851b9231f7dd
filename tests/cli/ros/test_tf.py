"""`twin tf …` in a process of its own, about the transforms of another one."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

from tests.cli.ros.conftest import ROOT
from tests.processes import free_endpoint
from twin.bridge import live
from twin.bridge.msgs import TFMessage, ns
from twin.bridge.tf import StaticTransformBroadcaster, transform_stamped
from twin.geometry import Pose3

Twin = Callable[..., subprocess.CompletedProcess[str]]


GRAPH = "some_transforms.py"


def patiently(twin: Twin, *arguments: str, until: str) -> subprocess.CompletedProcess[str]:
    """Listen for 0.4 s, or, if a busy machine brought too little by then, for longer."""
    for seconds in ("0.4", "4", "40"):
        done = twin(*arguments, seconds)
        if until in done.stdout:
            break
    assert done.returncode == 0, done.stderr
    return done


def test_tree(twin: Twin) -> None:
    lines = patiently(twin, "tf", "tree", "-t", until="base_link").stdout.splitlines()
    assert lines[0] == "odom"
    assert re.fullmatch(r"└── base_link  \(\d+\.\d+ Hz, latest at \d+\.\d+ s, from /driver\)", lines[1])
    assert lines[2:] == [
        "    ├── imu  (static, from /robot/mounts)",
        "    └── laser  (static, from /robot/mounts)",
    ]


def test_echo_has_tf2_echos_words(twin: Twin) -> None:
    done = twin("tf", "echo", "odom", "laser", "--once")
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert re.fullmatch(r"At time \d+\.\d{9}", lines[0])
    assert lines[1] == "- Translation: [1.000, 2.500, 0.250]"
    assert re.fullmatch(r"- Rotation: in Quaternion \(xyzw\) \[0\.707, 0\.707, -?0\.000, 0\.000\]", lines[2])
    assert lines[4] == "- Rotation: in RPY (degree) [180.000, -0.000, 90.000]" or "180.000" in lines[4]
    assert lines[5] == "- Matrix:"
    assert [[abs(float(value)) for value in line.split()] for line in lines[6:]] == [
        [0.0, 1.0, 0.0, 1.0],
        [1.0, 0.0, 0.0, 2.5],
        [0.0, 0.0, 1.0, 0.25],
        [0.0, 0.0, 0.0, 1.0],
    ]


def test_echo_of_a_frame_that_is_not_there_says_what_it_waits_for(twin: Twin) -> None:
    done = twin("tf", "echo", "odom", "lasr", "--once", "--timeout", "1.2")
    assert done.returncode == 2
    assert "Waiting for transform odom ->  lasr: the frame 'lasr' is not in the transform tree" in done.stderr
    assert "no transform odom -> lasr within 1.2 s" in " ".join(done.stderr.split())


def test_echo_waits_for_a_frame_that_appears_later(tmp_path: Path) -> None:
    address, said = free_endpoint(), tmp_path / "said"
    with live.join([], listen=[address], domain_id=0) as process:
        broadcaster = StaticTransformBroadcaster(process.bus.create_node("mounts"))
        pose = Pose3.from_xyz_rpy((1.0, 0.0, 0.0))
        broadcaster.send_transform(transform_stamped("map", "odom", 0, pose))
        command = [
            sys.executable,
            "-m",
            "twin.cli",
            "tf",
            "echo",
            "map",
            "late",
            "--once",
            "--connect",
            address,
        ]
        env = {**os.environ, "PYTHONPATH": str(ROOT), "ROS_DOMAIN_ID": "0"}
        with (
            said.open("w") as errors,
            subprocess.Popen(command, stdout=subprocess.PIPE, stderr=errors, text=True, env=env) as echo,
        ):
            waiting = "the frame 'late' is not in the transform tree; it has: map, odom"
            assert process.spin(lambda: waiting in " ".join(said.read_text().split()), timeout_s=100)
            broadcaster.send_transform(transform_stamped("odom", "late", 0, pose))
            assert process.spin(lambda: echo.poll() is not None, timeout_s=100)
            assert echo.stdout is not None
            assert "- Translation: [2.000, 0.000, 0.000]" in echo.stdout.read()
    assert echo.returncode == 0


def test_monitor(twin: Twin) -> None:
    done = patiently(twin, "tf", "monitor", "--once", "--duration", until="Frame: base_link")
    assert "RESULTS: for all Frames" in done.stdout
    frame = re.search(
        r"Frame: base_link, published by /driver, Average Delay: (\S+), Max Delay: (\S+), Rate: (\S+) Hz",
        done.stdout,
    )
    assert frame, done.stdout
    assert 0.0 < float(frame[1]) <= float(frame[2])
    assert float(frame[3]) > 0.0
    assert re.search(r"Node: /driver \S+ Hz, Average Delay: \S+ Max Delay: \S+", done.stdout)
    chain = twin("tf", "monitor", "odom", "laser", "--once", "--duration", "0.4")
    assert "Chain is: odom -> base_link -> laser" in chain.stdout
    assert "Net delay     avg = " in chain.stdout


def test_frames_as_gv_and_svg(twin: Twin, tmp_path: Path) -> None:
    done = patiently(twin, "tf", "frames", "-t", until='"odom" -> "base_link"')
    assert '"odom" -> "base_link"[label=" Broadcaster: /driver\\nAverage rate: ' in done.stdout
    assert (
        '"base_link" -> "laser"[label=" Broadcaster: /robot/mounts\\nAverage rate: 10000.000' in done.stdout
    )
    picture = tmp_path / "new" / "frames.svg"
    assert twin("tf", "frames", "-t", "0.4", "-o", str(picture)).returncode == 0
    texts = {element.text for element in ElementTree.parse(picture).iter() if element.tag.endswith("text")}
    assert {"odom", "base_link", "laser", "imu", "/driver", "/robot/mounts"} <= texts
    refused = twin("tf", "frames", "-o", str(tmp_path / "frames.pdf"))
    assert refused.returncode == 2
    assert ".gv or .svg" in refused.stderr


def test_throttled_frames_are_published_seldom(endpoint: str) -> None:
    command = [sys.executable, "-m", "twin.cli", "tf", "throttle", "odom", "laser", "--rate", "2"]
    with (
        live.join([endpoint]) as process,
        subprocess.Popen([*command, "--connect", endpoint], stdout=subprocess.PIPE, text=True) as throttle,
    ):
        got: list[TFMessage] = []
        process.bus.create_node("ear").create_subscription(TFMessage, "tf_throttled", got.append)
        assert process.spin(until=lambda: len(got) == 4, timeout_s=100)
        throttle.send_signal(signal.SIGINT)
        assert throttle.communicate(timeout=120)[0] == "laser in odom -> /tf_throttled\n"
        assert throttle.returncode == 0
    pairs = {(t.header.frame_id, t.child_frame_id) for message in got for t in message.transforms}
    assert pairs == {("odom", "laser")}
    stamps = [ns(message.transforms[0].header.stamp) for message in got]
    assert stamps[-1] - stamps[0] > 0.4e9  # three periods of 0.5 s, of transforms that come late or not
