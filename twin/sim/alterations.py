"""Physics that changes during a run: friction, masses, where wheels are mounted; exact again afterwards."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from twin.convert.contact_roles import commanded_wheels
from twin.geometry import Array
from twin.models.description import RobotDescription
from twin.sim.factors import Factors

_SLIDING = 3
"""`condim` of a contact with friction along the surface only."""


class Grip(NamedTuple):
    """How shapes held on to what they touched in the last physics step."""

    touches: bool
    tangential_N: float
    """Sum of the forces along the surfaces [N]."""
    share: float
    """Of what friction can give, the largest of all contacts; 1: it slides."""


class Alterations:
    """Scales parts of a compiled model; of factors that several put on one quantity the product holds."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        self._model, self._data = model, data
        self._friction = model.geom_friction[:, 0].copy()
        self._condim = model.geom_condim.copy()
        self._mass, self._inertia = model.body_mass.copy(), model.body_inertia.copy()
        self._mounted = model.body_pos.copy()
        self._of: dict[tuple[str, int], Factors] = {}

    # -- names -----------------------------------------------------------------------------------------------

    def wheels(self, robot: str, description: RobotDescription) -> Mapping[str, Sequence[int]]:
        """Return the shapes by which driven wheels touch the floor, by joint."""
        return {
            wheel.joint.name: self._solid(f"{robot}/{wheel.link}") for wheel in commanded_wheels(description)
        }

    def casters(self, robot: str, description: RobotDescription) -> Mapping[str, Sequence[int]]:
        """Return the shapes of links that slide without friction, by link."""
        found = {link: self._solid(f"{robot}/{link}") for link in description.links}
        return {
            link: geoms
            for link, geoms in found.items()
            if geoms and all(self._condim[geom] == 1 for geom in geoms)
        }

    def position(self, geom: int) -> Array:
        """Return where a shape is, shape (3,) [m]."""
        xyz: Array = self._data.geom_xpos[geom]
        return xyz

    # -- changes ---------------------------------------------------------------------------------------------

    def scale_friction(self, geoms: Iterable[int], factor: float | None, who: object) -> None:
        """Let shapes slide along what they touch with `factor` of their own friction; None: as before."""
        for geom in geoms:
            product = self._put("friction", geom, factor, who)
            self._model.geom_friction[geom, 0] = self._friction[geom] * product

    def set_friction(self, geoms: Iterable[int], coefficient: float | None) -> None:
        """Give shapes a friction that have none of their own, such as casters; None: none again."""
        for geom in geoms:
            given = coefficient is not None
            self._model.geom_condim[geom] = _SLIDING if given else self._condim[geom]
            self._model.geom_friction[geom, 0] = coefficient if given else self._friction[geom]

    def friction(self, geom: int) -> float:
        """Return a shape's own coefficient."""
        return float(self._friction[geom])

    def scale_mass(self, bodies: Iterable[str], factor: float | None, who: object) -> float:
        """Let bodies have `factor` of their own mass; None: as before. Return what came on [kg]."""
        model, before = self._model, float(self._model.body_mass.sum())
        for body in bodies:
            index = int(model.body(body).id)
            product = self._put("mass", index, factor, who)
            model.body_mass[index] = self._mass[index] * product
            model.body_inertia[index] = self._inertia[index] * product
        self._settle()
        return float(model.body_mass.sum()) - before

    def scale_track(
        self, robot: str, description: RobotDescription, factor: float | None, who: object
    ) -> None:
        """Mount the wheels of a robot `factor` times as far from its middle; None: as before."""
        model, data = self._model, self._data
        root = int(model.body(f"{robot}/{description.root}").id)
        axes = data.xmat[root].reshape(3, 3)
        for wheel in commanded_wheels(description):
            body = int(model.body(f"{robot}/{wheel.link}").id)
            parent = int(model.body_parentid[body])
            frame = data.xmat[parent].reshape(3, 3)
            sideways = frame.T @ axes[:, 1]  # the robot's y axis as its parent sees it
            to_parent = float((data.xpos[parent] - data.xpos[root]) @ axes[:, 1])
            y = to_parent + float(self._mounted[body] @ sideways)
            product = self._put("track", body, factor, who)
            model.body_pos[body] = self._mounted[body] + (product - 1.0) * y * sideways
        self._settle()

    # -- what comes of it ------------------------------------------------------------------------------------

    def let_through(self, geoms: Iterable[str]) -> None:
        """Let nothing be stopped by shapes any more, by their names; rays see them as before."""
        for name in geoms:
            index = self._model.geom(name).id
            self._model.geom_contype[index] = self._model.geom_conaffinity[index] = 0

    def grip(self, geoms: Sequence[int]) -> Grip:
        """Return how shapes held on to what they touched in the last physics step."""
        model, data = self._model, self._data
        force = np.zeros(6)
        touches, total, most = False, 0.0, 0.0
        pairs: NDArray[np.int32] = data.contact.geom
        for index in np.flatnonzero(np.isin(pairs, geoms).any(axis=1)).tolist():
            mujoco.mj_contactForce(model, data, index, force)
            normal, tangential = float(force[0]), float(np.hypot(force[1], force[2]))
            if normal <= 0.0:
                continue
            touches, total = True, total + tangential
            limit = normal * float(data.contact.friction[index, 0])
            most = max(most, tangential / limit if limit > 0.0 else 0.0)
        return Grip(touches, total, most)

    def _solid(self, body: str) -> list[int]:
        index = int(self._model.body(body).id)
        first, count = int(self._model.body_geomadr[index]), int(self._model.body_geomnum[index])
        return [geom for geom in range(first, first + count) if self._model.geom_contype[geom]]

    def _put(self, what: str, index: int, factor: float | None, who: object) -> float:
        factors = self._of.setdefault((what, index), Factors())
        factors.put(who, factor)
        return factors.product

    def _settle(self) -> None:
        """Bring what MuJoCo derives from masses and mountings up to date."""
        # In data of its own: MuJoCo resets them.
        mujoco.mj_setConst(self._model, mujoco.MjData(self._model))
