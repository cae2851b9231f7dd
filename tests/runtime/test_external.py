"""Another process takes part in a run: it drives the robot and sees what the robot sees."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from pathlib import Path

import numpy as np

PEER = Path(__file__).with_name("outside_peer.py")
SCENARIO = """
name: driven_from_outside
seed: 1
duration: 5 s
robots: [{model: diff_bot}]
checks:
  - driven_distance: {min: 0.2 m, max: 3 m}
  - odometry_drift: {max: 10 cm}
"""


def test_another_process_drives_the_robot_and_listens(tmp_path: Path, endpoint: str) -> None:
    (tmp_path / "outside.yaml").write_text(SCENARIO, encoding="utf-8")
    words = [
        "run",
        "outside.yaml",
        "--pace",
        "1",
        "--listen",
        endpoint,
        "--no-record",
        "--json",
        "--out",
        "out",
    ]
    run = subprocess.Popen(
        [sys.executable, "-m", "twin.cli", *words], stdout=subprocess.PIPE, text=True, cwd=tmp_path
    )
    peer = subprocess.Popen([sys.executable, str(PEER), endpoint, "3"], stdout=subprocess.PIPE, text=True)
    try:
        heard = json.loads(peer.communicate(timeout=120)[0])
        verdict = json.loads(run.communicate(timeout=120)[0])
    finally:
        for process in (peer, run):
            process.kill()
            process.wait()
    assert peer.returncode == 0
    assert run.returncode == 0, verdict
    assert verdict["deterministic"] is False, "nobody can repeat what came from outside"
    distance = next(check for check in verdict["checks"] if check["name"].startswith("driven_distance"))
    assert distance["value"] > 0.2, "nothing in the scenario drives; the other process did"

    clock = np.array(heard["clock"])
    assert len(clock) > 50
    assert np.diff(clock).min() > 0.0
    ticks = np.diff(clock) / 0.02
    assert np.allclose(ticks, ticks.round()), "whole ticks; a busy network may drop some"
    assert np.median(ticks) < 1.5
    assert heard["count"] > 50
    first, last = heard["odom"]
    assert last["frames"] == ["odom", "base_footprint"]
    assert last["x"] > first["x"] + 0.1
    assert abs(last["y"]) < 0.05
    assert math.isclose(sum(v * v for v in last["q"]), 1.0, abs_tol=1e-9)
    assert math.isclose(last["vx"], 0.4, abs_tol=0.1)
    assert abs(last["t"] - clock[-1]) < 0.1


def test_without_listen_the_same_run_stands_still_and_is_deterministic(tmp_path: Path, endpoint: str) -> None:
    standing = SCENARIO.replace("min: 0.2 m", "min: 0 m").replace("  - odometry_drift: {max: 10 cm}\n", "")
    (tmp_path / "alone.yaml").write_text(standing, encoding="utf-8")
    words = ["run", "alone.yaml", "--no-record", "--json", "--out", "out"]
    done = subprocess.run(
        [sys.executable, "-m", "twin.cli", *words],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        timeout=120,
        check=False,
    )
    verdict = json.loads(done.stdout)
    assert (done.returncode, verdict["deterministic"]) == (0, True)
    assert verdict["checks"][0]["value"] < 0.01
