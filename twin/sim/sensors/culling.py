"""What `mj_multiRay` must not skip, and what it may: exact help for MuJoCo's own culling."""

from __future__ import annotations

import math

import mujoco
import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array
from twin.savings import ALL, Savings

_FLAT = 1e-12
"""Out of their plane, rays of unit length reach no farther than that."""
_FLAT_M = 1e-6
"""As far as rays reach out of their plane at the end of the world."""
_SLACK_M = 0.005
"""A shape so near to the plane of a fan is seen: so the plane of a robot that drives is looked at seldom."""
_HIDDEN = mujoco.mjNGROUP - 1
"""A group that no ray sees."""


class RayBounds:
    """While entered, `mj_multiRay` misses nothing of the bodies that rays see, and skips the others whole.

    By itself it skips a body whose bounding sphere a ray misses, but puts that sphere at the centre of mass
    plus the volume's offset from it without turning the offset with the body (engine_ray.c, mju_singleRay;
    seen in MuJoCo 3.17). A sphere around the centre of mass itself, larger by the offset, holds the body in
    every attitude. Collisions need the volumes as they are: there a larger one costs time.
    """

    def __init__(self, model: mujoco.MjModel, groups: NDArray[np.uint8], savings: Savings = ALL) -> None:
        """Bind to a model; `groups` of the shapes that rays see, shape (mjNGROUP,)."""
        seen = np.bincount(model.geom_bodyid, weights=_are_seen(model, groups), minlength=model.nbody)
        self._unseen = np.flatnonzero((seen == 0) & savings.plane_of_rays)
        self._counts = model.body_geomnum
        self._all = self._counts[self._unseen]
        roots = model.body_bvhadr[model.body_bvhadr >= 0]
        offset = np.linalg.norm(model.bvh_aabb[roots, :3], axis=1)
        self._roots = roots[offset > 0.0]
        self._volumes = model.bvh_aabb
        self._exact = model.bvh_aabb[self._roots]
        half = self._exact[:, 3:]
        growth = 1.0 + offset[offset > 0.0] / np.linalg.norm(half, axis=1)
        self._safe = np.hstack((np.zeros_like(half), half * growth[:, None]))

    def __enter__(self) -> None:
        self._volumes[self._roots] = self._safe
        self._counts[self._unseen] = 0

    def __exit__(self, *_: object) -> None:
        self._volumes[self._roots] = self._exact
        self._counts[self._unseen] = self._all


class BodiesInReach:
    """While entered, `mj_multiRay` skips bodies out of reach, off the plane of a flat fan, beside a bundle.

    It does so by itself, but ray by ray: with many robots that is most of what a scan costs.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        directions: Array,
        groups: NDArray[np.uint8],
        reach: float,
        savings: Savings,
    ) -> None:
        """Bind to a model.

        Args:
            model: The compiled world.
            directions: As of `FanSlice`.
            groups: Of the shapes that rays see, shape (mjNGROUP,).
            reach: Of the rays [m].
            savings: What is not done over again.
        """
        self._normal = _normal(directions)
        self._sides: Array | None = None
        self.aim(directions)
        self._geoms = np.flatnonzero(
            _are_seen(model, groups) & (model.geom_bodyid > 0) & savings.plane_of_rays
        )
        is_plane = model.geom_type[self._geoms] == mujoco.mjtGeom.mjGEOM_PLANE
        self._radius = np.where(is_plane, math.inf, model.geom_rbound[self._geoms])
        self._reach = reach + self._radius
        self._bodies, self._first = np.unique(model.geom_bodyid[self._geoms], return_index=True)
        self._counts = model.body_geomnum
        self._all = self._counts[self._bodies]
        self._now = self._all

    def aim(self, directions: Array) -> None:
        """Take other rays, which fill no plane."""
        self._sides = None if self._normal is not None else _sides(directions)

    def look(self, data: mujoco.MjData, body: int) -> None:
        """Find what the rays of a link `body` may hit at present."""
        if not len(self._geoms):
            return
        away = data.geom_xpos[self._geoms] - data.xpos[body]
        hit = np.einsum("ij,ij->i", away, away) <= self._reach**2
        if self._normal is not None:
            hit &= np.abs(away @ (data.xmat[body].reshape(3, 3) @ self._normal)) <= self._radius + _FLAT_M
        if self._sides is not None:
            inward = away @ (data.xmat[body].reshape(3, 3) @ self._sides.T)
            hit &= inward.min(axis=1) >= -self._radius - _SLACK_M
        self._now = np.where(np.logical_or.reduceat(hit, self._first), self._all, 0)

    def __enter__(self) -> None:
        self._counts[self._bodies] = self._now

    def __exit__(self, *_: object) -> None:
        self._counts[self._bodies] = self._all


class _Scenery:
    """While entered, `mj_multiRay` does not see the scenery that `look` found to be out of the way.

    It tests every ray against every shape.
    """

    def __init__(self, model: mujoco.MjModel, groups: NDArray[np.uint8], is_sliced: bool) -> None:
        """Bind to a model.

        Args:
            model: The compiled world.
            groups: Of the shapes that rays see, shape (mjNGROUP,).
            is_sliced: If not, all is seen.
        """
        self._groups = model.geom_group
        bounded = (model.geom_bodyid == 0) & (model.geom_type != mujoco.mjtGeom.mjGEOM_PLANE)
        is_sliced = is_sliced and not groups[_HIDDEN]
        self._geoms = np.flatnonzero(_are_seen(model, groups) & bounded & is_sliced)
        self._centre, self._half = _boxes(model, self._geoms)
        self._shown = self._groups[self._geoms]
        self._now = self._shown

    def __enter__(self) -> None:
        self._groups[self._geoms] = self._now

    def __exit__(self, *_: object) -> None:
        self._groups[self._geoms] = self._shown


class FanSlice(_Scenery):
    """Leaves out the scenery that the plane of a flat fan misses: most of it is above or below a lidar."""

    def __init__(
        self,
        model: mujoco.MjModel,
        directions: Array,
        groups: NDArray[np.uint8],
        savings: Savings = ALL,
    ) -> None:
        """Bind to a model.

        Args:
            model: The compiled world.
            directions: Unit vectors in the link's frame, shape (n, 3); where they fill no plane, all is seen.
            groups: Of the shapes that rays see, shape (mjNGROUP,).
            savings: What is not done over again.
        """
        normal = _normal(directions)
        super().__init__(model, groups, normal is not None and savings.plane_of_rays)
        self._normal = np.zeros(3) if normal is None else normal
        """Of the plane, in the link's frame."""
        self._radius = float(np.linalg.norm(np.abs(self._centre) + self._half, axis=1).max(initial=0.0))
        self._plane: tuple[Array, float] = np.zeros(3), math.inf
        """Normal and height [m] when it was looked at last, in the world."""

    def look(self, data: mujoco.MjData, body: int) -> None:
        """Find what the plane of the fan, whose link is `body`, meets at present."""
        if not len(self._geoms):
            return
        normal = data.xmat[body].reshape(3, 3) @ self._normal
        height = float(data.xpos[body] @ normal)
        turned = math.dist(normal, self._plane[0])
        if self._radius * turned + abs(height - self._plane[1]) < _SLACK_M / 2.0:
            return
        self._plane = normal, height
        reach = self._half @ np.abs(normal) + _SLACK_M
        self._now = np.where(np.abs(self._centre @ normal - height) > reach, _HIDDEN, self._shown)


class PyramidSlice(_Scenery):
    """Leaves out the scenery beside a bundle of rays, such as a part of what a spinning lidar sees."""

    def __init__(
        self,
        model: mujoco.MjModel,
        directions: Array,
        groups: NDArray[np.uint8],
        savings: Savings = ALL,
    ) -> None:
        """Bind to a model; as `FanSlice`, but where rays fill a plane, or go apart too far, all is seen."""
        sides = _sides(directions) if _normal(directions) is None else None
        super().__init__(model, groups, sides is not None and savings.plane_of_rays)
        self._sides = sides

    def aim(self, directions: Array) -> None:
        """Take other rays, which may fill a plane or go apart as they like."""
        self._sides = _sides(directions) if len(self._geoms) else None

    def look(self, data: mujoco.MjData, body: int) -> None:
        """Find what the pyramid of the rays of a link `body` holds at present."""
        if self._sides is None or not len(self._geoms):
            self._now = self._shown
            return
        sides = self._sides @ data.xmat[body].reshape(3, 3).T
        inside = (self._centre - data.xpos[body]) @ sides.T + self._half @ np.abs(sides).T
        self._now = np.where(inside.min(axis=1) < -_SLACK_M, _HIDDEN, self._shown)


def _sides(directions: Array) -> Array | None:
    """Return inward normals of a pyramid that holds rays, shape (4, 3); None: they go apart too far."""
    axis = directions.mean(axis=0)
    length = float(np.linalg.norm(axis))
    if length < 0.1:
        return None
    axis /= length
    across = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    along = directions @ axis
    if along.min() < 0.1:
        return None
    sides = []
    for side in (across / np.linalg.norm(across), np.cross(axis, across / np.linalg.norm(across))):
        slopes = directions @ side / along
        sides += [side - slopes.min() * axis, slopes.max() * axis - side]
    return np.array([side / np.linalg.norm(side) for side in sides])


def _normal(directions: Array) -> Array | None:
    """Return the normal of the plane in which unit vectors, shape (n, 3), lie; None if there is none."""
    normal: Array = np.linalg.eigh(directions.T @ directions)[1][:, 0]
    return normal if np.abs(directions @ normal).max() < _FLAT else None


def _are_seen(model: mujoco.MjModel, groups: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Return for each shape whether rays see its group."""
    return groups[np.clip(model.geom_group, 0, mujoco.mjNGROUP - 1)] > 0


def _boxes(model: mujoco.MjModel, geoms: NDArray[np.intp]) -> tuple[Array, Array]:
    """Return centres and half sizes, shape (n, 3), of axis-aligned boxes around the world body's shapes."""
    rows = np.zeros((len(geoms), 9))
    for row, quat in zip(rows, model.geom_quat[geoms], strict=True):
        mujoco.mju_quat2Mat(row, quat)
    turns = rows.reshape(-1, 3, 3)
    centre, half = np.hsplit(model.geom_aabb[geoms], 2)
    placed = model.geom_pos[geoms] + np.einsum("nij,nj->ni", turns, centre)
    return placed, np.einsum("nij,nj->ni", np.abs(turns), half)
