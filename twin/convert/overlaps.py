"""Collision shapes that touch at joint position zero, by MuJoCo's collision detection."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import islice
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from twin.convert.contacts import LEAST_DEPTH
from twin.convert.geoms import primitive
from twin.models.checks.diagnostic import Diagnostic, finding
from twin.models.checks.wheels import wheels_of
from twin.models.description import RobotDescription
from twin.models.kinematics import link_poses, rigid_groups
from twin.models.mesh.hulls import hull_of
from twin.models.shapes import Geometry, Mesh
from twin.models.solids import is_solid

MOST_PAIRS = 50_000
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
