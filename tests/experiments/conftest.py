"""Small scenarios for experiments."""

from __future__ import annotations

from pathlib import Path

import pytest

ARCS = """\
name: arcs
seed: 1
duration: 3 s
robots: [{model: diff_bot}]
mission:
  type: velocity_profile
  robot: diff_bot
  steps:
    - {duration: 1.2 s, linear: 0.2 m/s, angular: 0.4 rad/s}
    - {duration: 5 s, linear: 0.2 m/s, angular: -0.4 rad/s}
checks: [{driven_distance: {min: 0.2 m}}]
"""


@pytest.fixture
def arcs(tmp_path: Path) -> Path:
    """Return the file of a robot that drives two arcs in 3 s."""
    file = tmp_path / "arcs.yaml"
    file.write_text(ARCS, encoding="utf-8")
    return file
