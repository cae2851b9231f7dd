"""What a recording shows at a moment: where bodies were, and the solids they are drawn with."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array, Pose3, wxyz_from_xyzw
from twin.models.shapes import Box, Capsule, Cylinder, Sphere
from twin.recording.frames import WORLD
from twin.recording.read_back import Column, Recording
from twin.sim.photo import Solid

_PREFIX = "/world/"


class RecordedScene:
    """Bodies of a recording: their solids, and their poses over time."""

    def __init__(self, recording: Recording) -> None:
        self._recording = recording

    @cached_property
    def paths(self) -> dict[str, tuple[NDArray[np.int64], Array]]:
        """Times [ns], shape (n,), and true poses in `world` by body: x, y, z [m], i, j, k, w, (n, 7)."""
        columns = self._recording.columns.get("/tf", {})
        if not columns:
            return {}
        named = {name.partition(":")[2]: column for name, column in columns.items()}
        bodies = named["child_frame"].array.flatten().to_numpy(zero_copy_only=False)
        poses = np.hstack([_numbers(named["translation"], 3), _numbers(named["quaternion"], 4)])
        times = named["child_frame"].times_ns
        order = np.argsort(bodies, kind="stable")
        names, starts = np.unique(bodies[order], return_index=True)
        rows = np.split(order, starts[1:])
        return {str(name): (times[at], poses[at]) for name, at in zip(names, rows, strict=True)}

    def pose(self, body: str, time_ns: int) -> Pose3 | None:
        """Return where a body was, `T_world_body`; None if it is not recorded."""
        if body == WORLD:
            return Pose3.from_xyz_rpy()
        if body not in self.paths:
            return None
        times, poses = self.paths[body]
        found = poses[max(0, int(np.searchsorted(times, time_ns, side="right")) - 1)]
        return Pose3(found[:3], wxyz_from_xyzw(found[3:]))

    def solids(self, time_ns: int) -> list[Solid]:
        """Return what stood where at a time [ns]."""
        found = []
        for entity, columns in self._recording.columns.items():
            if not entity.startswith(_PREFIX) or "CoordinateFrame:frame" not in columns:
                continue
            frame = str(columns["CoordinateFrame:frame"].values[-1][0])
            pose = self.pose(frame, time_ns)
            if pose is not None:
                found += [
                    Solid(geometry=shape, pose=pose @ at, rgba=rgba) for shape, at, rgba in _shapes(columns)
                ]
        return found


def _shapes(columns: dict[str, Column]) -> Iterator[tuple[Any, Pose3, tuple[float, float, float, float]]]:
    """Yield geometry, pose in the entity's frame and colour of all that is drawn at an entity."""
    kinds = {name.partition(":")[0] for name in columns}
    for kind in sorted(kinds & {"Boxes3D", "Cylinders3D", "Capsules3D", "Ellipsoids3D"}):
        part = {
            name.partition(":")[2]: each.values[0] for name, each in columns.items() if name.startswith(kind)
        }
        centres = part.get("centers") or part["translations"]
        turns = part.get("quaternions") or [(0.0, 0.0, 0.0, 1.0)] * len(centres)
        for i, (centre, turn) in enumerate(zip(centres, turns, strict=True)):
            at = Pose3(np.array(centre), wxyz_from_xyzw(np.array(turn)))
            colour = part["colors"][min(i, len(part["colors"]) - 1)]
            if kind == "Boxes3D":
                x, y, z = part["half_sizes"][i]
                shape: Any = Box(size=(2.0 * x, 2.0 * y, 2.0 * z))
            elif kind == "Cylinders3D":
                shape = Cylinder(radius=part["radii"][i], length=part["lengths"][i])
            elif kind == "Capsules3D":
                shape = Capsule(radius=part["radii"][i], length=part["lengths"][i])
                at = at @ Pose3.from_xyz_rpy((0.0, 0.0, shape.length / 2.0))  # Rerun's origin: the lower cap
            else:
                shape = Sphere(radius=part["half_sizes"][i][0])
            yield shape, at, _rgba(colour)
    if "Mesh3D:vertex_colors" in columns:  # others are pictures
        corners = np.array(columns["Mesh3D:vertex_positions"].values[0]).reshape(-1, 3, 3)
        colours = np.array(columns["Mesh3D:vertex_colors"].values[0][::3], dtype=np.uint32)
        for colour in np.unique(colours):
            yield corners[colours == colour], Pose3.from_xyz_rpy(), _rgba(int(colour))


def _rgba(colour: int) -> tuple[float, float, float, float]:
    r, g, b, a = colour.to_bytes(4, "big")
    return r / 255.0, g / 255.0, b / 255.0, a / 255.0


def _numbers(column: Column, width: int) -> Array:
    """Return rows of one instance of so many numbers each, shape (n, width)."""
    flat = column.array.flatten().flatten().to_numpy(zero_copy_only=False)
    return np.asarray(flat, dtype=np.float64).reshape(-1, width)
