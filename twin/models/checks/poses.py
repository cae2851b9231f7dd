"""Visual and collision shapes that are not in the same place."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from twin.geometry import matrix_from_quat_wxyz
from twin.models.checks.diagnostic import Diagnostic, finding
from twin.models.description import Link, RobotDescription
from twin.models.shapes import Cylinder, Mesh
from twin.models.solids import all_solid, bounds

SHARE = 0.1
"""Of the visual's diagonal by which the centres may differ."""
LEAST = 5e-3
"""[m]"""
AXIS_DEG = 5.0
SIZES = 20.0
"""Ratio of the diagonals that simplifying does not explain; a forgotten unit does."""


def visual_collision(description: RobotDescription) -> Iterator[Diagnostic]:
    """Yield links that are seen and touched in different places."""
    for link in description.links.values():
        if not link.visuals or not link.collisions or not all_solid(link.shapes):
            continue
        meshes = any(isinstance(shape.geometry, Mesh) for shape in link.shapes)
        message = _differs(link) if meshes else _moved(link) or _turned(link)
        if message:
            element, line = f"link '{link.name}'", link.collisions[0].line
            fix = "give both the same <origin>"
            yield finding(description, "visual-collision", element, line, message, fix)


def _moved(link: Link) -> str | None:
    (low, high), (touch_low, touch_high) = bounds(link.visuals), bounds(link.collisions)
    if np.all(touch_low > low - LEAST) and np.all(touch_high < high + LEAST):
        return None  # a part of what is seen may be left untouched, such as an end inside of another link
    seen, touched = (low + high) / 2.0, (touch_low + touch_high) / 2.0
    distance = float(np.linalg.norm(seen - touched))
    if distance <= max(LEAST, SHARE * float(np.linalg.norm(high - low))):
        return None
    centres = [" ".join(f"{value + 0.0:.3g}" for value in np.round(point, 9)) for point in (seen, touched)]
    return f"its visual is around {centres[0]}, its collision around {centres[1]}: {distance:.3g} m apart"


def _differs(link: Link) -> str | None:
    """Compare where one is a mesh: simple shapes stand for some part of it, and are not centred on it."""
    (low, high), (touch_low, touch_high) = bounds(link.visuals), bounds(link.collisions)
    ratio = float(np.linalg.norm(high - low) / np.linalg.norm(touch_high - touch_low))
    if max(ratio, 1.0 / ratio) > SIZES:
        return f"its visual is {ratio:.3g} times as large as its collision: does one of them lack a scale?"
    distance = float(np.linalg.norm(np.maximum(np.maximum(low - touch_high, touch_low - high), 0.0)))
    return f"its visual and its collision are {distance:.3g} m apart" if distance > LEAST else None


def _turned(link: Link) -> str | None:
    if len(link.shapes) != 2 or not all(isinstance(shape.geometry, Cylinder) for shape in link.shapes):
        return None
    axes = [matrix_from_quat_wxyz(shape.T_link_geometry.quat_wxyz)[:, 2] for shape in link.shapes]
    angle = float(np.degrees(np.arccos(min(1.0, abs(float(axes[0] @ axes[1]))))))
    if angle <= AXIS_DEG:
        return None
    return f"the axes of its visual and its collision cylinder differ by {angle:.1f} degrees"
