"""Contacts of robots with other things: the truth, for checks and bumpers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import mujoco
import numpy as np

from twin.savings import ALL, Savings

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

    def __init__(
        self,
        model: mujoco.MjModel,
        owners: Sequence[str],
        robot_of_geom: Sequence[int],
        savings: Savings = ALL,
    ) -> None:
        """Bind to a model.

        Args:
            model: The compiled world.
            owners: Name of the body or static that each geom belongs to.
            robot_of_geom: Index of the robot that each geom belongs to, -1 for none, -2 for the floor.
            savings: What is not done over again.
        """
        self._model, self._savings = model, savings
        self._owners = tuple(owners)
        self._names = tuple(model.geom(i).name or f"geom {i}" for i in range(model.ngeom))
        self._robot = np.array(robot_of_geom, dtype=np.int32)
        # By both geoms' robots; none and the floor, -1 and -2, are the last columns.
        self._matters = ~np.eye(self._robot.max(initial=0) + 3, dtype=bool)
        self._matters[_FLOOR, :] = self._matters[:, _FLOOR] = False
        self._elliptic = bool(model.opt.cone == mujoco.mjtCone.mjCONE_ELLIPTIC)
        self._touching = b""
        """Geoms of all contacts; on most ticks those of the last one, such as wheels on the floor."""
        self._forces: list[float | None] | None = None
        """The normal force of each contact [N]; None where it does not act. None: not looked at yet."""
        self._pairs: list[tuple[int, tuple[str, str], tuple[str, str]]] = []
        """Of these the contacts that matter: index, names of the bodies and of the geoms."""
        self._of_body: dict[str, list[tuple[int, bool, str]]] = {}
        """Of these the contacts of a body: index, whether it is the first of the two, name of the other."""

    def read(self, data: mujoco.MjData) -> list[Contact]:
        """Return what robots touch except for themselves and the floor, one entry for each pair of bodies."""
        if not self._pairs:
            return []
        forces = self._normal_forces(data)
        found: dict[tuple[str, str], tuple[float, list[tuple[str, str]]]] = {}
        for index, bodies, names in self._pairs:
            force = forces[index]
            if force is not None:
                before, others = found.get(bodies, (0.0, []))
                found[bodies] = before + force, [*others, names]
        return [Contact(*bodies, force, tuple(names)) for bodies, (force, names) in found.items()]

    def touches(self, data: mujoco.MjData, body: str) -> list[Touch]:
        """Return what touches a body, point by point, whatever it is."""
        contacts = self._contacts_with(data, body)
        if not contacts:
            return []
        forces, normals = self._normal_forces(data), data.contact.frame[:, :3].tolist()
        touches = []
        for index, is_first, other in contacts:
            size = forces[index]
            if size is not None:
                x, y, z = normals[index]
                force = -size if is_first else size  # normals point from the first geom to the second
                touches.append(Touch(other, (force * x, force * y, force * z)))
        return touches

    def neighbours(self, data: mujoco.MjData, body: str) -> list[str]:
        """Return the names of what touches a body, or is about to, as often as there are points."""
        return [other for _, _, other in self._contacts_with(data, body)]

    def look(self, data: mujoco.MjData) -> None:
        """Take in the contacts of another physics step: which matter, if other geoms touch than before."""
        self._forces = None
        geoms = data.contact.geom
        touching = geoms.tobytes()
        if touching == self._touching and self._savings.unchanged_truth:
            return
        self._touching, self._of_body, self._pairs = touching, {}, []
        if not touching:
            return
        robots = self._robot[geoms]
        for index in np.flatnonzero(self._matters[robots[:, 0], robots[:, 1]]).tolist():
            a, b = geoms[index].tolist()
            if self._robot[a] < 0:
                a, b = b, a
            bodies, names = (self._owners[a], self._owners[b]), (self._names[a], self._names[b])
            self._pairs.append((index, bodies, names))

    def _contacts_with(self, data: mujoco.MjData, body: str) -> list[tuple[int, bool, str]]:
        found = self._of_body.get(body)
        if found is None:
            found = self._of_body[body] = []
            for index, pair in enumerate(data.contact.geom.tolist()):
                first, second = (self._owners[geom] for geom in pair)
                if (first == body) != (second == body):
                    found.append((index, first == body, second if first == body else first))
        return found

    def _normal_forces(self, data: mujoco.MjData) -> list[float | None]:
        if self._forces is not None:
            return self._forces
        addresses = data.contact.efc_address.tolist()
        if self._elliptic:
            rows = data.efc_force.tolist()  # the first of a contact; asking MuJoCo one by one takes longer
            self._forces = [rows[address] if address >= 0 else None for address in addresses]
            return self._forces
        force, self._forces = np.zeros(6), []
        for index, address in enumerate(addresses):
            mujoco.mj_contactForce(self._model, data, index, force)
            self._forces.append(float(force[0]) if address >= 0 else None)
        return self._forces
