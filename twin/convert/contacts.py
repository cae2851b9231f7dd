"""Which links may touch each other, which shapes do at joint position zero, and how high the robot stands.

The latter by MuJoCo's collision detection.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import combinations, islice, product
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from twin.convert.conversion import Guess
from twin.convert.geoms import GROUP_COLLISION, primitive
from twin.errors import ConversionError, Problem
from twin.models.checks.diagnostic import Diagnostic, finding
from twin.models.checks.wheels import wheels_of
from twin.models.description import RobotDescription
from twin.models.kinematics import link_poses, rigid_groups
from twin.models.mesh.hulls import hull_of
from twin.models.shapes import Geometry, Mesh
from twin.models.solids import is_solid

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


"""Pairs of shapes that are looked at; robots have some hundreds near each other."""
LEAST_VOLUME = 1e-15
"""Of a mesh [m³]."""
WHEEL_GAP = 5e-4
"""A wheel closer than this to the part it turns in rubs on it [m]."""


def overlaps(description: RobotDescription) -> Iterator[Diagnostic]:
    """Yield parts whose shapes are inside of each other, and wheels that touch the part beside them.

    Parts that a joint connects may overlap, as MuJoCo lets them pass through each other; wheels may not, as a
    real one would rub. A mesh counts as its convex hull, as in the simulation; but a wheel inside the hull of
    its neighbour, such as a mudguard, does not rub.
    """
    heads = rigid_groups(description)
    wheels = {wheel.link for wheel in wheels_of(description)}
    joined = {frozenset((heads[joint.parent], heads[joint.child])) for joint in description.joints.values()}

    def may_touch(a: _Solid, b: _Solid) -> bool:
        if frozenset((heads[a.link], heads[b.link])) not in joined:
            return True
        pairs = ((a.link, b.geometry), (b.link, a.geometry))
        return any(wheel in wheels and not isinstance(beside, Mesh) for wheel, beside in pairs)

    for (a, b), distance in _distances(description, may_touch).items():
        neighbours = frozenset((heads[a], heads[b])) in joined
        if not neighbours and distance < -LEAST_DEPTH:
            inside = f"{-distance:.3g} m inside of each other at joint position zero"
            message = f"the collision shapes of '{a}' and '{b}' are {inside}"
            fix = "move or shrink one of them: they pass through each other, whatever <self_collide> says"
            yield finding(description, "overlap", f"link '{b}'", _line(description, b), message, fix)
        elif neighbours and distance < WHEEL_GAP and (a in wheels or b in wheels):
            wheel, other = (a, b) if a in wheels else (b, a)
            state = f"is {-distance:.3g} m inside of" if distance < -LEAST_DEPTH else "touches"
            line, message = _line(description, wheel), f"wheel '{wheel}' {state} '{other}', in which it turns"
            fix = "leave a gap of some mm: move the wheel outwards, or make one of the shapes narrower"
            yield finding(description, "wheel-rubs", f"link '{wheel}'", line, message, fix)


class _Solid(NamedTuple):
    """A collision shape."""

    link: str
    geometry: Geometry


def _distances(
    description: RobotDescription, may_touch: Callable[[_Solid, _Solid], bool]
) -> dict[tuple[str, str], float]:
    """Return the least distance [m], negative inside, of each pair of links with shapes that `may_touch`."""
    spec = mujoco.MjSpec()
    solids: list[_Solid] = []
    for name, pose in link_poses(description).items():
        for collision in description.links[name].collisions:
            if is_solid(collision) and not _is_dust(collision.geometry):
                placed = pose @ collision.T_link_geometry
                shape = _shape(spec, collision.geometry)
                spec.worldbody.add_geom(**shape, pos=placed.xyz, quat=placed.quat_wxyz)
                solids.append(_Solid(name, collision.geometry))
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    least: dict[tuple[str, str], float] = {}
    heads = rigid_groups(description)
    groups = np.unique([heads[solid.link] for solid in solids], return_inverse=True)[1]
    for i, j in islice(_near(model, data, groups), MOST_PAIRS):
        if not may_touch(solids[i], solids[j]):
            continue
        distance = mujoco.mj_geomDistance(model, data, i, j, WHEEL_GAP, None)
        if distance < WHEEL_GAP:
            pair = (solids[i].link, solids[j].link)
            least[pair] = min(distance, least.get(pair, np.inf))
    return least


def _is_dust(geometry: Geometry) -> bool:
    """Tell whether a mesh is too small for MuJoCo, which says so itself when the robot is converted."""
    hull = hull_of(geometry) if isinstance(geometry, Mesh) else None
    return hull is not None and hull.volume < LEAST_VOLUME


def _shape(spec: mujoco.MjSpec, geometry: Geometry) -> dict[str, Any]:
    if not isinstance(geometry, Mesh):
        kind, size = primitive(geometry)
        return {"type": kind, "size": size}
    hull = hull_of(geometry)
    assert hull is not None, "asked for only where is_solid"
    name = str(len(spec.meshes))
    spec.add_mesh(
        name=name, uservert=hull.points.ravel(), inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX
    )
    return {"type": mujoco.mjtGeom.mjGEOM_MESH, "meshname": name}


def _near(model: mujoco.MjModel, data: mujoco.MjData, groups: NDArray[np.int64]) -> Iterator[tuple[int, int]]:
    """Yield pairs of shapes of different rigid groups whose bounding spheres touch."""
    for i in range(model.ngeom):
        gaps = np.linalg.norm(data.geom_xpos[i + 1 :] - data.geom_xpos[i], axis=1)
        touch = gaps < model.geom_rbound[i + 1 :] + model.geom_rbound[i] + WHEEL_GAP
        for j in np.flatnonzero(touch & (groups[i + 1 :] != groups[i])):
            yield i, i + 1 + int(j)


def _line(description: RobotDescription, link: str) -> int:
    return description.links[link].collisions[0].line
