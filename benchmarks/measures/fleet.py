"""A hall for a fleet: as many blocks of racks as wanted, around each of which a warehouse robot drives.

Every robot has its own stack (odometry, AMCL, navigation) and goals all the time, the four corners of its
block. All drive the same way round, so that neighbours meet on lanes beside each other; the lidars see them.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from twin.scenario.schema import Scenario, load

PITCH_X, PITCH_Y = 7.5, 5.0
"""From block to block [m]."""
LANE_X, LANE_Y = 2.7, 1.4
"""From a block's centre to the robot's way around it [m]."""
LAPS = 30
"""More than a robot drives in ten minutes."""


def fleet(folder: Path, robots: int, *, blocks: int, duration: float) -> Scenario:
    """Write arena and scenario into a folder; return the scenario.

    Args:
        folder: Where.
        robots: How many drive.
        blocks: How many there is room for; the hall is the same for any number of robots.
        duration: Simulated time [s].
    """
    columns = math.ceil(math.sqrt(blocks / 2.0))
    rows = math.ceil(blocks / columns)
    centres = [(PITCH_X * (i % columns), PITCH_Y * (i // columns)) for i in range(blocks)]
    arena = {
        "name": "hall",
        "hall": {
            "x": [-PITCH_X / 2.0, PITCH_X * (columns - 0.5)],
            "y": [-PITCH_Y / 2.0, PITCH_Y * (rows - 0.5)],
        },
        "racks": {
            f"rack_{i}": {"pose": [x - 0.3, y, 0.0], "length": 0.6, "depth": 3.0, "levels": [0.4, 0.8]}
            for i, (x, y) in enumerate(centres)
        },
        "stock": {"fill": 0.8},
    }
    _write(folder / "hall.yaml", arena)
    names = [f"robot_{i}" for i in range(robots)]
    scenario = {
        "name": "fleet",
        "seed": 1,
        "duration": duration,
        "world": {"arena": "./hall.yaml"},
        "robots": [
            {
                "model": "warehouse_bot",
                "name": name,
                "pose": {"x": x - LANE_X, "y": y - LANE_Y},
                "localisation": {"type": "amcl", "initial_pose_error": {"xy": 0.05, "yaw": 0.03}},
                "navigation": {},
            }
            for name, (x, y) in zip(names, centres, strict=False)
        ],
        "missions": [_laps(name, *centre) for name, centre in zip(names, centres, strict=False)],
        "checks": [
            {"no_collision": {}},
            *({"localisation_error": {"robot": name, "rms": 0.05}} for name in names),
            *({"driven_distance": {"robot": name, "min": 0.2 * duration}} for name in names),
        ],
    }
    _write(folder / "fleet.yaml", scenario)
    return load(folder / "fleet.yaml")


def _laps(robot: str, x: float, y: float) -> dict[str, Any]:
    corners = [
        (LANE_X, -LANE_Y, 90.0),
        (LANE_X, LANE_Y, 180.0),
        (-LANE_X, LANE_Y, -90.0),
        (-LANE_X, -LANE_Y, 0.0),
    ]
    goals = [{"navigate_to_pose": {"x": x + dx, "y": y + dy, "yaw": f"{yaw} deg"}} for dx, dy, yaw in corners]
    return {"type": "behaviors", "robot": robot, "steps": goals, "repeat": LAPS}


def _write(file: Path, content: Any) -> None:
    file.write_text(json.dumps(content), encoding="utf-8")  # which is YAML
