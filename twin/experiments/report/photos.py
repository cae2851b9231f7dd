"""Pictures of moments of a run, rendered by MuJoCo from what was recorded."""

from __future__ import annotations

import base64
import io
import math

from twin.experiments.report.told import Told
from twin.geometry import yaw_from_quat_wxyz
from twin.sim.photo import Camera, take

_SIZE = (640, 400)
_SIDEWAYS = math.radians(-140.0)
"""Where the camera stands, seen from the robot: behind it, to its right."""


def photo(told: Told, robot: str, time_s: float) -> str | None:
    """Return a picture of a robot as a `data:` address; None if it was not recorded.

    Raises:
        SimulationError: There is no OpenGL without a display here.
    """
    scene, time_ns = told.scene, round(time_s * 1e9)
    if scene is None or (pose := scene.pose(told.base(robot), time_ns)) is None:
        return None
    size = _size(told, robot)
    looking = math.degrees(yaw_from_quat_wxyz(pose.quat_wxyz) + _SIDEWAYS) + 180.0
    x, y, z = pose.xyz.tolist()
    camera = Camera(lookat=(x, y, z + 0.6 * size), distance=5.0 * size, azimuth=looking, elevation=-32.0)
    picture = take(scene.solids(time_ns), camera, *_SIZE)
    from PIL import Image

    buffer = io.BytesIO()
    Image.fromarray(picture).save(buffer, "JPEG", quality=82)
    return f"data:image/jpeg;base64,{base64.b64encode(buffer.getvalue()).decode()}"


def _size(told: Told, robot: str) -> float:
    """Return how far the bodies of a robot are from its base at the start, at least 0.3 m."""
    assert told.scene is not None
    paths = told.scene.paths
    base = paths[told.base(robot)][1][0][:3]
    starts = (poses[0][:3] for name, (_, poses) in paths.items() if name.startswith(f"{robot}/"))
    return max([0.3, *(math.dist(base, start) for start in starts)])
