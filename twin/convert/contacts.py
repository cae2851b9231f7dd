"""Which links may touch each other, and how high the robot stands."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations, product

import mujoco
import numpy as np

from twin.convert.conversion import Guess
from twin.convert.geoms import GROUP_COLLISION
from twin.errors import ConversionError, Problem
from twin.models.description import RobotDescription
from twin.models.kinematics import rigid_groups

LEAST_DEPTH = 1e-4
"""Shapes that just touch are meant to [m]."""
MOST_PAIRS = 50_000
"""Of links that do not touch each other; MuJoCo keeps each of them."""
_TYPE = mujoco.mjtGeom


def add_excludes(spec: mujoco.MjSpec, description: RobotDescription) -> None:
    """Exclude contacts between rigid groups that a joint connects, and of links that do not touch each other.

    MuJoCo has the first filter itself, but not towards a group that is welded to the world.
    """
    heads = rigid_groups(description)
    solid: dict[str, list[str]] = {head: [] for head in heads.values()}
    for name, link in description.links.items():
        if link.collisions:
            solid[heads[name]].append(name)
    pairs: dict[frozenset[str], tuple[str, str]] = {}
    for joint in description.joints.values():
        if joint.type != "fixed":
            for pair in product(solid[heads[joint.parent]], solid[heads[joint.child]]):
                pairs.setdefault(frozenset(pair), pair)
    every = [name for group in solid.values() for name in group]
    loners = [name for name in every if not may_touch(description, name, name)]
    _refuse_many(len(loners) ** 2 / 2, description)
    for pair in combinations(loners, 2):
        if heads[pair[0]] != heads[pair[1]]:
            pairs.setdefault(frozenset(pair), pair)
    for one, other in pairs.values():
        spec.add_exclude(bodyname1=one, bodyname2=other)


def may_touch(description: RobotDescription, link: str, other: str) -> bool:
    """Tell whether two links touch each other, as SDFormat's self_collide says: if one of them wants to.

    As in Gazebo, links that say nothing do not: shapes of real robots reach into each other's places.
    """
    said = [description.links[name].surface.self_collide for name in (link, other)]
    return any(description.self_collide if wish is None else wish for wish in said)


def exclude_overlaps(
    spec: mujoco.MjSpec, model: mujoco.MjModel, description: RobotDescription
) -> Iterator[Guess]:
    """Exclude, and yield, pairs of links inside of each other at joint position zero, with `model` of `spec`.

    They would push each other apart from the first step on.
    """
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_collision(model, data)
    deep = data.contact.geom[data.contact.dist < -LEAST_DEPTH]
    pairs = dict.fromkeys(map(tuple, model.geom_bodyid[deep].tolist()))
    _refuse_many(len(pairs), description)
    for one, other in pairs:
        names = [model.body(body).name for body in (one, other)]
        spec.add_exclude(bodyname1=names[0], bodyname2=names[1])
        note = "none: their shapes are inside of each other at joint position zero"
        yield Guess(element=f"contact of links '{names[0]}' and '{names[1]}'", note=note)


def _refuse_many(pairs: float, description: RobotDescription) -> None:
    if pairs > MOST_PAIRS:
        fault = f"more than {MOST_PAIRS} pairs of links do not touch each other"
        message = f"{fault}; leave out collision shapes, or say <self_collide>true where they are apart"
        raise ConversionError(Problem(message, description.source, code="too-large", element="robot"))


def spawn_height(model: mujoco.MjModel) -> float:
    """Return how far the lowest collision point, all joints at zero, lies below the root link [m]."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    lowest = [
        data.geom_xpos[geom, 2] - _reach_down(model, geom, data.geom_xmat[geom].reshape(3, 3)[2])
        for geom in range(model.ngeom)
        if model.geom_group[geom] == GROUP_COLLISION
    ]
    return 0.0 - float(min(lowest)) if lowest else 0.0


def _reach_down(model: mujoco.MjModel, geom: int, down: np.ndarray) -> float:
    """Return how far a shape reaches along `down`, a unit vector in its frame (either sign) [m]."""
    kind, size = model.geom_type[geom], model.geom_size[geom]
    if kind == _TYPE.mjGEOM_BOX:
        return float(np.abs(down) @ size)
    if kind == _TYPE.mjGEOM_ELLIPSOID:
        return float(np.linalg.norm(down * size))
    if kind == _TYPE.mjGEOM_CYLINDER:
        return float(np.hypot(down[0], down[1]) * size[0] + abs(down[2]) * size[1])
    if kind == _TYPE.mjGEOM_CAPSULE:
        return float(size[0] + abs(down[2]) * size[1])
    if kind == _TYPE.mjGEOM_MESH:
        mesh = model.geom_dataid[geom]
        start, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        return float(np.max(model.mesh_vert[start : start + count] @ -down))
    return float(size[0])
