"""Rerun finds no fault in a recording of any scenario that ships: neither in the file nor on its screen."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any

import pytest

import twin
from twin.recording import player

SCENARIOS = Path(__file__).parents[2] / "scenarios"
SHIPPED = sorted(SCENARIOS.rglob("*.yaml"))


def verify(recording: Path, *options: str) -> subprocess.CompletedProcess[str]:
    """Have Rerun decode every component of a file by its type."""
    command = [player.viewer_binary(), "rrd", "verify", *options, str(recording)]
    environment = player.viewer_environment()
    return subprocess.run(command, capture_output=True, text=True, env=environment, check=False, timeout=120)


@pytest.mark.long
@pytest.mark.parametrize("file", SHIPPED, ids=lambda file: file.stem)
def test_rerun_finds_no_fault(file: Path, tmp_path: Path) -> None:
    """The screen is that of a run that has ended: what it had to show is there, and its verdict."""
    with twin.Simulation(file, out=tmp_path) as simulation:
        simulation.run_until(3.0)
    (recording,) = tmp_path.glob("*.rrd")
    checked = verify(recording, "--check-footers", "false")
    assert (checked.returncode, checked.stderr) == (0, "1 file verified without error.\n")
    if not player.has_vulkan():
        pytest.skip("no Vulkan driver: apt-get install mesa-vulkan-drivers")
    with player.headless_viewer(recording, time_s=2.5) as client:
        views = client.get_state().views
        told = [entry.message for entry in client.get_logs() if entry.level != "INFO"]
    assert {"Simulation", "Map", "Verdict"} <= {view.name for view in views}
    assert [(view.name, report) for view in views for report in view.reports] == []
    assert [message for message in told if "Software rasterizer" not in message] == []


def test_an_index_makes_a_recording_complete(recorded: Any, tmp_path: Path) -> None:
    """What is written has no footer; `rerun rrd optimize` adds it, as the docs say."""
    assert "Missing RRD footer" in verify(recorded.path).stderr
    whole = tmp_path / "whole.rrd"
    command = [player.viewer_binary(), "rrd", "optimize", str(recorded.path), "-o", str(whole)]
    subprocess.run(command, check=True, capture_output=True, env=player.viewer_environment(), timeout=120)
    assert verify(whole).returncode == 0
