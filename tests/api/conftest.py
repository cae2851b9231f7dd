"""Small scenarios for simulations in this process."""

from __future__ import annotations

from pathlib import Path

import pytest

CIRCLE = """\
name: circle
seed: 1
duration: 3 s
robots: [{model: diff_bot}]
mission:
  type: velocity_profile
  robot: diff_bot
  steps: [{duration: 10 s, linear: 0.2 m/s, angular: 0.4 rad/s}]
checks: [{driven_distance: {min: 0.2 m}}]
"""
IDLE = """\
name: idle
duration: 20 s
robots: [{model: diff_bot}]
checks: [{driven_distance: {min: 1 mm}}]
"""


@pytest.fixture
def circle(tmp_path: Path) -> Path:
    """Return the file of a robot that drives for 3 s."""
    file = tmp_path / "circle.yaml"
    file.write_text(CIRCLE, encoding="utf-8")
    return file


@pytest.fixture
def idle(tmp_path: Path) -> Path:
    """Return the file of a robot that waits for a script."""
    file = tmp_path / "idle.yaml"
    file.write_text(IDLE, encoding="utf-8")
    return file
