"""Contacts of robots with other things: the truth, for checks and bumpers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

Vector = tuple[float, float, float]


class Contact(NamedTuple):
    """A robot's body touches another body."""

    body1: str
    """Link of a robot, `<robot>/<link>`."""
    body2: str
    """What it touches: a static, goods, or another robot's link."""
    force_N: float
    """Sum of the normal forces [N]."""
    geoms: tuple[tuple[str, str], ...]
    """The touching geoms, body1's first."""


class Touch(NamedTuple):
    """Something touches a body at one point."""

    other: str
    """What touches it: a link `<robot>/<link>`, a static, goods, or the floor."""
    push: Vector
    """The normal force on the body, along the axes of the world [N]."""


_FLOOR = -2
"""Stands for a robot's index."""


class ContactReader:
    """Finds the few contacts that matter among all contacts of a world, by masks over geoms."""

    def __init__(self, model: mujoco.MjModel, owners: Sequence[str], robot_of_geom: Sequence[int]) -> None:
        """Bind to a model.

        Args:
            model: The compiled world.
            owners: Name of the body or static that each geom belongs to.
            robot_of_geom: Index of the robot that each geom belongs to, -1 for none, -2 for the floor.
        """
        self._model = model
        self._owners = tuple(owners)
        self._names = tuple(model.geom(i).name or f"geom {i}" for i in range(model.ngeom))
        self._robot = np.array(robot_of_geom, dtype=np.int32)
        # By both geoms' robots; none and the floor, -1 and -2, are the last columns.
        self._matters = ~np.eye(self._robot.max(initial=0) + 3, dtype=bool)
        self._matters[_FLOOR, :] = self._matters[:, _FLOOR] = False
        self._force = np.zeros(6)
        self._harmless = b""
        """Geoms of contacts that do not matter, as on most ticks: wheels on the floor."""
        self._geoms_of: dict[str, NDArray[np.bool_]] = {}

    def read(self, data: mujoco.MjData) -> list[Contact]:
        """Return what robots touch except for themselves and the floor, one entry for each pair of bodies."""
        if data.ncon == 0:
            return []
        geoms = data.contact.geom
        touching = geoms.tobytes()
        if touching == self._harmless:
            return []
        robots = self._robot[geoms]
        kept = self._matters[robots[:, 0], robots[:, 1]]
        if not kept.any():
            self._harmless = touching
            return []
        kept &= data.contact.efc_address >= 0
        pairs: dict[tuple[str, str], tuple[float, list[tuple[str, str]]]] = {}
        for index in np.flatnonzero(kept):
            a, b = (int(geom) for geom in geoms[index])
            if self._robot[a] < 0:
                a, b = b, a
            mujoco.mj_contactForce(self._model, data, index, self._force)
            key = self._owners[a], self._owners[b]
            force, names = pairs.get(key, (0.0, []))
            pairs[key] = force + float(self._force[0]), [*names, (self._names[a], self._names[b])]
        return [Contact(*key, force, tuple(names)) for key, (force, names) in pairs.items()]

    def touches(self, data: mujoco.MjData, body: str) -> list[Touch]:
        """Return what touches a body, point by point, whatever it is."""
        if body not in self._geoms_of:
            self._geoms_of[body] = np.array([owner == body for owner in self._owners])
        contact = data.contact
        # Read once: each look makes arrays of all contacts.
        geoms, normals = contact.geom, contact.frame[:, :3]
        mine = self._geoms_of[body][geoms]
        touches = []
        for index in np.flatnonzero((mine[:, 0] != mine[:, 1]) & (contact.efc_address >= 0)).tolist():
            mujoco.mj_contactForce(self._model, data, index, self._force)
            outwards = bool(mine[index, 0])  # normals point from the first geom to the second
            other = self._owners[geoms[index, int(outwards)]]
            force = float(-self._force[0] if outwards else self._force[0])
            x, y, z = normals[index].tolist()
            touches.append(Touch(other, (force * x, force * y, force * z)))
        return touches
